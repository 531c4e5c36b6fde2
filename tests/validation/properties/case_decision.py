"""Case decision: the decision on one case by a process of its own, without report and held-out.

python -m tests.validation.properties.case_decision CASE RESULT [--reverse-effects]
"""

from __future__ import annotations

import argparse
import json
import resource
from pathlib import Path
from typing import Any

from diagnosis.data.sampled_recording import compared_outputs, share_period
from diagnosis.estimation.covariance import quantities_of
from diagnosis.model.effect_library import library_effects
from diagnosis.model.placed_effect import place_path
from diagnosis.pipeline.decision import DiagnosisDecision, decide
from diagnosis.pipeline.diagnosis_case import Case, build_model_set, read_series
from diagnosis.result.verdict import replace_non_finite, verdict_id
from diagnosis.selection.candidate_search import CandidateFit
from language.loading.load import automaton_of
from language.loading.recording_map_reader import read_map
from language.model.automaton import Automaton
from language.overlays.effect_reader import Effect
from language.overlays.expand_document import Project, expand_document, read_document
from modewright.runtime.blas_threads import SingleThreadedBlas

LISTED = 8
"""Candidates that are recorded, those of largest gain."""


def main() -> None:
    """Decide on the case in a folder with spec.yaml, map.yaml and train/; write the result."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("case", type=Path, help="folder with spec.yaml, map.yaml and train/")
    parser.add_argument("result", type=Path, help="JSON file to write")
    parser.add_argument("--reverse-effects", action="store_true", help="of the library")
    given = parser.parse_args()
    with SingleThreadedBlas():
        found = decide_case(given.case, given.reverse_effects)
    uses = map(resource.getrusage, (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    cpu = sum(one.ru_utime + one.ru_stime for one in uses)
    given.result.write_text(json.dumps({**found, "cpu_s": cpu}, indent=1))


def decide_case(
    folder: Path, reverses_effects: bool = False, effects: tuple[Effect, ...] | None = None
) -> dict[str, Any]:
    """Return the decision on a case folder as JSON (`record`), with the library by default."""
    project = Project(Path())
    document = read_document(folder / "spec.yaml")
    automaton = automaton_of(document, project)
    mapping = read_map(read_document(folder / "map.yaml"), project)
    effects = library_effects(project) if effects is None else effects
    case = Case(
        expand_document(document, project),
        project,
        mapping,
        tuple(sorted((folder / "train").glob("*.csv"))),
        effects=effects[::-1] if reverses_effects else effects,
    )
    seen = compared_outputs(mapping, automaton)
    series = [one for file in case.train for one in read_series(file, case, automaton, seen)]
    model_set = build_model_set(case, automaton, share_period(series), seen)
    return record(decide(case, model_set, lambda text: None), automaton)


def record(decision: DiagnosisDecision, automaton: Automaton) -> dict[str, Any]:
    """Return outcome, effects with places and gains [nats], parameters [SI] and candidates."""
    selection = decision.selection
    found: dict[str, Any] = {
        "outcome": decision.outcome,
        "effects": [_record_fit(one, automaton) for one in selection.accepted],
        "parameters": {
            name: [one.value, one.std, one.unit]
            for name, one in quantities_of(selection.model).items()
        },
        "energy": float(selection.first.energy),
        "correlation": float(selection.first.correlation),
        "period": float(decision.model_set.period),
        "candidates": [
            _record_fit(one, automaton) for one in selection.first.candidates if one.is_fitted
        ][:LISTED],
    }
    clean: dict[str, Any] = replace_non_finite(found)
    return clean


def _record_fit(one: CandidateFit, automaton: Automaton) -> dict[str, Any]:
    """Return name, place, gain [nats] and explained share of a candidate."""
    return {
        "name": verdict_id(one.placed_effect, automaton),
        "place": place_path(one.placed_effect),
        "gain": float(one.gain),
        "share": float(one.share),
    }


if __name__ == "__main__":
    main()
