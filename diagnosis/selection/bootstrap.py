"""Bootstrap: thresholds from simulated recordings of the recalibrated base (parametric bootstrap).

Nothing is missing in them, so all gains are by chance (Efron and Tibshirani 1993, section 6.5).
Each replicate is fitted and searched like recordings. The rate of false acceptance of any effect is
controlled: the threshold of an effect is its gain in one of ten replicates, times the factor that
the largest relative gain exceeds in one of forty.
"""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path

import numpy as np

from codegen.toolchain.build_cache import cache_subfolder
from diagnosis.criterion.recording_support import supported_gain
from diagnosis.criterion.threshold import Thresholds, group_of
from diagnosis.data.sampled_recording import SampledRecording, resample
from diagnosis.estimation.checkpoint import NO_CACHE
from diagnosis.estimation.estimate import Estimate
from diagnosis.estimation.innovations import measured_noise_levels
from diagnosis.estimation.model_set import ModelSet
from diagnosis.estimation.noise_level import fit_with_noise
from diagnosis.model.candidate import compile_candidate
from diagnosis.model.compile_cache import cache_key, node_text
from diagnosis.selection.candidate_search import CandidateFit, LogCallback, search_candidates
from diagnosis.selection.forward_selection import rescreen_after_refit
from diagnosis.selection.replicate import simulate_replicate
from language.text.temporary_files import write_atomically

REPLICATES = 14
"""Simulated sets of recordings; each costs a recalibration and a search."""
QUANTILE = 0.975
"""The part of recordings without a missing effect in which none is to be accepted."""
TAIL_START = 0.5
"""The part of the replicates below the tail, which is taken for an exponential one."""
MIN_THRESHOLD = 40.0
"""The least threshold [nats]: a real machine is never quite the model that is fitted to it."""
MAX_THRESHOLD = 300.0
"""The most: where replicates ask for more the observer has lost its way in the base itself."""
SCALE_QUANTILE = 0.9
MIN_SCALE = 2.0
"""The least that an effect gains so often [nats]; what is below it is not told from nothing."""
FORMAT = "modewright-replicates/1"
"""Format and schema version of the file of bootstrap replicates."""

SEED = 5
PREFERRED_NUMBERS = (1.0, 2.0, 5.0)
"""Rates and lengths are rounded to these, and their tenfold."""

GroupGains = Mapping[str, float]
"""What each group of effects gained in a replicate [nats]; one that is absent gained nothing."""


def threshold_key(model_set: ModelSet, full_rate_series: Sequence[SampledRecording]) -> str:
    """Return the cache key of thresholds: code, spec, effects, outputs,
    rate and rounded total length.
    """
    length = sum(float(one.period) * one.count for one in full_rate_series)
    effects = [f"{one.name} {node_text(one.body)}" for one in model_set.effects]
    rate = round(1.0 / float(full_rate_series[0].period))
    document = node_text(model_set.document.root)
    return cache_key(
        "thresholds",
        document,
        *effects,
        *model_set.output_names,
        f"{rate}",
        f"{round_to_preferred(length):g}",
    )


def round_to_preferred(value: float) -> float:
    """Return the nearest of 1, 2, 5, 10, 20, 50 ... to a positive number, by their ratio."""
    decade = 10.0 ** math.floor(math.log10(value))
    return min(
        (step * decade for step in (*PREFERRED_NUMBERS, 10.0)),
        key=lambda s: abs(math.log(value / s)),
    )


def cached_thresholds(
    model_set: ModelSet, full_rate_series: Sequence[SampledRecording]
) -> Thresholds | None:
    """Return the thresholds of an earlier bootstrap from the user's cache,
    None without a complete one.
    """
    found = _read_replicates(_replicates_file(threshold_key(model_set, full_rate_series)))
    return thresholds_of(found[:REPLICATES]) if len(found) >= REPLICATES else None


def bootstrap_thresholds(
    model_set: ModelSet,
    base: Estimate,
    units: Mapping[str, float],
    full_rate_series: Sequence[SampledRecording],
    log: LogCallback = lambda text: None,
) -> Thresholds:
    """Return thresholds by bootstrap; replicates are stored, and those of an earlier run are
    reused.

    `full_rate_series` are the training recordings before decimation.
    """
    file = _replicates_file(threshold_key(model_set, full_rate_series))
    known = _read_replicates(file)
    is_linear = model_set.series[0].is_first_order_hold
    source = [dataclasses.replace(one, is_first_order_hold=is_linear) for one in full_rate_series]
    place = (
        model_set.document,
        model_set.project,
        (),
        model_set.disturbances,
        model_set.output_names,
        full_rate_series[0].period,
    )
    model = compile_candidate(*place)
    for number in range(len(known), REPLICATES):
        random = np.random.default_rng((SEED, number))
        made = simulate_replicate(model, base, source, random)
        known.append({} if made is None else accidental_gains(model_set, base, units, made))
        if file is not None:
            with suppress(OSError):
                entries = {"format": FORMAT, "replicates": known}
                write_atomically(file, json.dumps(entries).encode())
        log(f"bootstrap {number + 1} of {REPLICATES}: {_format_best(known[-1])}")
    return thresholds_of(known[:REPLICATES])


