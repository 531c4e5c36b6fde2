"""Summary: how often, how large, how sure - the numbers of a study over its variants.

Only variants that are done count; those with a fault bit, stopped or refused are counted apart.
"""

from __future__ import annotations

import csv
import io
import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sweep.interval import Interval, of_mean, of_quantile, wilson
from sweep.measure import Column
from sweep.moments import deviation_of, mean_of, quantiles_of, total_of
from sweep.store import Store
from sweep.table import Reals, Table

RATES = {"missed": "truths", "first_missed": ""}
"""Parts of a match that are rates: of how many; an empty text: of the variants that have one."""


@dataclass(frozen=True)
class Line:
    """One measure in one group: `count` numbers [unit], and what they are like; NaN: too few.

    `mean_interval`, `median_interval` are at the confidence of the study.
    """

    group: Mapping[str, str]
    measure: str
    unit: str
    count: int
    mean: float
    mean_interval: Interval
    deviation: float
    median: float
    median_interval: Interval
    p5: float
    p95: float
    low: float
    high: float
    total: float


@dataclass(frozen=True)
class Rate:
    """How often something was the case in one group, with its Wilson interval."""

    group: Mapping[str, str]
    measure: str
    hits: int
    count: int
    interval: Interval


@dataclass(frozen=True)
class Summary:
    """The results of a study: how many variants ended how, lines and rates by group."""

    study: str
    digest: str
    expected: int
    counts: Mapping[str, int]
    confidence: float
    lines: tuple[Line, ...]
    rates: tuple[Rate, ...]

    def csv(self) -> str:
        """Return the lines as CSV, numbers in SI."""
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        groups = list(self.lines[0].group) if self.lines else []
        numbers = ("mean", "deviation", "median", "p5", "p95", "low", "high", "total")
        ends = [f"{of}_{end}" for of in ("mean", "median") for end in ("from", "to")]
        writer.writerow([*groups, "measure", "unit", "count", *numbers, *ends])
        for line in self.lines:
            cells = [line.group[name] for name in groups]
            intervals = [*(line.mean_interval or ("", "")), *(line.median_interval or ("", ""))]
            values = [getattr(line, name) for name in numbers]
            shown = ["" if math.isnan(value) else value for value in values]
            writer.writerow([*cells, line.measure, line.unit, line.count, *shown, *intervals])
        return text.getvalue()


def summary_of(store: Store) -> Summary:
    """Return the summary of what a store holds so far. Raises SpecError, ToolMissing."""
    table = Table(store)
    manifest = store.manifest
    confidence = manifest.presentation.confidence
    lines: list[Line] = []
    rates: list[Rate] = []
    groups = list(_groups(table))
    for column in (each for each in manifest.measures if each.type not in ("text", "truth")):
        pooled = table.pooled(column.name)
        for name, chosen in groups:
            values = pooled.values[chosen[pooled.rows]]
            lines.append(_line(name, column, values, confidence))
    for column in manifest.measures:
        rates += _rates(table, column, groups, confidence)
    return Summary(
        study=manifest.study,
        digest=manifest.digest,
        expected=manifest.count,
        counts=table.counts,
        confidence=confidence,
        lines=tuple(lines),
        rates=tuple(rates),
    )


def _groups(table: Table) -> Iterator[tuple[dict[str, str], NDArray[np.bool_]]]:
    """Yield each group that has variants: its names, and which variants (n_variants,) count."""
    keys = [group_values(table, name) for name in group_names(table)]
    for places in itertools.product(*(range(len(names)) for _, names in keys)):
        chosen = table.is_done
        for place, (column, _) in zip(places, keys, strict=True):
            chosen = chosen & (column == place)
        names = [names[place] for place, (_, names) in zip(places, keys, strict=True)]
        if chosen.any() or len(keys) == 0:
            yield dict(zip(group_names(table), names, strict=True)), chosen


def group_names(table: Table) -> list[str]:
    """Return what is told apart: what the study says, else variants and scenarios if several."""
    if table.store.manifest.presentation.by:
        return list(table.store.manifest.presentation.by)
    return [name for name in ("variant", "scenario") if len(table.words(name)[1]) > 1]


def group_values(table: Table, name: str) -> tuple[NDArray[np.int64], list[str]]:
    """Return the places (n_variants,) of a column in the list of its different values."""
    if name in ("variant", "scenario"):
        return table.words(name)
    manifest = table.store.manifest
    values, places = np.unique(table.reals(name), return_inverse=True)
    unit = next(column.unit for column in manifest.varied if column.name == name)
    words = manifest.words.get(name)
    names = [words[int(v)] if words else with_unit(float(v), unit) for v in values]
    return places.reshape(-1), names


def with_unit(value: float, unit: str) -> str:
    """Return a number with its unit, to six digits."""
    if math.isnan(value):
        return "-"
    return f"{value:.6g}" if unit == "1" else f"{value:.6g} {unit}"


def _line(group: Mapping[str, str], column: Column, values: Reals, confidence: float) -> Line:
    count = len(values)
    ordered = np.sort(values)
    nothing = math.nan
    p5, median, p95 = quantiles_of(ordered, (0.05, 0.5, 0.95)) if count else (nothing,) * 3
    return Line(
        group=group,
        measure=column.name,
        unit=column.unit,
        count=count,
        mean=mean_of(values) if count else nothing,
        mean_interval=of_mean(values, confidence),
        deviation=deviation_of(values) if count > 1 else nothing,
        median=median,
        median_interval=of_quantile(ordered, 0.5, confidence),  # type: ignore[arg-type]
        p5=p5,
        p95=p95,
        low=float(ordered[0]) if count else nothing,
        high=float(ordered[-1]) if count else nothing,
        total=total_of(values) if count else nothing,
    )


def _rates(
    table: Table,
    column: Column,
    groups: Sequence[tuple[dict[str, str], NDArray[np.bool_]]],
    confidence: float,
) -> Iterator[Rate]:
    """Yield how often something is the case; how many truths, how often the first, were missed."""
    base, _, part = column.name.rpartition(".")
    if column.type != "truth" and part not in RATES:
        return
    hits = table.reals(column.name)
    whole = RATES.get(part, "") if column.type != "truth" else ""
    of = table.reals(f"{base}.{whole}") if whole else (hits == hits).astype(np.float64)
    for group, chosen in groups:
        seen = int(np.nansum(hits[chosen]))
        count = int(np.nansum(of[chosen]))
        yield Rate(group, column.name, seen, count, wilson(seen, count, confidence))
