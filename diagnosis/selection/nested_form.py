"""Nested form: the member of a family of effects that the recordings ask for.

An effect may have parameters with a `plain` value, at which it reduces to a simpler form. All forms
share one fit. The cost of a simpler form follows from the quadratic approximation of the fit (Wald
1943), so no form is fitted again.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from diagnosis.data.array_types import Reals
from diagnosis.estimation.covariance import coordinate_covariance
from diagnosis.estimation.estimate import Estimate
from diagnosis.estimation.normal_equations import solve


@dataclass(frozen=True)
class NestedForm:
    """A form of an effect: the parameters that have their plain value, and the cost of that [nats].

    `fixed` are names in the automaton.
    """

    fixed: tuple[str, ...] = ()
    added_cost: float = 0.0


GENERAL_FORM = NestedForm()


def choose_form(model: Estimate, correlation: float, price: float) -> NestedForm:
    """Return the form of a fitted model whose cost, with the price of its parameters, is least.

    Parameters with a plain value are fixed there one after the other, as long as that pays
    (backward elimination). Each saves `price` nats; the added cost counts for `correlation` samples
    as one. A model without normal equations keeps its general form.
    """
    if model.normal_equations is None or not _plain_distances(model):
        return GENERAL_FORM
    covariance, free = coordinate_covariance(model)
    distances = _plain_distances(model)
    rows = {name: row for row, name in enumerate(free) if name in distances}

    def form_of(fixed: tuple[str, ...]) -> NestedForm:
        chosen = [rows[name] for name in fixed]
        distance = np.array([distances[name] for name in fixed])
        return NestedForm(fixed, _wald_cost(covariance[np.ix_(chosen, chosen)], distance))

    def change_of(form: NestedForm) -> float:
        return form.added_cost / correlation - len(form.fixed) * price

    best = GENERAL_FORM
    while tried := [form_of((*best.fixed, name)) for name in rows if name not in best.fixed]:
        simpler = min(tried, key=change_of)
        if not change_of(simpler) < change_of(best):
            break
        best = simpler
    return best


def _plain_distances(model: Estimate) -> dict[str, float]:
    """Return the coordinate less that of the plain value, by name of the shared parameters."""
    return {
        one.name: float(model.point.shared[k]) - one.coordinate(one.plain)
        for k, one in enumerate(model.candidate.free_parameters)
        if one.plain is not None and not one.per_recording
    }


def _wald_cost(covariance: Reals, distance: Sequence[float] | Reals) -> float:
    """Return the increase of the cost [nats] if coordinates move by a distance: d' C^-1 d / 2."""
    return 0.5 * float(np.asarray(distance) @ solve(covariance, np.asarray(distance)))
