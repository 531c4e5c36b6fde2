"""Inter-sample behaviour: the base recalibrated with held inputs and with linear ones.

Which one holds cannot always be determined before missing physics is found, because half a sample
is a delay as well.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from functools import partial

from diagnosis.criterion.threshold import Thresholds
from diagnosis.data.sampled_recording import require_equal_periods, resample
from diagnosis.estimation.estimate import Estimate
from diagnosis.estimation.initial_input import average_initial_inputs, choose_initial_inputs
from diagnosis.estimation.model_set import ModelSet
from diagnosis.estimation.noise_level import (
    disturbance_units,
    fit_base,
    fit_with_noise,
    recalibrate,
)
from diagnosis.model.parameter_vector import extend_vector
from diagnosis.selection.candidate_search import CandidateFit, LogCallback
from diagnosis.selection.forward_selection import Selection, select_effects

RecalibratedSet = tuple[ModelSet, Estimate]


def recalibrate_by_hold(
    model_set: ModelSet, log: LogCallback = lambda text: None
) -> list[RecalibratedSet]:
    """Return model sets with decimated recordings and their recalibrated bases, in the order of
    trial.

    First-order hold comes first; zero-order hold is added if the base fits better with it.
    """
    firsts = []
    for is_linear in (True, False):
        paced_ones = resample(
            model_set.series, model_set.automaton, model_set.output_names, is_linear
        )
        require_equal_periods(paced_ones)
        own = tuple(average_initial_inputs(one) for one in paced_ones)
        way = dataclasses.replace(model_set, series=own)
        candidate = way.compile_candidate(())
        units = disturbance_units(candidate, own, {})
        make = partial(fit_base, candidate, own, units)
        first = way.load_or_fit("first fit", candidate, [units], make)
        way = dataclasses.replace(way, series=choose_initial_inputs(first, own))
        firsts.append((way, first, units))
    straight, held = firsts
    if straight[1].negative_log_likelihood <= held[1].negative_log_likelihood:
        firsts = [straight]
    found = []
    for way, first, units in firsts:
        make = partial(recalibrate, first, way.series, units)
        given = [first.point, first.noise_levels, units]
        found.append((way, way.load_or_fit("recalibrated", first.candidate, given, make)))
    for way, base in found:
        text = "straight between samples" if way.series[0].is_first_order_hold else "held"
        log(f"recalibrated, inputs {text}: {base.cost:.0f} nats")
    is_straight = best_hold(found)[0].series[0].is_first_order_hold
    return found[:1] if is_straight else found


def best_hold(recalibrated: Sequence[RecalibratedSet]) -> RecalibratedSet:
    """Return the model set whose base has the larger likelihood."""
    return min(recalibrated, key=lambda way: way[1].negative_log_likelihood)


def select_hold(
    recalibrated: Sequence[RecalibratedSet],
    thresholds: Thresholds,
    log: LogCallback = lambda text: None,
) -> tuple[ModelSet, Estimate, Selection]:
    """Return the model set, base and selection with the smallest cost.

    After a selection with accepted effects, another inter-sample behaviour is tried only if the
    model with these effects fits better with it.
    """
    found: list[tuple[float, ModelSet, Estimate, Selection]] = []
    known: tuple[CandidateFit, ...] = ()
    for model_set, base in recalibrated:
        if any(not _is_improved_by(model_set, base, selection) for *_, selection in found):
            continue
        units = disturbance_units(base.candidate, model_set.series, base.values(0))
        selection = select_effects(model_set, base, units, thresholds, log, earlier=known)
        known = selection.first_round if selection.accepted else ()
        cost = selection.model.cost + thresholds.default * len(selection.accepted)
        found.append((cost, model_set, base, selection))
    _, model_set, base, selection = min(found, key=lambda one: one[0])
    return model_set, base, selection


def _is_improved_by(model_set: ModelSet, base: Estimate, selection: Selection) -> bool:
    """Tell whether what was accepted in another way fits better in this one; nothing may."""
    candidate = model_set.try_compile([tried.placed_effect for tried in selection.accepted])
    if candidate is None or not selection.accepted:
        return True
    model = selection.model
    units = disturbance_units(base.candidate, model_set.series, base.values(0))
    start = extend_vector(candidate, model.candidate, model.point, {})
    given = (model.noise_levels, start, units)
    make = partial(fit_with_noise, candidate, model_set.series, *given)
    return model_set.load_or_fit("settled", candidate, given, make).cost < model.cost
