"""Confidence cap: an upper limit of the probability of an effect that may be an imitation."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence

from diagnosis.data.sampled_recording import SampledRecording
from diagnosis.estimation.model_set import ModelSet
from diagnosis.selection.candidate_search import LogCallback
from diagnosis.selection.forward_selection import Selection
from diagnosis.validation.parameter_constancy import has_varying_parameters

PROBABILITY_CAP = 0.88
"""Probability that a first name then has at most: of 170 that were unsure in a study, 158 were
right; the twelve others were wrong, nine of them where the library lacked the effect."""


def cap_probability(model_set: ModelSet, selection: Selection, log: LogCallback) -> Selection:
    """Return a selection with a lower probability of the first effect if it may be an imitation.

    This is the case if its parameters vary between recordings, or if it needs other effects:
    physics can come in pairs, but an imitation of a missing effect does as well.
    """
    scores = [tried.score for tried in selection.first_round if tried.likelihood_gain]
    why = _cap_reason(model_set.series, selection)
    if not scores or not why:
        return selection
    log(f"less sure: {selection.accepted[0].placed_effect.id}: {why}")
    apart = 2.0 * math.log(
        PROBABILITY_CAP / (1.0 - PROBABILITY_CAP)
    )  # weights are those of Selection
    return dataclasses.replace(selection, other=max(selection.other, max(scores) - apart))


def _cap_reason(series: Sequence[SampledRecording], selection: Selection) -> str:
    """Return why the first effect may be an imitation; nothing where it seems not to be."""
    if has_varying_parameters(selection.model, selection.accepted[0], series):
        return "its parameters are not the same in each recording"
    if len(selection.accepted) > 1:
        return "it needs others beside it"
    return ""
