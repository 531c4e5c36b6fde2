"""Thirty fixed cases that CI diagnoses blind: each effect once, four cases without an effect.

The verdicts are compared with the stored ones of docs/evidence/fixed_cases.json. A change of the
method that changes verdicts on purpose writes the file anew (`--update`) and repeats the study.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

from tests.validation.blind_study.case_score import Answer
from tests.validation.blind_study.cases import GENERATOR
from tests.validation.blind_study.plan import Plan
from tests.validation.blind_study.results_store import diagnose_cases, threads
from tests.validation.evidence.evidence_store import ROOT

SEED = 20261226
JOBS = 2
PLANS = (Plan("full", "all:1"), Plan("clean", "none:4", strength=0.0))
VERDICTS = ROOT / "docs" / "evidence" / "fixed_cases.json"


def main(arguments: Sequence[str] | None = None) -> int:
    """Diagnose the cases; return 0 if all verdicts are the stored ones."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--update", action="store_true", help="store the verdicts of now")
    update = parser.parse_args(arguments).update
    answers = [
        answer
        for plan in PLANS
        for answer in diagnose_cases(plan, SEED, partial(threads, JOBS), None, GENERATOR)
    ]
    verdicts = {f"{answer.plan} {answer.case}": verdict_of(answer) for answer in answers}
    if update:
        VERDICTS.write_text(json.dumps(verdicts, indent=1) + "\n", "utf-8")
    differences = compare_verdicts(json.loads(VERDICTS.read_text("utf-8")), verdicts)
    for line in differences:
        print(line)
    effects = [answer for answer in answers if answer.ids]
    named = sum(answer.is_named for answer in effects)
    alarms = sum(answer.is_alarm for answer in answers if not answer.ids)
    print(
        f"{len(answers)} verdicts, {len(differences)} differ from the stored ones; "
        f"{named} of {len(effects)} effects named first, {alarms} false alarms"
    )
    return 1 if differences else 0


def verdict_of(answer: Answer) -> dict[str, Any]:
    """Return the parts of a verdict that are compared: outcome, effects, places, confusion set."""
    verdict = answer.verdict
    return {
        "true": answer.true,
        "verdict": verdict.get("verdict", "failed"),
        "effects": [f"{one['id']}@{one['place']}" for one in verdict.get("effects", ())],
        "ambiguous_with": sorted(
            f"{one['id']}@{one['place']}" for one in verdict.get("ambiguous_with", ())
        ),
        "places": list(verdict.get("location", {}).get("places", ()))[:2],
    }


def compare_verdicts(
    stored: Mapping[str, Mapping[str, Any]], found: Mapping[str, Mapping[str, Any]]
) -> list[str]:
    """Return a line for each case whose verdict differs from the stored one, or is missing."""
    return [
        f"{name}: stored {stored.get(name)}, found {found.get(name)}"
        for name in dict.fromkeys((*stored, *found))
        if stored.get(name) != found.get(name)
    ]


if __name__ == "__main__":
    sys.exit(main())
