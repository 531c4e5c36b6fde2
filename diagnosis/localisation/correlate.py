"""Correlates: the quantities with which a disturbance correlates, such as the sign of a speed."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence

import numpy as np

from diagnosis.data.array_types import Reals
from diagnosis.estimation.estimate import Estimate
from diagnosis.estimation.model_set import ModelSet
from language.text.document import MappingNode, ScalarNode

MAX_CORRELATES = 3
"""Number of correlates that are reported."""
ORDERS = (1, 2, 3, 4, 6, 8, 12, 24)
"""Periods per turn that are tested."""


def find_correlates(
    model_set: ModelSet, free_model: Estimate, disturbances: Sequence[Reals]
) -> tuple[tuple[str, float], ...]:
    """Return the `MAX_CORRELATES` (3) features of largest correlation with a disturbance.

    They are states with a range (also sign and square), inputs (also magnitude and rate), time,
    recording, and orders of angles, whose phase may differ between recordings.
    """
    target = [values - np.mean(values) for values in disturbances]
    correlations = []
    for name, parts in _features(model_set, free_model).items():
        values = np.concatenate(_known_parts(parts, disturbances))
        target_values = np.concatenate(disturbances)
        if np.std(values) > 0.0 and np.std(target_values) > 0.0:
            correlations.append((name, float(np.corrcoef(values, target_values)[0, 1])))
    recording = "the recording (not the same in each)"
    correlations.append((recording, _recording_correlation(disturbances)))
    for name, each in _order_angles(model_set, free_model).items():
        correlations.append((name, _order_correlation(target, _known_parts(each, disturbances))))
    correlations = [(name, value) for name, value in correlations if np.isfinite(value)]
    return tuple(sorted(correlations, key=lambda pair: -abs(pair[1]))[:MAX_CORRELATES])


def order_features(rate: str) -> dict[str, int]:
    """Return names `order 3 of the angle of <rate>` with their orders, `ORDERS` periods a turn."""
    return {f"order {order} of the angle of {rate}": order for order in ORDERS}


def _known_parts(parts: Sequence[Reals], disturbances: Sequence[Reals]) -> list[Reals]:
    """Return the last samples of each feature, as many as the disturbance has."""
    pairs = zip(parts, disturbances, strict=True)
    return [part[len(part) - len(values) :] for part, values in pairs]


def _features(model_set: ModelSet, free_model: Estimate) -> dict[str, list[Reals]]:
    """Return the features of states, inputs and time by name, (samples,) for each recording."""
    columns: dict[str, list[Reals]] = defaultdict(list)
    states = free_model.candidate.predictor.states
    for one, prediction in zip(model_set.series, free_model.prediction.predictions, strict=True):
        rows, period = prediction.states[: prediction.completed], float(one.period)
        for name, state in model_set.automaton.states.items():
            if state.range and name in states:
                x = rows[:, states.index(name)]
                scale = float(np.std(x)) or 1.0
                columns[f"the sign of {name}"].append(np.tanh(10.0 * x / scale))
                columns[f"the square of {name}"].append(x * np.abs(x))
                columns[name].append(x)
        for k, name in enumerate(model_set.automaton.inputs):
            u = one.inputs[: prediction.completed, k]
            columns[name].append(u)
            columns[f"the amount of {name}"].append(np.abs(u))
            columns[f"the rate of {name}"].append(np.gradient(u) / period)
        columns["time"].append(np.arange(prediction.completed, dtype=np.float64) * period)
    return columns


def _order_angles(model_set: ModelSet, free_model: Estimate) -> dict[str, list[Reals]]:
    """Return the angle times the order by name of the feature, (samples,) by recording."""
    states, period = free_model.candidate.predictor.states, float(model_set.period)
    found = {}
    for rate in (rate for rate in angle_rates(model_set) if rate in states):
        column = states.index(rate)
        angles = [
            np.cumsum(one.states[: one.completed, column]) * period
            for one in free_model.prediction.predictions
        ]
        for name, order in order_features(rate).items():
            found[name] = [order * angle for angle in angles]
    return found


def angle_rates(model_set: ModelSet) -> list[str]:
    """Return the distinct `angle_rate` of `places`, then of `elements` of the document."""
    rates = []
    for section in ("places", "elements"):
        node = model_set.document.root.get(section)
        for entry in node if isinstance(node, MappingNode) else ():
            rate = entry.node.get("angle_rate") if isinstance(entry.node, MappingNode) else None
            if isinstance(rate, ScalarNode):
                rates.append(rate.text)
    return list(dict.fromkeys(rates))


def _order_correlation(target: Sequence[Reals], angles: Sequence[Reals]) -> float:
    """Return the multiple correlation with sine and cosine, fitted by recording."""
    whole, explained = 0.0, 0.0
    for values, angle in zip(target, angles, strict=True):
        waves = np.stack([np.sin(angle), np.cos(angle)], axis=1)
        waves = waves - np.mean(waves, axis=0)
        weights = np.linalg.lstsq(waves, values, rcond=None)[0]
        whole += float(values @ values)
        explained += float(np.sum((waves @ weights) ** 2))
    return float(np.sqrt(explained / whole)) if whole > 0.0 else 0.0


def _recording_correlation(disturbances: Sequence[Reals]) -> float:
    """Return the correlation with the means of recordings; 0 for one recording."""
    if len(disturbances) < 2:
        return 0.0
    means = np.concatenate([np.full(len(values), np.mean(values)) for values in disturbances])
    spread = float(np.std(np.concatenate(disturbances)))
    return float(np.std(means)) / spread if spread > 0.0 else 0.0
