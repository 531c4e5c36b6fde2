"""Companion: what an unknown goes along with - a sign of a speed, its square, an order, time."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from diagnosis.bench import Bench
from diagnosis.estimate import Estimate
from language.document import Scalar, Table

Reals = NDArray[np.float64]
MOST = 3
"""Companions that are told."""
ORDERS = (1, 2, 3, 4, 6, 8, 12, 24)
"""Periods per turn that are looked for."""


def along(bench: Bench, free: Estimate, drifts: Sequence[Reals]) -> tuple[tuple[str, float], ...]:
    """Return what a drift goes along with: features with their correlation, the strongest first.

    Of an order of an angle, which has a phase of its own in each recording, it is the multiple
    correlation with its sine and cosine.
    """
    target = [values - np.mean(values) for values in drifts]
    found = []
    for name, parts in _columns(bench, free).items():
        values = np.concatenate(_ends(parts, drifts))
        together = np.concatenate(drifts)
        if np.std(values) > 0.0 and np.std(together) > 0.0:
            found.append((name, float(np.corrcoef(values, together)[0, 1])))
    found.append(("the recording (not the same in each)", _between(drifts)))
    angles = _angles(bench, free).items()
    found += [(name, _order(target, _ends(each, drifts))) for name, each in angles]
    found = [(name, value) for name, value in found if np.isfinite(value)]
    return tuple(sorted(found, key=lambda pair: -abs(pair[1]))[:MOST])


def orders_of(rate: str) -> dict[str, int]:
    """Return the features that are orders of the angle of a rate, with the periods per turn."""
    return {f"order {order} of the angle of {rate}": order for order in ORDERS}


def _ends(parts: Sequence[Reals], drifts: Sequence[Reals]) -> list[Reals]:
    """Return the part of each recording in which its drift is known: all but the start."""
    pairs = zip(parts, drifts, strict=True)
    return [part[len(part) - len(values) :] for part, values in pairs]


def _columns(bench: Bench, free: Estimate) -> dict[str, list[Reals]]:
    columns: dict[str, list[Reals]] = {}
    states = free.candidate.predictor.states
    for one, prediction in zip(bench.series, free.outcome.predictions, strict=True):
        rows, period = prediction.states[: prediction.done], float(one.period)
        for name, state in bench.automaton.states.items():
            if state.range and name in states:
                x = rows[:, states.index(name)]
                scale = float(np.std(x)) or 1.0
                sign: Reals = np.tanh(10.0 * x / scale)
                columns.setdefault(f"the sign of {name}", []).append(sign)
                columns.setdefault(f"the square of {name}", []).append(x * np.abs(x))
                columns.setdefault(name, []).append(x)
        for k, name in enumerate(bench.automaton.inputs):
            u = one.inputs[: prediction.done, k]
            columns.setdefault(name, []).append(u)
            columns.setdefault(f"the amount of {name}", []).append(np.abs(u))
            rate: Reals = np.asarray(np.gradient(u), dtype=np.float64) / period
            columns.setdefault(f"the rate of {name}", []).append(rate)
        columns.setdefault("time", []).append(np.arange(prediction.done, dtype=np.float64) * period)
    return columns


def _angles(bench: Bench, free: Estimate) -> dict[str, list[Reals]]:
    """Return the angles of orders of what turns: the rates that places and elements declare."""
    states = free.candidate.predictor.states
    rates = [rate for rate in turning(bench) if rate in states]
    found = {}
    for rate in rates:
        column = states.index(rate)
        period = float(bench.period)
        angles = [
            np.cumsum(one.states[: one.done, column]) * period for one in free.outcome.predictions
        ]
        for name, order in orders_of(rate).items():
            found[name] = [order * angle for angle in angles]
    return found


def turning(bench: Bench) -> list[str]:
    """Return what is the rate of an angle, as `elements` and `places` declare it."""
    found = []
    for section in ("places", "elements"):
        node = bench.document.root.get(section)
        for entry in node if isinstance(node, Table) else ():
            rate = entry.node.get("angle_rate") if isinstance(entry.node, Table) else None
            if isinstance(rate, Scalar):
                found.append(rate.text)
    return list(dict.fromkeys(found))


def _order(target: Sequence[Reals], angles: Sequence[Reals]) -> float:
    whole, explained = 0.0, 0.0
    for values, angle in zip(target, angles, strict=True):
        waves = np.stack([np.sin(angle), np.cos(angle)], axis=1)
        waves = waves - np.mean(waves, axis=0)
        weights = np.linalg.lstsq(waves, values, rcond=None)[0]
        whole += float(values @ values)
        explained += float(np.sum((waves @ weights) ** 2))
    return float(np.sqrt(explained / whole)) if whole > 0.0 else 0.0


def _between(drifts: Sequence[Reals]) -> float:
    """Return the correlation with the mean of each recording; 0 with a single one."""
    if len(drifts) < 2:
        return 0.0
    means = np.concatenate([np.full(len(values), np.mean(values)) for values in drifts])
    spread = float(np.std(np.concatenate(drifts)))
    return float(np.std(means)) / spread if spread > 0.0 else 0.0
