"""Sensitivity: which of the things that are drawn move a measure - indices from a store.

Of Saltelli's blocks: first order and total (Saltelli and others, Comput. Phys. Commun. 181 (2010)
259, Table 2 b and f). Of Morris' paths: mean, mean magnitude and spread of elementary effects
(Campolongo and others, Environ. Model. Softw. 22 (2007) 1509). Intervals are those of a bootstrap.
"""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sweep.analysis.confidence_interval import Interval
from sweep.analysis.summary import group_values
from sweep.definition.measure import StoreColumn
from sweep.definition.study import MORRIS_LEVELS
from sweep.design.sensitivity_design import STRIDE, morris_points
from sweep.measurement.exact_moments import scale_to_squarable
from sweep.store.manifest import Design, store_error
from sweep.store.store import Store
from sweep.store.table import Reals, StudyTable

BOOTSTRAP_REPLICATES = 500
"""Of the bootstrap: the ends of an interval at 95 % stand on a dozen of them each."""
BOOTSTRAP_SEED = 1
MAX_RESAMPLED = 1 << 17
"""Numbers that are drawn again at once: as many as a cache holds."""
MIN_COMPLETE = 4
"""Complete blocks or paths below which nothing is told."""
INDEX_NAMES = {"saltelli": ("first", "total"), "morris": ("mu_star", "mu", "sigma")}
"""The indices of a design."""


@dataclass(frozen=True)
class Index:
    """How one thing that is drawn moves a measure in one group.

    `values` and `intervals` by name: `first`, `total` (shares of the variance), or `mu_star`, `mu`,
    `sigma` [unit of the measure]: of the change from one share to another, over their difference.
    `used` blocks or paths of `count` are complete: every point is done and has the measure. Of
    fewer than FEWEST nothing is told: the values are NaN.
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
    """The indices of a study, and of which design they are.

    So many variants of those `expected` are there; `counts`: how they ended.
    """

    study: str
    digest: str
    expected: int
    counts: Mapping[str, int]
    method: str
    confidence: float
    indices: tuple[Index, ...]

    def csv(self) -> str:
        """Return the indices as CSV, numbers in SI."""
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        groups = list(self.indices[0].group) if self.indices else []
        names = INDEX_NAMES[self.method]
        ends = [f"{name}_{end}" for name in names for end in ("from", "to")]
        writer.writerow([*groups, "measure", "unit", "name", *names, *ends, "used", "count"])
        for one in self.indices:
            ends = [str(end) for pair in one.intervals.values() for end in pair or ("", "")]
            head = [*one.group.values(), one.measure, one.unit, one.name]
            values = ["" if math.isnan(value) else value for value in one.values.values()]
            writer.writerow([*head, *values, *ends, one.used, one.count])
        return text.getvalue()


@dataclass(frozen=True)
class DesignGroup:
    """What has a design of its own: its names, its variants (n_variants,), and what moved there."""

    labels: Mapping[str, str]
    mask: NDArray[np.bool_]
    varying: frozenset[str]


def sensitivity_of(store: Store) -> Sensitivity:
    """Return the indices of what a store holds so far. Raises SpecError, ToolMissing."""
    manifest, design = store.manifest, store.manifest.design
    if not design.has_indices:
        label = f"the points of `{manifest.study}` are no design of which indices are made"
        hint = "draw them by `sampling: {saltelli: 256, seed: 1}`, or fewer by `{morris: 50}`"
        raise store_error(store.folder, "store", label, hint)
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
    """Return indices (..., d) of results (..., n, d + 2) at A, B and A with a column of B."""
    a, b, mixed = results[..., :1], results[..., 1:2], results[..., 2:]
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        variance = np.var(results[..., :2], axis=(-2, -1))[..., None]
        mean = np.mean(results[..., :2], axis=(-2, -1), keepdims=True)
        first = np.mean((b - mean) * (mixed - a), axis=-2) / variance
        total = 0.5 * np.mean((a - mixed) ** 2, axis=-2) / variance
    return {"first": first, "total": total}


def morris_indices(effects: Reals) -> dict[str, Reals]:
    """Return indices (..., d) of elementary effects (..., n, d)."""
    with np.errstate(over="ignore", invalid="ignore"):  # what is too large is no number: not told
        return {
            "mu_star": np.mean(np.abs(effects), axis=-2),
            "mu": np.mean(effects, axis=-2),
            "sigma": np.std(effects, axis=-2, ddof=1),
        }


def elementary_effects(results: Reals, points: Reals) -> Reals:
    """Return effects (n, d) of results (n, d + 1) at shares (n, d + 1, d) of paths.

    Each step changes the share of one thing by the stride, whatever becomes of its value: one that
    draws the same value again has no effect.
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
    """Yield the indices of a measure in each group: variant, scenario, point of the grid."""
    size = len(design.names)
    samples = table.read_reals("sample").astype(np.int64)
    values = np.where(table.is_done, table.read_reals(column.name), np.nan)
    confidence = table.store.manifest.presentation.confidence
    for group in groups:
        chosen = group.mask
        results = _arrange_results(samples[chosen], values[chosen], design)
        fine = np.flatnonzero(~np.isnan(results).any(axis=1))
        used, _ = scale_to_squarable(results[fine])  # shares of a variance have no unit
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
    """Tell whether drawn values (n,) are not all one: of what never changed nothing is known."""
    return len(values) > 0 and float(np.min(values)) < float(np.max(values))


def _finite_interval(low: float, high: float) -> Interval:
    """Return an interval, None where an end is no number."""
    return (float(low), float(high)) if np.isfinite(low) and np.isfinite(high) else None


def _arrange_results(samples: NDArray[np.int64], values: Reals, design: Design) -> Reals:
    """Return values (n, each) by their place in the design, the mean over all replicates."""
    total = np.bincount(samples, values, design.count)
    times = np.bincount(samples, minlength=design.count)
    means = total / np.where(times == design.replicates, times, np.nan)
    return np.asarray(means.reshape(-1, design.group_size))


def _design_groups(table: StudyTable, design: Design) -> Iterator[DesignGroup]:
    """Yield what has a design of its own: told by name where there are several."""
    drawn = {name: table.read_reals(name) for name in design.names}
    for named, chosen in _group_masks(table, design):
        moved = {name for name, values in drawn.items() if _is_varying(values[chosen])}
        yield DesignGroup(named, chosen, frozenset(moved))


def _group_masks(
    table: StudyTable, design: Design
) -> Iterator[tuple[dict[str, str], NDArray[np.bool_]]]:
    """Yield the names of each group, and which variants (n_variants,) are its own."""
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
    """Return the ends (d,) of the intervals of indices: whole blocks or paths are drawn again."""
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
