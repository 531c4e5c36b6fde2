"""Sensitivity analysis: compute Sobol indices or elementary effects from the results of a study.

Saltelli design: first-order and total indices (Saltelli et al., Comput. Phys. Commun. 181 (2010)
259, Table 2 b and f). Morris design: mean, mean magnitude and standard deviation of elementary
effects (Campolongo et al., Environ. Model. Softw. 22 (2007) 1509). Confidence intervals are
percentiles of a bootstrap over blocks or paths.
"""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from engine.results.array_types import Reals
from language.text.sanitise import escape_formula
from sweep.analysis.confidence_interval import Interval
from sweep.analysis.summary import group_values
from sweep.definition.measure import StoreColumn
from sweep.definition.study import MORRIS_LEVELS
from sweep.design.sensitivity_design import STRIDE, morris_points
from sweep.evaluation.exact_moments import scale_to_squarable
from sweep.store.manifest import Design, store_error
from sweep.store.store import Store
from sweep.store.table import StudyTable

BOOTSTRAP_REPLICATES = 500
"""Replicates of the bootstrap: about a dozen lie beyond each end of a 95 % interval."""
BOOTSTRAP_SEED = 1
"""Seed of the bootstrap, so that the same store gives the same intervals."""
MAX_RESAMPLED = 1 << 17
"""Largest number of values that are resampled in one array operation, for the cache."""
MIN_COMPLETE = 4
"""Smallest number of complete blocks or paths for which indices are computed."""
INDEX_NAMES = {"saltelli": ("first", "total"), "morris": ("mu_star", "mu", "sigma")}
"""The names of the indices by sampling method."""


@dataclass(frozen=True)
class Index:
    """Sensitivity indices of one measure with respect to one random variable in one group.

    `values` and `intervals` have the keys `first` and `total` (fractions of the variance), or
    `mu_star`, `mu` and `sigma` [unit of the measure]: the change of the measure over the change of
    the quantile level. `used` of `count` blocks or paths are complete, i.e. each point is finished
    and has the measure. With fewer than MIN_COMPLETE the values are NaN.
    """

    group: Mapping[str, str]
    measure: str
    unit: str
    name: str
    values: Mapping[str, float]
    intervals: Mapping[str, Interval]
    used: int
    count: int


@dataclass(frozen=True)
class Sensitivity:
    """The sensitivity indices of a study with its sampling method.

    `expected` is the number of variants of the study, `counts` the number of stored variants by
    status.
    """

    study: str
    digest: str
    expected: int
    counts: Mapping[str, int]
    method: str
    confidence: float
    indices: tuple[Index, ...]

    def csv(self) -> str:
        """Return the indices as CSV text with a header and one row for each index.

        The columns are the group names, measure, unit, name, the INDEX_NAMES of the method,
        `<index>_from` and `<index>_to` for each, used, count. Numbers are in SI; NaN and missing
        intervals are empty.
        """
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        groups = list(self.indices[0].group) if self.indices else []
        names = INDEX_NAMES[self.method]
        ends = [f"{name}_{end}" for name in names for end in ("from", "to")]
        writer.writerow([*groups, "measure", "unit", "name", *names, *ends, "used", "count"])
        for one in self.indices:
            ends = [str(end) for pair in one.intervals.values() for end in pair or ("", "")]
            head = [*map(escape_formula, one.group.values()), one.measure, one.unit, one.name]
            values = ["" if math.isnan(value) else value for value in one.values.values()]
            writer.writerow([*head, *values, *ends, one.used, one.count])
        return text.getvalue()


@dataclass(frozen=True)
class DesignGroup:
    """The variants of one complete design: variant, scenario and grid point are the same for all.

    `labels` are the names and values of the group, `mask` (n_variants,) selects its rows, `varying`
    are the random variables that have more than one value in it.
    """

    labels: Mapping[str, str]
    mask: NDArray[np.bool_]
    varying: frozenset[str]


