"""Prove diagnosis: cases of the sealed generator, each diagnosed blind; docs/proof.md from that."""

from __future__ import annotations

import argparse
import random
import sys
from collections import Counter
from collections.abc import Sequence
from functools import partial
from statistics import median

from tests.validation.blind_study.acceptance_criteria import Bar, bars
from tests.validation.blind_study.case_score import Answer
from tests.validation.blind_study.cases import GENERATOR
from tests.validation.blind_study.effect_catalogue import pairs_of
from tests.validation.blind_study.label_digests import is_sealed, seals_of, write_seals
from tests.validation.blind_study.negative_control import (
    TIMES,
    baseline_alarm_rate,
    baseline_rate,
    majority_rate,
    permutation_score,
)
from tests.validation.blind_study.plan import SEED, Plan, plans
from tests.validation.blind_study.proof_page import write_page
from tests.validation.blind_study.results_store import dask, diagnose_cases, export_study, threads
from tests.validation.evidence.evidence_store import ROOT

VERDICTS = ROOT / "docs" / "evidence" / "proof.parquet"
ASKED = 0.1
"""Seconds of a compiler that compiled nothing, at most: it is asked what it is."""
EXAMPLES = """\
# make all cases, write the hashes of their labels
python -m tests.validation.blind_study --seal
# diagnose what is not diagnosed yet, write docs/proof.md
python -m tests.validation.blind_study
# results so far into docs/evidence, to go on elsewhere
python -m tests.validation.blind_study --carry
# a look at other cases
python -m tests.validation.blind_study --seed 5 --share 0.1 --plans full,clean"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Diagnose what is not diagnosed yet; return 0 if every bar is met."""
    given = _parser().parse_args(arguments)
    study = plans(pairs_of(given.generator), given.seed, given.share)
    if given.seal:
        write_seals(seals_of(study, given.seed, given.generator))
        return 0
    if given.carry:
        count = export_study(study, given.seed, given.generator, VERDICTS)
        print(f"wrote {count} results to {VERDICTS.relative_to(ROOT)}")
        return 0
    wanted = given.plans.split(",") if given.plans else [plan.name for plan in study]
    every: list[Answer] = []
    for plan in study:
        if plan.name in wanted:
            workers = (
                partial(dask, given.cluster) if given.cluster else partial(threads, given.jobs)
            )
            source = given.seed, workers, given.first, given.generator
            every += diagnose_cases(plan, *source, carried=VERDICTS)
    found = bars(every)
    for bar in found:
        print(f"{'met   ' if bar.met else 'MISSED'} {bar.about}: {bar.asked}: {bar.text}")
    for line in (*_wrong(every), *_beside(every, given.seed)):
        print(line)
    if given.first is None and len(wanted) == len(study):
        _publish(study, every, found, given)
    return 0 if all(bar.met for bar in found) else 1


def _publish(
    study: Sequence[Plan], every: list[Answer], found: list[Bar], given: argparse.Namespace
) -> None:
    """Write the page of a whole study whose labels were sealed before."""
    seals = seals_of(study, given.seed, given.generator)
    if is_sealed(seals):
        export_study(study, given.seed, given.generator, VERDICTS)
        write_page(every, found, seals, _beside(every, given.seed))
        print("wrote docs/proof.md")
    else:
        print("docs/proof.md is left as it is: the labels of this study are not sealed")


def _beside(every: Sequence[Answer], seed: int) -> list[str]:
    """Return what controls and simpler methods reach on the same cases."""
    full, clean = ([one for one in every if one.plan == name] for name in ("full", "clean"))
    if not full:
        return []
    chance = permutation_score(full, random.Random(seed))
    lines = [
        "The first control exchanges the labels of the cases at random. The first name then agrees "
        f"with the label in {chance:.1%} of the cases (mean of {TIMES} permutations).",
        "The second control names the most frequent effect in every case. This name is right in "
        f"{majority_rate(full).text} cases.",
        "The first simpler method fits the parameters of the base and does nothing else. "
        "It therefore never names an effect.",
    ]
    for method, words in (
        (
            "sindy",
            "The second simpler method is a sparse regression (PySINDy) of the residuals that the "
            "balances of the recalibrated base leave.",
        ),
        (
            "free_gain",
            "The third simpler method chooses the effect that reduces the error of a simulation "
            "without corrections by measurements most.",
        ),
    ):
        line = f"{words} It names the right effect in {baseline_rate(full, method).text} cases."
        if clean:
            alarms = baseline_alarm_rate(clean, method).text
            line += f" It gives a false alarm in {alarms} cases without an effect."
        lines.append(line)
    return [*lines, _compiled([*full, *clean])]


def _compiled(some: Sequence[Answer]) -> str:
    """Returns the share of the C compiler; a model of an earlier case is in the cache."""
    part = sum(one.compiler_s for one in some) / sum(one.cpu_s for one in some)
    kept = [one.cpu_s for one in some if one.plan == "full" and not _is_compiled(one)]
    usual = f" The median processor time of these cases is {median(kept):.1f} s." if kept else ""
    return (
        f"The diagnosis compiles models to C. The C compiler used {part:.0%} of the processor time "
        f"of the groups `full` and `clean`. In {len(kept)} cases of the group `full` all compiled "
        f"models were in the cache, because earlier cases had compiled them.{usual}"
    )


def _is_compiled(one: Answer) -> bool:
    return one.compiler_s > ASKED


def _wrong(every: Sequence[Answer]) -> list[str]:
    """Return what was called what, where it is not right."""
    kinds = Counter((one.plan, one.true, one.said) for one in every if _is_wrong(one))
    return [f"{plan}: {true}: {said}, {n} times" for (plan, true, said), n in sorted(kinds.items())]


def _is_wrong(one: Answer) -> bool:
    if one.plan == "clean":
        return one.is_alarm
    return one.said != "unknown" if one.plan == "removed" else not one.is_named


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m tests.validation.blind_study",
        description=__doc__,
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--jobs", type=int, default=2, help="diagnoses at a time (2)")
    parser.add_argument("--cluster", help="diagnose on Dask's workers: local:4, tls://head:8786")
    parser.add_argument("--plans", help="some of full,clean,weak,pairs,removed")
    parser.add_argument("--first", type=int, help="so many cases of each plan only")
    parser.add_argument("--share", type=float, default=1.0, help="of the cases of each plan (1)")
    parser.add_argument("--generator", default=GENERATOR, help=f"a package ({GENERATOR})")
    parser.add_argument("--seal", action="store_true", help="only write the hashes of all labels")
    parser.add_argument(
        "--carry", action="store_true", help="only write the results so far, to go on elsewhere"
    )
    return parser


if __name__ == "__main__":
    sys.exit(main())
