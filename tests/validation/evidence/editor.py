"""Verify the language server: how soon an edit of a large spec shows its problems.

A process at the other end of two pipes, as an editor has it: 30 modes, 180 transitions with guards
over 12 inputs and 12 equations; each edit makes or mends a mistake in another guard.
"""

from __future__ import annotations

import random
import statistics
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).parents[3]
sys.path.insert(0, str(ROOT))

from tests.modewright.lsp.client import LspClient, seconds_of_edit  # noqa: E402
from tests.validation.evidence.evidence_store import Figure, measure_figures  # noqa: E402

MODES = 30
WAYS = 6
INPUTS = 12
EDITS = 100
EDIT_SECONDS = 0.3
"""From an edit to its problems, at the 95th percentile."""


def main() -> int:
    """Measure what is not measured yet; return 0 if every bar is met."""
    return measure_figures("mode_logic", {"edits": edits})


def edits() -> Figure:
    """Edits of a chart of 30 modes and 180 transitions, half of them mistakes."""
    text = spec()
    with tempfile.TemporaryDirectory() as name, LspClient() as talk:
        path = Path(name) / "spec" / "large.yaml"
        path.parent.mkdir()
        path.write_text(text)
        before = talk.open(path, text)
        errors = [problem for problem in before if problem["severity"] == 1]
        seconds, told = [], 0
        for k in range(EDITS):
            wrong = text.replace(f"e_{k % INPUTS} > p_", f"e{k}_ > p_", 1) if k % 2 == 0 else text
            seconds.append(seconds_of_edit(talk, path, wrong))
            told += len(talk.problems(path)) > len(before)
    late = statistics.quantiles(seconds, n=20)[-1]
    return {
        "met": not errors and told == EDITS // 2 and late < EDIT_SECONDS,
        "errors_of_the_spec": len(errors),
        "mistakes_told": told,
        "p95_s": round(late, 3),
        "median_s": round(statistics.median(seconds), 3),
    }


def spec(seed: int = 1) -> str:
    """Return a sampled automaton whose modes are all reached: a ring with ways across."""
    chance = random.Random(seed)
    lines = ["language: 1", "automaton: large", "period: 1 ms", "numbers: float64", "parameters:"]
    limits = [f"value: {chance.randint(1, 90)} N*m, range: [0, 100]" for _ in range(WAYS + 4)]
    lines += [f"  p_{k}: {{{limit}, tunable: true}}" for k, limit in enumerate(limits)]
    lines += ["inputs:", *(f"  u_{k}: {{unit: N*m, range: [-200, 200]}}" for k in range(INPUTS))]
    lines += ["discrete: {d: {unit: N*m, initial: 0, range: [-500, 500]}}", "equations:"]
    lines += [f"  e_{k}: 0.5 * u_{k} + p_{k % len(limits)}" for k in range(INPUTS)]
    lines += ["initial: m_0", "modes:"]
    for m in range(MODES):
        lines += [f"  m_{m}:", f"    entry: {{d: e_{m % INPUTS}}}", "    transitions:"]
        for j in range(WAYS):
            target = (m + 1 + j * 4) % MODES
            guard = f"e_{(m + j) % INPUTS} > p_{j + 3} and u_{(j + m * 3) % INPUTS} < {5 + j} N*m"
            wait = f"wait: {chance.randint(1, 9)} ms"
            lines.append(
                f"      t_{j}: {{to: m_{target}, when: {guard}, {wait}, priority: {j + 1}}}"
            )
    return "\n".join([*lines, "outputs: [mode, d]", ""])


if __name__ == "__main__":
    sys.exit(main())
