"""Summary: how often, how large, how sure - the numbers of a study over its variants.

Only variants that are done count; those with a fault bit, stopped or refused are counted apart.
"""

from __future__ import annotations

import csv
import io
import itertools
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sweep.analysis.confidence_interval import (
    Interval,
    interval_of_mean,
    interval_of_quantile,
    interval_of_rate,
    sum_by_draw,
)
from sweep.definition.measure import StoreColumn
from sweep.measurement.exact_moments import deviation_of, mean_of, quantiles_of, total_of
from sweep.store.store import Store
from sweep.store.table import Reals, StudyTable, to_display_unit

NUMBER_PATTERN = re.compile(r"(?<![\w.])-?\d+(\.\d+)?([eE][-+]?\d+)?(?![\w.]*`)")
"""A number of a message: two that differ in numbers alone tell one reason."""


@dataclass(frozen=True)
class Failure:
    """A reason: `count` variants ended so; `message` is that of `number`, the first of them."""

    status: str
    message: str
    count: int
    number: int


def failures_of(table: StudyTable) -> tuple[Failure, ...]:
    """Return why the variants of a store that are not done are not."""
    if table.is_done.all():
        return ()
    states, names = table.read_categories("status")
    texts, messages = table.read_categories("message")
    numbers = table.read_reals("number").astype(np.int64)
    failures: dict[tuple[str, str], Failure] = {}
    reasons = np.stack((states, texts), axis=1)[~table.is_done]
    pairs, firsts, counts = np.unique(reasons, axis=0, return_index=True, return_counts=True)
    own = numbers[~table.is_done]
    for (state, text), first, count in sorted(
        zip(pairs.tolist(), own[firsts].tolist(), counts.tolist(), strict=True), key=_first_number
    ):
        key = names[state], NUMBER_PATTERN.sub("#", messages[text])
        known = failures.get(key)
        number = known.number if known else first
        message = known.message if known else messages[text]
        failures[key] = Failure(key[0], message, count + (known.count if known else 0), number)
    return tuple(sorted(failures.values(), key=lambda one: (-one.count, one.number)))


def _first_number(row: tuple[list[int], int, int]) -> int:
    return row[1]


RATE_DENOMINATORS = {"missed": "truths", "first_missed": ""}
"""Parts of a match that are rates: of how many; an empty text: of the variants that have one."""

LINE_FIELDS = ("mean", "deviation", "median", "p5", "p95", "low", "high", "total")

RATE_FIELDS = ("hits", "share")
"""What a line, and what a rate, has in a table beside its intervals."""


@dataclass(frozen=True)
class SummaryLine:
    """One measure in one group: `count` numbers [unit], and what they are like; NaN: too few.

    They come from so many independent `draws`. `mean_interval`, `median_interval` are at the
    confidence of the study.
    """

    group: Mapping[str, str]
    measure: str
    unit: str
    count: int
    draws: int
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
    """How often something was the case in one group: `hits` of `count` in so many `draws`."""

    group: Mapping[str, str]
    measure: str
    hits: int
    count: int
    draws: int
    interval: Interval

    @property
    def share(self) -> float:
        """The rate; NaN without any."""
        return self.hits / self.count if self.count else math.nan


@dataclass(frozen=True)
class Summary:
    """The results of a study: how many variants ended how and why, lines and rates by group."""

    study: str
    digest: str
    expected: int
    counts: Mapping[str, int]
    failures: tuple[Failure, ...]
    confidence: float
    lines: tuple[SummaryLine, ...]
    rates: tuple[Rate, ...]

    def csv(self) -> str:
        """Return lines and rates as CSV, numbers in SI; what one of them has not is empty."""
        text = io.StringIO()
        entries: list[SummaryLine | Rate] = [*self.lines, *self.rates]
        groups = list(entries[0].group) if entries else []
        ends = [f"{of}_{end}" for of in ("mean", "median", "share") for end in ("from", "to")]
        heads = ("measure", "unit", "count", "draws", *LINE_FIELDS, *RATE_FIELDS, *ends)
        writer = csv.DictWriter(text, (*groups, *heads), restval="", lineterminator="\n")
        writer.writeheader()
        for line in self.lines:
            own = {name: value for name in LINE_FIELDS if (value := getattr(line, name)) == value}
            own |= {"measure": line.measure, "unit": line.unit, "count": line.count}
            own |= _interval_columns("mean", line.mean_interval) | _interval_columns(
                "median", line.median_interval
            )
            writer.writerow({**line.group, **own, "draws": line.draws})
        for rate in self.rates:
            own = {"measure": rate.measure, "unit": "1", "count": rate.count, "draws": rate.draws}
            own |= {"hits": rate.hits, "share": rate.share if rate.count else ""}
            writer.writerow({**rate.group, **own, **_interval_columns("share", rate.interval)})
        return text.getvalue()


def _interval_columns(name: str, interval: Interval) -> dict[str, float]:
    return {f"{name}_from": interval[0], f"{name}_to": interval[1]} if interval else {}