def sensitivity_of(store: Store) -> Sensitivity:
    """Return the sensitivity indices of the finished variants of a store.

    There is one `Index` for each measure that is no list, each group (combination of variant,
    scenario and grid values) and each random variable, in this order. It is NaN for a variable with
    one value in the group and for fewer than MIN_COMPLETE complete blocks or paths. Raises
    SpecError if the study has no design for indices or the store is damaged, MissingToolError
    without pyarrow.
    """
    manifest, design = store.manifest, store.manifest.design
    if not design.has_indices:
        label = f"the points of `{manifest.study}` are no design of which indices are made"
        hint = "draw them by `sampling: {saltelli: 256, seed: 1}`, or fewer by `{morris: 50}`"
        raise store_error(store.folder, label, hint)
    table = StudyTable(store)
    groups = list(_design_groups(table, design))
    found = [
        index
        for column in manifest.measures
        if column.type != "list"
        for index in _measure_indices(table, design, column, groups)
    ]
    return Sensitivity(
        study=manifest.study,
        digest=manifest.digest,
        expected=manifest.count,
        counts=table.counts,
        method=design.method,
        confidence=manifest.presentation.confidence,
        indices=tuple(found),
    )


def sobol_indices(results: Reals) -> dict[str, Reals]:
    """Return first-order and total Sobol indices (..., d) of results (..., n, d + 2).

    The keys are `first` and `total`. The last axis holds the results at A, at B and at A with
    column i of B. The variance is that of A and B together; the indices are NaN or infinite if it
    is zero.
    """
    a, b, mixed = results[..., :1], results[..., 1:2], results[..., 2:]
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        variance = np.var(results[..., :2], axis=(-2, -1))[..., None]
        mean = np.mean(results[..., :2], axis=(-2, -1), keepdims=True)
        first = np.mean((b - mean) * (mixed - a), axis=-2) / variance
        total = 0.5 * np.mean((a - mixed) ** 2, axis=-2) / variance
    return {"first": first, "total": total}


def morris_indices(effects: Reals) -> dict[str, Reals]:
    """Return `mu_star`, `mu` and `sigma` (..., d) of elementary effects (..., n, d).

    They are the mean magnitude, the mean and the standard deviation (divisor n - 1). An overflow
    gives a value that is not finite.
    """
    with np.errstate(
        over="ignore", invalid="ignore"
    ):  # an overflow gives a value that is not finite
        return {
            "mu_star": np.mean(np.abs(effects), axis=-2),
            "mu": np.mean(effects, axis=-2),
            "sigma": np.std(effects, axis=-2, ddof=1),
        }


def elementary_effects(results: Reals, points: Reals) -> Reals:
    """Return the elementary effects (n, d) of Morris paths, one for each path and variable.

    The results (n, d + 1) belong to the quantile levels `points` (n, d + 1, d). Each step changes
    the level of one variable by the stride. The effect is the signed difference of the results over
    the change of the level; it is zero if the changed level draws the same value.
    """
    moved = np.diff(points, axis=1)
    changed = np.argmax(np.abs(moved), axis=2)
    sign = np.sign(np.take_along_axis(moved, changed[:, :, None], axis=2)[:, :, 0])
    found = np.full(changed.shape, np.nan)
    with np.errstate(over="ignore", invalid="ignore"):
        steps = sign * np.diff(results, axis=1) * MORRIS_LEVELS / STRIDE
    np.put_along_axis(found, changed, steps, axis=1)
    return found


def _measure_indices(
    table: StudyTable, design: Design, column: StoreColumn, groups: Iterable[DesignGroup]
) -> Iterator[Index]:
    """Yield the indices of a measure for each group and each random variable of the design."""
    size = len(design.names)
    samples = table.read_reals("sample").astype(np.int64)
    values = np.where(table.is_done, table.read_reals(column.name), np.nan)
    confidence = table.store.manifest.presentation.confidence
    for group in groups:
        chosen = group.mask
        results = _arrange_results(samples[chosen], values[chosen], design)
        fine = np.flatnonzero(~np.isnan(results).any(axis=1))
        used, _ = scale_to_squarable(results[fine])  # relative to the variance, hence without unit
        estimate: Callable[[Reals], dict[str, Reals]] = sobol_indices
        if design.method == "morris":
            numbers = (fine[:, None] * design.group_size + np.arange(design.group_size)).reshape(-1)
            shares = morris_points(size, numbers, design.seed)
            shares = shares.reshape(len(fine), design.group_size, size)
            used = elementary_effects(results[fine], shares)
            estimate = morris_indices
        found = {name: np.full(size, np.nan) for name in INDEX_NAMES[design.method]}
        ends: dict[str, tuple[Reals, Reals]] = {}
        if len(used) >= MIN_COMPLETE:
            found, ends = estimate(used), _bootstrap_intervals(used, estimate, confidence)
        for place, name in enumerate(design.names):
            own: dict[str, float] = dict.fromkeys(found, np.nan)
            sure: dict[str, Interval] = dict.fromkeys(found)
            if name in group.varying:
                own = {key: float(numbers[place]) for key, numbers in found.items()}
                sure |= {
                    key: _finite_interval(low[place], high[place])
                    for key, (low, high) in ends.items()
                }
            yield Index(
                group.labels,
                column.name,
                column.unit,
                name,
                own,
                sure,
                len(used),
                design.group_count,
            )


