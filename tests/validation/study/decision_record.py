"""Decision record: the numbers on which a verdict is based, from which it can be decided again."""

from __future__ import annotations

from typing import Any

from diagnosis.model.placed_effect import effect_names, place_path
from diagnosis.pipeline.diagnose import Diagnosis
from diagnosis.result.verdict import verdict_id
from diagnosis.selection.candidate_search import CandidateFit
from language.model.automaton import Automaton


def record_decision(found: Diagnosis) -> dict[str, Any]:
    """Return the numbers of the comparison beside the base, and which effects were accepted.

    Gains are in nats. `energy` is what the base leaves, the sum over `channels`. Floats may be
    infinite.
    """
    first, automaton = found.selection.first, found.model_set.automaton
    return {
        "energy": float(first.energy),
        "channels": len(first.floor),
        "sampled_energy": float(first.sampled_energy),
        "correlation": float(first.correlation),
        "candidates": [_candidate(one, automaton) for one in first.candidates if one.is_fitted],
        "accepted": [_name(one, automaton) for one in found.selection.accepted],
        "share": float(found.selection.share),
    }


def _candidate(one: CandidateFit, automaton: Automaton) -> dict[str, Any]:
    """Return gain, explained share and number of own parameters of a fitted candidate."""
    assert one.estimate is not None
    own = effect_names(one.placed_effect)
    return {
        **_name(one, automaton),
        "gain": float(one.gain),
        "share": float(one.share),
        "parameters": sum(name in own for name in one.estimate.candidate.names),
    }


def _name(one: CandidateFit, automaton: Automaton) -> dict[str, str]:
    """Return the name of a candidate in a verdict, and its place."""
    return {
        "id": verdict_id(one.placed_effect, automaton),
        "place": place_path(one.placed_effect),
    }
