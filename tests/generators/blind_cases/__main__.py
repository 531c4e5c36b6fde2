"""Command line: write cases, and their labels elsewhere."""

import argparse
import sys
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path
from typing import NoReturn

from tests.generators.blind_cases.case import Case, write_case
from tests.generators.blind_cases.case_specification import OrderError, parse_order
from tests.generators.blind_cases.label_digest import seal_digest, write_labels
from tests.generators.blind_cases.solver import compile_solver


def arguments(words: list[str] | None) -> argparse.Namespace:
    """The parsed command line."""
    parser = argparse.ArgumentParser(
        prog="python -m tests.generators.blind_cases", description=__doc__
    )
    parser.add_argument("--out", type=Path, required=True, help="empty or new folder")
    parser.add_argument("--labels", type=Path, required=True, help="new file outside of it")
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--effects", default="all:4,none:26", help="all:12,none:200 or a+b:2,...")
    parser.add_argument("--strength", type=float, default=1.0, help="0: the clean twins")
    parser.add_argument("--rate", type=int, help="Hz; without it all rates equally")
    parser.add_argument("--jobs", type=int, default=1, help="processes")
    return parser.parse_args(words)


def refused(reason: str) -> NoReturn:
    """Say why and end."""
    print(f"refused: {reason}", file=sys.stderr)
    raise SystemExit(2)


def check_places(out: Path, labels: Path) -> None:
    """Refuse to overwrite anything and to put the labels where the tool could read them."""
    if out.exists() and (not out.is_dir() or any(out.iterdir())):
        refused(f"{out} is not an empty folder")
    if labels.exists():
        refused(f"{labels} is there already")
    if labels.resolve().is_relative_to(out.resolve()):
        refused("the labels would lie within the cases")


def main(words: list[str] | None = None) -> int:
    """Write all cases; same arguments, same bytes."""
    given = arguments(words)
    check_places(given.out, given.labels)
    if not 1 <= given.jobs <= 64:
        refused("the number of jobs is not from 1 to 64")
    try:
        cases: list[Case] = parse_order(given.effects, given.seed, given.strength, given.rate)
    except OrderError as error:
        refused(str(error))
    compile_solver()
    write = partial(write_case, folder=given.out)
    if given.jobs == 1:
        labels = [write(case) for case in cases]
    else:
        with ProcessPoolExecutor(given.jobs) as pool:
            labels = list(pool.map(write, cases, chunksize=1))
    write_labels(given.labels, {case.name: one for case, one in zip(cases, labels, strict=True)})
    print(f"{len(cases)} cases; labels' seal {seal_digest(given.labels)}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