def _is_varying(values: Reals) -> bool:
    """Return whether drawn values (n,) have more than one value; False without values."""
    return len(values) > 0 and float(np.min(values)) < float(np.max(values))


def _finite_interval(low: float, high: float) -> Interval:
    """Return the interval (low, high); None if an end is not finite."""
    return (float(low), float(high)) if np.isfinite(low) and np.isfinite(high) else None


def _arrange_results(samples: NDArray[np.int64], values: Reals, design: Design) -> Reals:
    """Return values (n,) as an array (n_groups, group_size) in the order of the design.

    Each entry is the mean over the replicates; NaN if a replicate is missing.
    """
    total = np.bincount(samples, values, design.count)
    times = np.bincount(samples, minlength=design.count)
    means = total / np.where(times == design.replicates, times, np.nan)
    return np.asarray(means.reshape(-1, design.group_size))


def _design_groups(table: StudyTable, design: Design) -> Iterator[DesignGroup]:
    """Yield the groups of variants that form a complete design each."""
    drawn = {name: table.read_reals(name) for name in design.names}
    for named, chosen in _group_masks(table, design):
        moved = {name for name, values in drawn.items() if _is_varying(values[chosen])}
        yield DesignGroup(named, chosen, frozenset(moved))


def _group_masks(
    table: StudyTable, design: Design
) -> Iterator[tuple[dict[str, str], NDArray[np.bool_]]]:
    """Yield labels and mask (n_variants,) of each combination of variant, scenario and grid values.

    The labels contain only columns with more than one value.
    """
    axes = [c.name for c in table.store.manifest.varied if c.name not in design.names]
    keys = {name: group_values(table, name) for name in ("variant", "scenario", *axes)}
    keys = {name: key for name, key in keys.items() if len(key[1]) > 1}
    if not keys:
        yield {}, np.ones(len(table.is_done), dtype=bool)
        return
    stacked = np.stack([places for places, _ in keys.values()], axis=1)
    for row in np.unique(stacked, axis=0):
        named = {name: key[1][k] for (name, key), k in zip(keys.items(), row, strict=True)}
        yield named, np.all(stacked == row, axis=1)


def _bootstrap_intervals(
    samples: Reals, estimate: Callable[[Reals], dict[str, Reals]], confidence: float
) -> dict[str, tuple[Reals, Reals]]:
    """Return the ends (d,) of percentile intervals of each index by name.

    The bootstrap resamples whole blocks or paths, the second-last but one axis of `samples`.
    """
    source, count = np.random.default_rng(BOOTSTRAP_SEED), len(samples)
    size = max(1, MAX_RESAMPLED // samples.size)
    drawn = [
        estimate(
            samples[source.integers(0, count, (min(size, BOOTSTRAP_REPLICATES - first), count))]
        )
        for first in range(0, BOOTSTRAP_REPLICATES, size)
    ]
    rest = (1.0 - confidence) / 2.0
    found = {}
    for key in drawn[0]:
        replicates = np.concatenate([some[key] for some in drawn])
        with np.errstate(invalid="ignore"):  # of a measure that is the same everywhere
            low, high = np.quantile(replicates, (rest, 1.0 - rest), axis=0)
        found[key] = (low, high)
    return found
