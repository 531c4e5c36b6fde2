"""Page: docs/paper/README.md, written from what was measured, and build/paper.json."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import yaml
from jinja2 import Environment, StrictUndefined

from tests.validation.evidence.evidence_store import ROOT, code_digest, write_json
from tests.validation.paper.claims import Claim
from tests.validation.paper.observers import NOTES, Row
from tests.validation.paper.pareto_front import Point

FOLDER = ROOT / "docs" / "paper"
PAGE = FOLDER / "README.md"
JSON = ROOT / "build" / "paper.json"
MARK = "The digest of `spec/paper/` and `spec/ev_driveline/` is `"
SPECS = ("spec/paper", "spec/ev_driveline")


def is_current(text: str) -> bool:
    """Tell whether a page was written with the specs as they are now."""
    return f"{MARK}{_digest()}`" in text


def write_page(
    seed: int,
    table: Mapping[str, float],
    found: Sequence[Claim],
    rows: Sequence[Row],
    points: Mapping[str, Sequence[Point]],
) -> None:
    """Write the page."""
    here = Path(__file__).parent
    shown = Environment(undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    text = shown.from_string((here / "paper.md.jinja").read_text("utf-8")).render(
        mark=MARK,
        digest=_digest(),
        seed=seed,
        table=table,
        claims=found,
        figures={claim.figure: claim for claim in found},
        rows=rows,
        notes=NOTES,
        points=points,
        checklist=yaml.safe_load((here / "checklist.yaml").read_text("utf-8")),
        readings=yaml.safe_load((here / "readings.yaml").read_text("utf-8")),
    )
    FOLDER.mkdir(parents=True, exist_ok=True)
    PAGE.write_text(text, encoding="utf-8")


def write_measurements_json(
    seed: int,
    table: Mapping[str, float],
    rows: Sequence[Row],
    points: Mapping[str, Sequence[Point]],
    figures: Mapping[str, Any],
) -> None:
    """Write what was measured as JSON."""
    everything = {
        "seed": seed,
        "table_1_ms": dict(table),
        **figures,
        "rows": [asdict(row) for row in rows],
        "pareto": {scheme: [asdict(point) for point in own] for scheme, own in points.items()},
    }
    write_json(JSON, everything)


def _digest() -> str:
    return code_digest(SPECS)[:16]
