"""Fixed cases of all generators that CI diagnoses; a third of them has no effect.

The verdicts are compared with the stored ones of docs/evidence/fixed_cases.json. A change of the
method that changes verdicts on purpose writes the file again (`--update`) and repeats the study.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Mapping, Sequence
from typing import Any

from tests.validation.evidence.evidence_store import ROOT
from tests.validation.study.case_score import Answer
from tests.validation.study.generator_table import Group, generators
from tests.validation.study.result_store import diagnose_group

SEED = 20261226
JOBS = 2
FIXED = "fixed"
VERDICTS = ROOT / "docs" / "evidence" / "fixed_cases.json"


def main(arguments: Sequence[str] | None = None) -> int:
    """Diagnose the cases; return 0 if all verdicts are the stored ones."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--update", action="store_true", help="store the verdicts of now")
    parser.add_argument("--jobs", type=int, default=JOBS, help=f"diagnoses at a time ({JOBS})")
    given = parser.parse_args(arguments)
    answers = [
        answer
        for generator in generators()
        for answer in diagnose_group(
            generator, Group(generator.name, FIXED, SEED, generator.fixed), given.jobs
        )
    ]
    verdicts = {f"{answer.generator} {answer.case}": verdict_of(answer) for answer in answers}
    if given.update:
        VERDICTS.write_text(json.dumps(verdicts, indent=1) + "\n", "utf-8")
    stored = json.loads(VERDICTS.read_text("utf-8")) if VERDICTS.exists() else {}
    differences = compare_verdicts(stored, verdicts)
    for line in differences:
        print(line)
    effects = [answer for answer in answers if answer.ids]
    named = sum(answer.is_named() for answer in effects)
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
        "verdict": verdict.get("verdict", "no verdict"),
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
