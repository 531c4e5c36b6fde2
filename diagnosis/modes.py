"""Modes: where each mode of a candidate was seen, and what the candidate is near there."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import dataclass
from statistics import median

import numpy as np
from numpy.typing import NDArray

from codegen.runs import Runs
from diagnosis.candidate import Candidate
from diagnosis.linear import Linear, linearised
from diagnosis.prediction import Outcome
from diagnosis.series import Series

Reals = NDArray[np.float64]
Wholes = NDArray[np.int64]
Models = dict[int, tuple[Linear, int]]
"""By mode, a candidate over one sample near where it was seen, and the usual stay [samples]."""
SHORT_STAY = 5
"""Samples: a mode that is left sooner has the gain of the mode that lasts longest."""
SMALL = 1e-5
"""Change of a state for a difference, as a part of its range."""
MOST_KEPT = 4
"""Models of candidates that are kept, the latest ones: levels of noise move, and they stay."""

_kept: OrderedDict[tuple[object, ...], tuple[Models, object]] = OrderedDict()


def models_of(
    candidate: Candidate, series: Sequence[Series], page: Reals, outcome: Outcome | None
) -> Models:
    """Return the models of a candidate with a page near where `outcome` saw its modes, the longest
    stay first; as they were kept or made now. None of a mode in which it is unstable.

    What they are made of is known by its identity: what is kept holds it.
    """
    held = candidate.predictor, candidate.recipe, outcome, *series
    key = page.tobytes(), *map(id, held)
    found = _kept.pop(key, None) or (_models(candidate, series, page, outcome), held)
    _kept[key] = found
    if len(_kept) > MOST_KEPT:
        _kept.popitem(last=False)
    return found[0]


def _models(
    candidate: Candidate, series: Sequence[Series], page: Reals, outcome: Outcome | None
) -> Models:
    found = {}
    for mode, point in points_of(candidate, series, outcome).items():
        linear = near(candidate, page, mode, point.states, point.inputs)
        if linear is not None:
            found[mode] = linear, point.stay
    return found


def near(
    candidate: Candidate, page: Reals, mode: int, states: Reals, inputs: Reals
) -> Linear | None:
    """Return a candidate over one sample, linearised in a mode near a point; None if unstable."""
    substeps, sizes = candidate.recipe.substeps, SMALL * candidate.spans
    return linearised(candidate.predictor, page, mode, substeps, states, inputs, sizes)


@dataclass(frozen=True)
class Seen:
    """Where a mode was seen: `states` and `inputs` there, and the usual `stay` in it [samples]."""

    states: Reals
    inputs: Reals
    stay: int


def points_of(
    candidate: Candidate, series: Sequence[Series], outcome: Outcome | None
) -> dict[int, Seen]:
    """Return where each mode was seen, in its longest stay; the mode with the longest first.

    Where the first compared signal is largest: friction is steep near rest alone.
    """
    if outcome is None:
        return _first_seen(candidate, series[0])
    found = {}
    runs = outcome.runs
    lows, highs, modes, of = _stays(runs)
    for mode in sorted(set(modes.tolist())):
        here = np.flatnonzero(modes == mode)
        lengths = highs[here] - lows[here]
        best = here[np.argmax(lengths)]
        if np.max(lengths) >= SHORT_STAY:
            one, states = series[of[best]], runs.whole.states[runs.starts[of[best]] :]
            k = _away(one.measured, int(lows[best]), int(highs[best]))
            usual = max(1, round(median(lengths.tolist())))
            found[mode] = int(np.max(lengths)), Seen(states[k].copy(), one.inputs[k].copy(), usual)
    ordered = sorted(found.items(), key=lambda item: -item[1][0])
    return {mode: seen for mode, (_, seen) in ordered}


def _stays(runs: Runs) -> tuple[Wholes, Wholes, Wholes, Wholes]:
    """Return the first sample of each stay in a mode, the one behind it, its mode and recording."""
    modes, starts = runs.whole.modes, runs.starts
    begins = np.ones(len(modes), dtype=np.bool_)
    begins[1:] = modes[1:] != modes[:-1]
    ends = starts[:-1] + runs.done
    begins[starts[:-1]] = True
    begins[ends[ends < starts[1:]]] = True
    edges = np.append(np.flatnonzero(begins), len(modes))
    of = np.searchsorted(starts, edges[:-1], side="right") - 1
    kept = edges[:-1] < ends[of]
    lows, highs, of = edges[:-1][kept], edges[1:][kept], of[kept]
    return lows - starts[of], highs - starts[of], modes[lows], of


def _first_seen(candidate: Candidate, series: Series) -> dict[int, Seen]:
    """Return where a recording starts."""
    predictor = candidate.predictor
    page = candidate.page({}, series)
    none = np.zeros((len(predictor.modes), len(predictor.states), len(predictor.seen)))
    short, measured = series.inputs[:2].copy(), series.measured[:2].copy()
    run = predictor.predict(page, short, measured, none[:0], none, candidate.recipe.substeps, False)
    return {int(run.modes[0]): Seen(run.states[0].copy(), short[0], 1)}


def _away(measured: Reals, low: int, high: int) -> int:
    """Return the sample of a stay, not near its ends, at which the first signal is largest."""
    margin = (high - low) // 5
    inner = np.abs(measured[low + margin : high - margin, 0])
    known = np.where(np.isfinite(inner), inner, -1.0)
    return low + margin + int(np.argmax(known)) if len(known) else (low + high) // 2
