"""Write diagnosis cases: python -m tests.generators.open_cases --out DIR --labels FILE --seed N."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from tests.generators.open_cases.case import RATES, draw_case, simulate_cases
from tests.generators.open_cases.effect_catalogue import LIBRARY, parse_effects
from tests.generators.open_cases.label import FORMAT, case_label
from tests.generators.open_cases.recording import write_case

SIDE_BY_SIDE = 12
"""Cases simulated at a time: more would not be faster per case and need much memory."""
NUMBERS = Sequence[tuple[int, tuple[str, ...]]]

DESCRIPTION = """\
Simulate an electric driveline with a gap, with or without a piece of missing physics, and write
each case as a folder: case_NNN/train/rec_00.csv ... (50 s or more in all) and case_NNN/held_out/
rec_00.csv ... (30 s or more), columns t_s,T_em_Nm,T_br_Nm,w_em_radps,w_w_radps. What is true goes
to the labels file alone. The same arguments give the same bytes."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; return its exit code."""
    given = _parser().parse_args(arguments)
    try:
        cases = parse_effects(given.effects, given.count)
    except ValueError as error:
        return _refused(str(error))
    if min(given.seed, given.strength) < 0 or min(given.count, given.jobs) < 1:
        return _refused("seed and strength are 0 or more, count and jobs 1 or more")
    if given.labels.resolve().is_relative_to(given.out.resolve()):
        return _refused("the labels would lie among the cases")
    if given.out.exists() and any(given.out.iterdir()):
        return _refused(f"{given.out} is not empty")
    order = np.random.Generator(np.random.PCG64(given.seed)).permutation(len(cases)).tolist()
    numbered = [(number, cases[place]) for number, place in enumerate(order)]
    write = partial(write_batch, given.out, given.seed, strength=given.strength, rate=given.rate)
    batches = [numbered[i : i + SIDE_BY_SIDE] for i in range(0, len(numbered), SIDE_BY_SIDE)]
    labels: dict[str, Any] = {}
    with ProcessPoolExecutor(given.jobs) as pool:
        for written in pool.map(write, batches):
            labels |= written
            print(f"{len(labels)} of {len(cases)} cases", flush=True)
    given.labels.parent.mkdir(parents=True, exist_ok=True)
    text = json.dumps({"format": FORMAT, "cases": labels}, indent=1)
    given.labels.write_text(text + "\n", encoding="utf-8")
    return 0


def _refused(reason: str) -> int:
    print(f"error: {reason}", file=sys.stderr)
    return 2


def write_batch(
    out: Path, seed: int, numbered: NUMBERS, strength: float, rate: int | None
) -> dict[str, Any]:
    """Simulate and write some cases; return their labels by folder name."""
    cases = [draw_case(seed, number, effects, strength, rate) for number, effects in numbered]
    for case, recordings in zip(cases, simulate_cases(cases), strict=True):
        write_case(out / f"case_{case.number:03d}", case, recordings)
    return {f"case_{case.number:03d}": case_label(case, strength) for case in cases}


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m tests.generators.open_cases",
        description=DESCRIPTION,
        epilog="effects: " + ", ".join(f"{e.name}@{e.place}" for e in LIBRARY.values()),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--out", type=Path, required=True, help="folder of the cases")
    parser.add_argument("--labels", type=Path, required=True, help="JSON file outside of --out")
    parser.add_argument("--seed", type=int, required=True, help="0 or more; cases depend on it")
    parser.add_argument(
        "--effects",
        default="all,none",
        help="comma-separated: names, a+b for two at once, all, none; each may end in :COUNT",
    )
    parser.add_argument("--count", type=int, default=1, help="cases of each entry (1)")
    parser.add_argument(
        "--rate", type=int, choices=RATES, help="sampling rate in Hz (drawn for each case)"
    )
    parser.add_argument(
        "--strength", type=float, default=1.0, help="of the effects: 1 plain, 0.3 weak, 0 nothing"
    )
    parser.add_argument("--jobs", type=int, default=1, help="processes (1)")
    return parser


if __name__ == "__main__":
    sys.exit(main())
