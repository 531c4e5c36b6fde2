"""Verify how fast a flat chart with waits is ticked, beside Python packages and C by hand.

Into docs/evidence/mode_logic.json.
"""

from __future__ import annotations

import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT))

from tests.benchmark.chart_speed import measure_charts  # noqa: E402
from tests.validation.evidence.evidence_store import Figure, measure_figures  # noqa: E402

PAIRS = 15
OVER_FASTEST, OVER_C = 1.0, 0.8
"""Ticks a second of ours over those of the fastest package, and of the C by hand, at least."""


def main() -> int:
    """Measure what is not measured yet; return 0 if every bar is met."""
    return measure_figures("mode_logic", {"chart_speed": chart_speed})


def chart_speed() -> Figure:
    """Medians of ratios of ticks a second; the C by hand holds no input in a range."""
    found = measure_charts(PAIRS)
    ours = found["interpreter_over_fastest"]["median"], found["generated_over_c"]["median"]
    met = ours[0] >= OVER_FASTEST and ours[1] >= OVER_C
    return {"met": met, **{name: one["median"] for name, one in found.items()}}


if __name__ == "__main__":
    sys.exit(main())
