"""Location: where something is missing - the place whose drift the recordings ask for most.

One drift at a time is let free beside the base; the one whose freedom explains most stands where
the model is deficient (Kristensen, Madsen, Jorgensen 2004). What the drift then does - in which
windows and modes, along with what - is told.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from diagnosis.bench import Bench
from diagnosis.estimation import Estimate, looked_at
from diagnosis.layers import Layer, drift
from diagnosis.level import FREE_LEVELS, levelled, units_of
from diagnosis.point import point_of
from language.document import Table

Reals = NDArray[np.float64]
SMALL_LEVEL = FREE_LEVELS[1]
"""What all drifts have while one of them is let free."""
LOUD = 2.0
"""A drift beyond this many of its own standard deviations makes a window."""
SHORTEST = 0.05
"""Windows nearer than this [s] are one."""
MOST_WINDOWS = 12


@dataclass(frozen=True)
class Locus:
    """One place: `gain` [nats] of its freedom, of it `beyond` the base as it is; `rms` of its drift
    [SI]; the `windows` (start, end, recording) in which it is loud, its share by mode, and what
    it goes `along` with.
    """

    section: str
    place: str
    gain: float
    rms: float
    windows: tuple[tuple[float, float, str], ...] = ()
    modes: dict[str, float] = dataclasses.field(default_factory=dict)
    along: tuple[tuple[str, float], ...] = ()
    beyond: float = 0.0

    @property
    def path(self) -> str:
        """`section.name`, as verdicts name places."""
        return f"{self.section}.{self.place}"


def located(bench: Bench, base: Estimate) -> tuple[Locus, ...]:
    """Return every place with what its freedom explains, the best first."""
    found = []
    for section, layer in _loci(bench):
        known = any(layer.id == other.id for other in bench.drifts)
        candidate = bench.candidate((), bench.drifts if known else (*bench.drifts, layer))
        name = layer.named("drift")
        units = units_of(candidate, bench.series, base.noises, base.values(0))
        small = {other: SMALL_LEVEL * unit for other, unit in units.items()}
        noises = dataclasses.replace(base.noises, drifts=small)
        point = point_of(candidate, len(bench.series), base.values(0))
        quiet = looked_at(candidate, bench.series, noises, point)
        free = levelled(quiet, bench.series, {name: units[name]}, FREE_LEVELS)
        gain = quiet.cost - free.cost if np.isfinite(quiet.cost) else 0.0
        locus = _locus(bench, section, layer, free, gain)
        beyond = base.cost - free.cost if np.isfinite(free.cost) else 0.0
        found.append(dataclasses.replace(locus, beyond=beyond))
    return tuple(sorted(found, key=lambda locus: -locus.gain))


def _loci(bench: Bench) -> list[tuple[str, Layer]]:
    """A drift for each balance of forces, each elastic element, each compared output."""
    loci = [("flow", layer) for layer in bench.drifts]
    elements = bench.document.root.get("elements")
    for entry in elements if isinstance(elements, Table) else ():
        if bench.automaton.elements[entry.key].kind == "elastic":
            loci.append(("elements", drift("element", entry.key)))
    loci += [("outputs", drift("output", name)) for name in bench.seen]
    return loci


def _locus(bench: Bench, section: str, layer: Layer, free: Estimate, gain: float) -> Locus:
    place = free.candidate.predictor.states.index(layer.named("drift"))
    drifts = [one.states[: one.done, place] for one in free.outcome.predictions]
    modes = [one.modes[: one.done] for one in free.outcome.predictions]
    size = float(np.sqrt(np.mean(np.concatenate(drifts) ** 2)))
    windows = [
        window
        for one, values in zip(bench.series, drifts, strict=True)
        for window in _windows(values, size, float(one.period), one.name)
    ]
    windows.sort(key=lambda window: window[0] - window[1])
    return Locus(
        section,
        layer.place,
        float(gain),
        size,
        tuple(windows[:MOST_WINDOWS]),
        _shares(bench, drifts, modes),
        along(bench, free, drifts),
    )


def _windows(
    values: Reals, size: float, period: float, name: str
) -> list[tuple[float, float, str]]:
    loud = np.flatnonzero(np.abs(values) > LOUD * size) if size > 0.0 else np.array([], dtype=int)
    if not len(loud):
        return []
    parts = np.split(loud, np.flatnonzero(np.diff(loud) * period > SHORTEST) + 1)
    return [(float(part[0] * period), float(part[-1] * period), name) for part in parts]


def _shares(
    bench: Bench, drifts: Sequence[Reals], modes: Sequence[NDArray[np.int16]]
) -> dict[str, float]:
    """Return how much of the drift's squares falls into each mode."""
    names = {mode.number: mode.name for mode in bench.automaton.modes.values()}
    squares, where = np.concatenate(drifts) ** 2, np.concatenate(modes)
    whole = float(np.sum(squares)) or 1.0
    return {name: float(np.sum(squares[where == number])) / whole for number, name in names.items()}


def along(bench: Bench, free: Estimate, drifts: Sequence[Reals]) -> tuple[tuple[str, float], ...]:
    """Return what a drift goes along with: features with their correlation, the strongest first."""
    columns: dict[str, list[Reals]] = {}
    states = free.candidate.predictor.states
    for one, prediction in zip(bench.series, free.outcome.predictions, strict=True):
        rows = prediction.states[: prediction.done]
        period = float(one.period)
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
    target = np.concatenate(drifts)
    found = []
    for name, parts in columns.items():
        values = np.concatenate(parts)
        if np.std(values) > 0.0 and np.std(target) > 0.0:
            found.append((name, float(np.corrcoef(values, target)[0, 1])))
    return tuple(sorted(found, key=lambda pair: -abs(pair[1]))[:3])
