"""Bootstrap: thresholds from recordings that the recalibrated base itself would have given.

Nothing is missing in them, so what an effect gains there is by accident (parametric bootstrap,
Efron and Tibshirani 1993, section 6.5). Each replicate is refitted and searched like recordings.
What counts is how often anything at all is accepted: an effect's threshold is as many times what
it gains in one replicate of ten as any effect does in one of forty.
"""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path

import numpy as np

from codegen.cache import own_folder
from diagnosis.bench import Bench
from diagnosis.candidate import candidate
from diagnosis.estimate import Estimate
from diagnosis.level import settled
from diagnosis.prediction import noises_of
from diagnosis.recipe import node_text, recipe_key, write_whole
from diagnosis.replicate import replicate
from diagnosis.search import Tell, Tried, searched
from diagnosis.selection import looked_again
from diagnosis.series import Series, paced
from diagnosis.share import counted
from diagnosis.shelf import NOWHERE
from diagnosis.threshold import Thresholds, group_of

REPLICATES = 14
"""Simulated sets of recordings; each costs a recalibration and a search."""
LEVEL = 0.975
"""The part of recordings without a missing effect in which none is to be accepted."""
MIDDLE = 0.5
"""The part of the replicates below the tail, which is taken for an exponential one."""
FLOOR = 40.0
"""The least threshold [nats]: a real machine is never quite the model that is fitted to it."""
CEILING = 300.0
"""The most: where replicates ask for more the observer has lost its way in the base itself."""
OFTEN = 0.9
LEAST_SCALE = 2.0
"""The least that an effect gains so often [nats]; what is below it is not told from nothing."""
SEED = 5
STEPS = (1.0, 2.0, 5.0)
"""Rates and lengths are rounded to these, and their tenfold."""

Gains = Mapping[str, float]
"""What each group of effects gained in a replicate [nats]; one that is absent gained nothing."""


def threshold_key(bench: Bench, raw: Sequence[Series]) -> str:
    """Return the key of what thresholds are a property of: spec, rate, total length, rounded.

    The code, the effects and the compared outputs are in it as well.
    """
    length = sum(float(one.period) * one.count for one in raw)
    effects = [f"{one.name} {node_text(one.body)}" for one in bench.effects]
    rate = round(1.0 / float(raw[0].period))
    document = node_text(bench.document.root)
    return recipe_key("thresholds", document, *effects, *bench.seen, f"{rate}", f"{near(length):g}")


def near(value: float) -> float:
    """Return the nearest of 1, 2, 5, 10, 20, 50 ... to a positive number, by their ratio."""
    decade = 10.0 ** math.floor(math.log10(value))
    return min((step * decade for step in (*STEPS, 10.0)), key=lambda s: abs(math.log(value / s)))


def kept_thresholds(bench: Bench, raw: Sequence[Series]) -> Thresholds | None:
    """Return the thresholds that an earlier bootstrap has left in the user's cache, if any."""
    found = _known(_file(threshold_key(bench, raw)))
    return thresholds_of(found[:REPLICATES]) if len(found) >= REPLICATES else None


def bootstrapped(
    bench: Bench,
    base: Estimate,
    units: Mapping[str, float],
    raw: Sequence[Series],
    tell: Tell = lambda text: None,
) -> Thresholds:
    """Return thresholds by bootstrap; replicates of an earlier run are not made again.

    `raw` are the training recordings before they were thinned.
    """
    file = _file(threshold_key(bench, raw))
    known = _known(file)
    is_linear = bench.series[0].is_linear
    source = [dataclasses.replace(one, is_linear=is_linear) for one in raw]
    place = (bench.document, bench.project, (), bench.drifts, bench.seen, raw[0].period)
    model = candidate(*place)
    for number in range(len(known), REPLICATES):
        random = np.random.default_rng((SEED, number))
        made = replicate(model, base, source, random)
        known.append({} if made is None else gains_in(bench, base, units, made))
        if file is not None:
            with suppress(OSError):
                write_whole(file, json.dumps(known).encode())
        tell(f"bootstrap {number + 1} of {REPLICATES}: {_best(known[-1])}")
    return thresholds_of(known[:REPLICATES])


def gains_in(
    bench: Bench, base: Estimate, units: Mapping[str, float], made: Sequence[Series]
) -> Gains:
    """Return what each group of effects gains in recordings by accident [nats].

    What promises less than the least threshold is not fitted; where something gains more than
    that, the base is looked at again as it is for recordings.
    """
    series = paced(made, bench.automaton, bench.seen, bench.series[0].is_linear)
    own = dataclasses.replace(bench, series=series, shelf=NOWHERE)
    noises = dataclasses.replace(noises_of(series, base.noises.drifts), limits=base.noises.limits)
    model = settled(base.candidate, series, noises, base.point, units)
    tried = searched(own, model, units, own.layers(), worth=FLOOR)
    if any(gain > FLOOR for gain in _best_of(tried).values()):
        _, tried = looked_again(own, model, units, tried)
    return _best_of(tried)


def _best_of(tried: Sequence[Tried]) -> Gains:
    found: dict[str, float] = {}
    for one in tried:
        name = group_of(one.layer)
        found[name] = max(found.get(name, 0.0), counted(one.evidence) if one.evidence else 0.0)
    return {name: round(gain, 2) for name, gain in found.items() if gain > 0.0}


def thresholds_of(replicates: Sequence[Gains]) -> Thresholds:
    """Return the thresholds that some replicates ask for."""
    names = sorted({name for gains in replicates for name in gains})
    scales = {name: _scale([gains.get(name, 0.0) for gains in replicates]) for name in names}
    worst = [
        max((gain / scales[name] for name, gain in gains.items()), default=0.0)
        for gains in replicates
    ]
    times = tail(worst, LEVEL)
    groups = {name: _bounded(times * scale) for name, scale in scales.items()}
    origin = f"by {len(replicates)} replicates of the recalibrated model"
    return Thresholds(groups, _bounded(times * LEAST_SCALE), origin, modes=1.0)


def _bounded(value: float) -> float:
    return min(max(FLOOR, value), CEILING)


def tail(values: Sequence[float], level: float) -> float:
    """Return the quantile of a distribution whose upper half falls off exponentially.

    How fast is told by the median of what is above the middle: one replicate in which the observer
    lost its way, and everything gains, does not raise the thresholds of all.
    """
    middle = float(np.quantile(values, MIDDLE))
    over = [value - middle for value in values if value > middle]
    part = len(over) / len(values)
    if part <= 1.0 - level:
        return middle
    slope = float(np.median(over)) / math.log(2.0)
    return middle + slope * math.log(part / (1.0 - level))


def _scale(gains: Sequence[float]) -> float:
    """What an effect gains by accident in one replicate out of ten."""
    return max(LEAST_SCALE, float(np.quantile(gains, OFTEN)))


def _best(gains: Gains) -> str:
    name = max(gains, key=lambda name: gains[name], default="")
    return f"{name} gains {gains[name]:.0f} nats" if name else "nothing gains"


def _file(key: str) -> Path | None:
    """Return where replicates are kept; None where there is no folder of the user's own."""
    folder = own_folder("thresholds")
    return folder / f"{key}.json" if folder else None


def _known(file: Path | None) -> list[Gains]:
    with suppress(OSError, ValueError, TypeError, AttributeError):
        if file is not None:
            known = json.loads(file.read_text())
            return [{str(k): float(v) for k, v in gains.items()} for gains in known]
    return []
