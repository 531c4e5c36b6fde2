"""Signal magnitude: the size of a state without a declared range, from signals of related units.

Steps of differences and uncertain initial values are fractions of it, so they do not depend on the
units in which a model is written.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from diagnosis.data.array_types import Reals
from diagnosis.data.sampled_recording import SampledRecording
from diagnosis.model.parameter import declared_value
from diagnosis.model.placed_effect import TIME_DIMENSION, disturbance_effect
from language.expressions.units import parse_unit
from language.model.automaton import Automaton
from language.overlays.effect_place import PlaceMismatch, find_effect_place
from language.text.document import Document, MappingNode

Powers = tuple[int, ...]


def signal_magnitudes(
    document: Document,
    automaton: Automaton,
    series: Sequence[SampledRecording],
    output_names: Sequence[str],
) -> dict[Powers, float]:
    """Return the magnitude [SI] of signals by the powers of their units.

    It is the largest span (largest less smallest value) of the recorded inputs and outputs with
    this unit. A unit without such a signal has the change in the median reference time of one that
    is its rate, or the force that changes a state of a balance by its magnitude in this time.
    Numbers without a unit, and units without any of these, have no magnitude.
    """
    recorded = _largest(_recorded_spans(automaton, series, output_names))
    time = float(np.median([one.reference_time for one in series])) if series else 1.0
    integrals = _largest(
        (_product(unit, TIME_DIMENSION), span * time) for unit, span in recorded.items()
    )
    found = integrals | recorded
    forces = []
    middle = _recorded_medians(automaton, series, output_names)
    for name, state in automaton.states.items():
        coefficient = balance_coefficient(document, name)
        unit = state.unit.dimension.powers
        if coefficient is None or unit not in found:
            continue
        text, own = coefficient
        size = abs(declared_value(automaton, text, middle) or 0.0) * found[unit] / time
        forces.append((_quotient(_product(own, unit), TIME_DIMENSION), size))
    return _largest(forces) | found


def balance_coefficient(document: Document, state: str) -> tuple[str, Powers] | None:
    """Return the coefficient of the rate of a state in its balance, and the powers of its unit.

    None if the state has no balance with such a coefficient.
    """
    effect = disturbance_effect("balance", state).effect
    place = find_effect_place(document.root, effect, state)
    flow = document.root.get("flow")
    if isinstance(place, PlaceMismatch) or not isinstance(flow, MappingNode):
        return None
    unit = place.holes.get("inertia_unit")
    if unit is None:
        return None
    return str(place.holes.get("inertia", "")), parse_unit(str(unit)).dimension.powers


def _recorded_spans(
    automaton: Automaton, series: Sequence[SampledRecording], output_names: Sequence[str]
) -> Iterator[tuple[Powers, float]]:
    """Yield the powers of the unit and the span over all recordings of inputs and states."""
    for column, declared in enumerate(automaton.inputs.values()):
        yield declared.unit.dimension.powers, _span([one.inputs[:, column] for one in series])
    for column, name in enumerate(output_names):
        state = automaton.states.get(automaton.output_source(name))
        if state is not None:
            span = _span([one.measured[:, column] for one in series])
            yield state.unit.dimension.powers, span


def _recorded_medians(
    automaton: Automaton, series: Sequence[SampledRecording], output_names: Sequence[str]
) -> dict[str, float]:
    """Return the medians [SI] of inputs and of compared states over all recordings."""
    signals = {
        name: [one.inputs[:, k] for one in series] for k, name in enumerate(automaton.inputs)
    }
    for column, name in enumerate(output_names):
        signals[automaton.output_source(name)] = [one.measured[:, column] for one in series]
    known = {name: np.concatenate(parts) for name, parts in signals.items() if parts}
    known = {name: values[np.isfinite(values)] for name, values in known.items()}
    return {name: float(np.median(values)) for name, values in known.items() if len(values)}


def _span(signals: Sequence[Reals]) -> float:
    """Return the largest less the smallest known value of a signal; 0 without any."""
    known = [one[np.isfinite(one)] for one in signals]
    values = np.concatenate(known) if known else np.zeros(0)
    return float(np.max(values) - np.min(values)) if len(values) else 0.0


def _largest(sizes: Iterable[tuple[Powers, float]]) -> dict[Powers, float]:
    """Return the largest positive size for each unit; numbers without a unit are left out."""
    found: dict[Powers, float] = {}
    for unit, size in sizes:
        if any(unit) and size > 0.0:
            found[unit] = max(size, found.get(unit, 0.0))
    return found


def _product(first: Powers, second: Powers) -> Powers:
    """Return the powers of the product of two units."""
    return tuple(a + b for a, b in zip(first, second, strict=True))


def _quotient(first: Powers, second: Powers) -> Powers:
    """Return the powers of the quotient of two units."""
    return tuple(a - b for a, b in zip(first, second, strict=True))
