"""Prove diagnosis: cases of the sealed generator, each diagnosed blind; docs/proof.md from that."""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from collections.abc import Sequence

from tests.proof.answer import Answer
from tests.proof.bar import bars
from tests.proof.cases import GENERATOR
from tests.proof.catalogue import pairs_of
from tests.proof.kept import answers
from tests.proof.plan import SEED, plans


def main(arguments: Sequence[str] | None = None) -> int:
    """Diagnose what is not diagnosed yet; return 0 if every bar is met."""
    given = _parser().parse_args(arguments)
    wanted = given.plans.split(",") if given.plans else None
    every: list[Answer] = []
    for plan in plans(pairs_of(given.generator), given.seed, given.share):
        if wanted is None or plan.name in wanted:
            every += answers(plan, given.seed, given.jobs, given.first, given.generator)
    found = bars(every)
    for bar in found:
        print(f"{'met ' if bar.met else 'OPEN'} {bar.about}: {bar.asked}: {bar.text}")
    _print_wrong(every)
    return 0 if all(bar.met for bar in found) else 1


def _print_wrong(every: Sequence[Answer]) -> None:
    wrong = Counter(
        (one.plan, one.true, one.said) for one in every if one.plan == "full" and not one.is_named
    )
    for (plan, true, said), count in sorted(wrong.items()):
        print(f"{plan}: {true} was called {said} {count} times")


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m tests.proof", description=__doc__)
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--jobs", type=int, default=2, help="diagnoses at a time (2)")
    parser.add_argument("--plans", help="some of full,clean,weak,pairs,removed")
    parser.add_argument("--first", type=int, help="so many cases of each plan only")
    parser.add_argument("--share", type=float, default=1.0, help="of the cases of each plan (1)")
    parser.add_argument("--generator", default=GENERATOR, help=f"a package ({GENERATOR})")
    return parser


if __name__ == "__main__":
    sys.exit(main())