def accidental_gains(
    model_set: ModelSet,
    base: Estimate,
    units: Mapping[str, float],
    replicate: Sequence[SampledRecording],
) -> GroupGains:
    """Return the largest gain [nats] of each group of effects in a replicate.

    Effects with a screening gain below the least threshold are not fitted. If something gains more
    than that, the base is fitted again as for recordings.
    """
    series = resample(
        replicate,
        model_set.automaton,
        model_set.output_names,
        model_set.series[0].is_first_order_hold,
    )
    own = dataclasses.replace(model_set, series=series, fit_cache=NO_CACHE)
    noise_levels = dataclasses.replace(
        measured_noise_levels(series, base.noise_levels.process),
        huber_limits=base.noise_levels.huber_limits,
    )
    model = fit_with_noise(base.candidate, series, noise_levels, base.point, units)
    tried = search_candidates(own, model, units, own.applicable_effects(), min_gain=MIN_THRESHOLD)
    if any(gain > MIN_THRESHOLD for gain in _best_by_group(tried).values()):
        _, tried = rescreen_after_refit(own, model, units, tried)
    return _best_by_group(tried)


def _best_by_group(candidate_fits: Sequence[CandidateFit]) -> GroupGains:
    found: dict[str, float] = {}
    for one in candidate_fits:
        name = group_of(one.placed_effect)
        found[name] = max(
            found.get(name, 0.0),
            supported_gain(one.likelihood_gain) if one.likelihood_gain else 0.0,
        )
    return {name: round(gain, 2) for name, gain in found.items() if gain > 0.0}


def thresholds_of(replicates: Sequence[GroupGains]) -> Thresholds:
    """Return the thresholds from the gains of replicates."""
    names = sorted({name for gains in replicates for name in gains})
    scales = {name: _gain_scale([gains.get(name, 0.0) for gains in replicates]) for name in names}
    worst = [
        max((gain / scales[name] for name, gain in gains.items()), default=0.0)
        for gains in replicates
    ]
    times = exponential_tail_quantile(worst, QUANTILE)
    groups = {name: _clip_threshold(times * scale) for name, scale in scales.items()}
    origin = f"by {len(replicates)} replicates of the recalibrated model"
    return Thresholds(groups, _clip_threshold(times * MIN_SCALE), origin, mode_factor=1.0)


def _clip_threshold(value: float) -> float:
    return min(max(MIN_THRESHOLD, value), MAX_THRESHOLD)


def exponential_tail_quantile(values: Sequence[float], level: float) -> float:
    """Return a quantile of values whose upper half is taken to decay exponentially.

    The rate follows from the median of the values above the middle, so a single replicate in which
    the observer diverges does not raise all thresholds.
    """
    middle = float(np.quantile(values, TAIL_START))
    over = [value - middle for value in values if value > middle]
    part = len(over) / len(values)
    if part <= 1.0 - level:
        return middle
    slope = float(np.median(over)) / math.log(2.0)
    return middle + slope * math.log(part / (1.0 - level))


def _gain_scale(gains: Sequence[float]) -> float:
    """What an effect gains by accident in one replicate out of ten."""
    return max(MIN_SCALE, float(np.quantile(gains, SCALE_QUANTILE)))


def _format_best(gains: GroupGains) -> str:
    name = max(gains, key=lambda name: gains[name], default="")
    return f"{name} gains {gains[name]:.0f} nats" if name else "nothing gains"


def _replicates_file(key: str) -> Path | None:
    """Return where replicates are kept; None where there is no folder of the user's own."""
    folder = cache_subfolder("thresholds")
    return folder / f"{key}.json" if folder else None


def _read_replicates(file: Path | None) -> list[GroupGains]:
    with suppress(OSError, ValueError, TypeError, AttributeError, KeyError):
        if file is not None:
            known = json.loads(file.read_text())
            replicates = known["replicates"] if isinstance(known, dict) else known
            return [{str(k): float(v) for k, v in gains.items()} for gains in replicates]
    return []
