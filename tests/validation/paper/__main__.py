"""Reproduce the paper: every figure and Table 1 from specs, and what a better observer reaches."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable, Sequence

from tests.validation.evidence.evidence_store import ROOT, code_digest
from tests.validation.paper.claims import claims
from tests.validation.paper.manoeuvre import table_1
from tests.validation.paper.observers import better_observer, run_studies
from tests.validation.paper.paper_figures import draw
from tests.validation.paper.pareto_front import picture, run_pareto
from tests.validation.paper.report_page import FOLDER, SPECS, write_measurements_json, write_page

SEED, SAMPLES = 2018, 200
"""Manoeuvres that nothing was tuned on."""
EXAMPLES = """\
# all of it: docs/paper, build/paper.json
python -m tests.validation.paper
# other manoeuvres; the page is left as it is
python -m tests.validation.paper --seed 7 --samples 200"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Reproduce the paper; return 0 if all its claims hold."""
    given = _parser().parse_args(arguments)
    os.chdir(ROOT)
    table, found = table_1(), claims()
    for claim in found:
        print(
            f"{'holds' if claim.holds else 'DIFFERS'} {claim.figure}: {claim.measured}", flush=True
        )
    is_shown = given.seed == SEED and given.samples == SAMPLES
    if is_shown:
        draw(FOLDER)
    folder = ROOT / "build" / "paper" / code_digest(("language", *SPECS))[:12]
    rows = run_studies(folder / f"{given.seed}_{given.samples}", given.seed, given.samples)
    for row in rows:
        print(
            f"{row.scheme} {row.rate} Hz {'matched' if row.is_matched else 'mismatch'}: first gap "
            f"{row.median:.2f} / {row.p95:.2f} ms, missed {row.missed_first} of {row.count}, "
            f"false {row.false}, torque {row.torque:.2f} N*m, cruise {row.cruise:.1f} 1/min"
        )
    figures = {
        "better_observer": better_observer(rows),
        "better_observer_mismatch": better_observer(rows, is_matched=False),
    }
    points = run_pareto(folder)
    write_measurements_json(given.seed, table, rows, points, figures)
    if is_shown:
        write_page(given.seed, table, found, rows, points)
        picture(points).savefig(FOLDER / "pareto.png", dpi=110, metadata={"Software": None})
    print(f"wrote build/paper.json{' and docs/paper' if is_shown else ''}")
    return 0 if all(claim.holds for claim in found) else 1


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m tests.validation.paper",
        description=__doc__,
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--seed", type=whole(0), default=SEED, help="of the random manoeuvres")
    parser.add_argument("--samples", type=whole(2), default=SAMPLES, help="manoeuvres in each row")
    return parser


def whole(least: int) -> Callable[[str], int]:
    """Return what reads a whole number that is not below a least one."""

    def number(text: str) -> int:
        if int(text) < least:
            raise ValueError(text)
        return int(text)

    return number


if __name__ == "__main__":
    sys.exit(main())