def summary_of(store: Store) -> Summary:
    """Return the summary of what a store holds so far. Raises SpecError, ToolMissing."""
    table = StudyTable(store)
    manifest = store.manifest
    confidence = manifest.presentation.confidence
    lines: list[SummaryLine] = []
    rates: list[Rate] = []
    groups = list(_group_masks(table))
    for column in (each for each in manifest.measures if each.type not in ("text", "truth")):
        pooled = table.read_pooled(column.name)
        for name, chosen in groups:
            own = chosen[pooled.rows]
            draws = table.draws[pooled.rows[own]]
            lines.append(_summarise_column(name, column, pooled.values[own], draws, confidence))
    for column in manifest.measures:
        rates += _count_rates(table, column, groups, confidence)
    return Summary(
        study=manifest.study,
        digest=manifest.digest,
        expected=manifest.count,
        counts=table.counts,
        failures=failures_of(table),
        confidence=confidence,
        lines=tuple(lines),
        rates=tuple(rates),
    )


def _group_masks(table: StudyTable) -> Iterator[tuple[dict[str, str], NDArray[np.bool_]]]:
    """Yield each group that has variants: its names, and which variants (n_variants,) count."""
    keys = [group_values(table, name) for name in group_names(table)]
    for places in itertools.product(*(range(len(names)) for _, names in keys)):
        chosen = table.is_done
        for place, (column, _) in zip(places, keys, strict=True):
            chosen = chosen & (column == place)
        names = [names[place] for place, (_, names) in zip(places, keys, strict=True)]
        if chosen.any() or len(keys) == 0:
            yield dict(zip(group_names(table), names, strict=True)), chosen


def group_names(table: StudyTable) -> list[str]:
    """Return what is told apart: what the study says, else variants and scenarios if several."""
    if table.store.manifest.presentation.by:
        return list(table.store.manifest.presentation.by)
    return [name for name in ("variant", "scenario") if len(table.read_categories(name)[1]) > 1]


def group_values(table: StudyTable, name: str) -> tuple[NDArray[np.int64], list[str]]:
    """Return the places (n_variants,) of a column in the list of its different values."""
    if name in ("variant", "scenario"):
        return table.read_categories(name)
    manifest = table.store.manifest
    values, places = np.unique(table.read_reals(name), return_inverse=True)
    column = next(column for column in manifest.varied if column.name == name)
    words = manifest.words.get(name)
    names = [words[int(v)] if words else format_value(float(v), column) for v in values]
    return places.reshape(-1), names


def format_value(value: float, column: StoreColumn) -> str:
    """Return a value [SI] of a column to six digits, with the unit in which it is shown."""
    if math.isnan(value):
        return "-"
    number = f"{to_display_unit(value, column):.6g}"
    return number if column.label == "1" else f"{number} {column.label}"


def _summarise_column(
    group: Mapping[str, str],
    column: StoreColumn,
    values: Reals,
    draws: NDArray[np.int64],
    confidence: float,
) -> SummaryLine:
    count = len(values)
    ordered = np.sort(values)
    nothing = math.nan
    p5, median, p95 = quantiles_of(ordered, (0.05, 0.5, 0.95)) if count else (nothing,) * 3
    return SummaryLine(
        group=group,
        measure=column.name,
        unit=column.unit,
        count=count,
        draws=len(np.unique(draws)),
        mean=mean_of(values) if count else nothing,
        mean_interval=interval_of_mean(values, draws, confidence),
        deviation=deviation_of(values) if count > 1 else nothing,
        median=median,
        median_interval=interval_of_quantile(values, draws, 0.5, confidence),
        p5=p5,
        p95=p95,
        low=float(ordered[0]) if count else nothing,
        high=float(ordered[-1]) if count else nothing,
        total=total_of(values) if count else nothing,
    )


def _count_rates(
    table: StudyTable,
    column: StoreColumn,
    groups: Sequence[tuple[dict[str, str], NDArray[np.bool_]]],
    confidence: float,
) -> Iterator[Rate]:
    """Yield how often something is the case; how many truths, how often the first, were missed."""
    base, _, part = column.name.rpartition(".")
    if column.type != "truth" and part not in RATE_DENOMINATORS:
        return
    hits = table.read_reals(column.name)
    whole = RATE_DENOMINATORS.get(part, "") if column.type != "truth" else ""
    of = table.read_reals(f"{base}.{whole}") if whole else (hits == hits).astype(np.float64)
    for group, chosen in groups:
        known = chosen & (np.nan_to_num(of) > 0.0)
        draws = table.draws[known]
        own, sizes = sum_by_draw(hits[known], draws), sum_by_draw(of[known], draws)
        seen, count = int(np.sum(own)), int(np.sum(sizes))
        interval = interval_of_rate(own, sizes, confidence)
        yield Rate(group, column.name, seen, count, len(sizes), interval)
