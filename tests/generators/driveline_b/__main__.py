"""Command line: write cases to a folder, and their labels to a file outside of it."""

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

from tests.generators.driveline_b.case import Case, write_case
from tests.generators.driveline_b.effect_catalogue import parse_effects
from tests.generators.driveline_b.solver import compile_solver

FORMAT = "driveline-b-labels-1"


def main(arguments: Sequence[str] | None = None) -> int:
    """Write all cases; return the exit code. The same arguments give the same bytes."""
    given = _parser().parse_args(arguments)
    try:
        cases = order_cases(given.effects, given.seed, given.strength)
    except ValueError as error:
        return _refuse(str(error))
    if given.labels.resolve().is_relative_to(given.out.resolve()):
        return _refuse("the labels would lie among the cases")
    if given.labels.exists() or (given.out.exists() and any(given.out.iterdir())):
        return _refuse(f"{given.out} is not empty, or {given.labels} is there already")
    compile_solver()
    with ProcessPoolExecutor(given.jobs) as pool:
        labels = list(pool.map(partial(write_case, folder=given.out), cases))
    given.labels.parent.mkdir(parents=True, exist_ok=True)
    known: dict[str, Any] = {c.name: label for c, label in zip(cases, labels, strict=True)}
    text = json.dumps({"format": FORMAT, "cases": known}, indent=1)
    given.labels.write_text(text + "\n", encoding="ascii")
    print(f"{len(cases)} cases")
    return 0


def order_cases(effects: str, seed: int, strength: float) -> list[Case]:
    """Return cases in a random order, so that a number does not tell an effect.

    Raises ValueError for effects that `parse_effects` refuses, and if the strength is neither 0 nor
    between 0.05 and 1.5.
    """
    if strength != 0.0 and not 0.05 <= strength <= 1.5:
        raise ValueError("the strength is neither 0 nor from 0.05 to 1.5")
    if seed < 0:
        raise ValueError("the seed is negative")
    wanted = parse_effects(effects)
    order = np.random.default_rng([seed, len(wanted)]).permutation(len(wanted))
    return [Case(seed, number, wanted[place], strength) for number, place in enumerate(order)]


def _refuse(reason: str) -> int:
    """Print a reason and return the exit code 2."""
    print(f"error: {reason}", file=sys.stderr)
    return 2


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m tests.generators.driveline_b", description=__doc__
    )
    parser.add_argument("--out", type=Path, required=True, help="empty or new folder")
    parser.add_argument("--labels", type=Path, required=True, help="new file outside of it")
    parser.add_argument("--seed", type=int, required=True, help="0 or more")
    parser.add_argument("--effects", default="all:2,none:5", help="all:2,none:5,a:1,a+b:1")
    parser.add_argument("--strength", type=float, default=1.0, help="0: without the effects")
    parser.add_argument("--jobs", type=int, default=1, help="processes (1)")
    return parser


if __name__ == "__main__":
    sys.exit(main())
