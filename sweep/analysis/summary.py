"""Summary of a study: compute statistics of measures, rates and reasons of failure by group.

Statistics include finished variants only. Variants with a fault bit, stopped and refused ones are
counted separately.
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

from engine.results.array_types import Reals
from language.text.sanitise import escape_formula
from sweep.analysis.confidence_interval import (
    Interval,
    interval_of_mean,
    interval_of_quantile,
    interval_of_rate,
    sum_by_draw,
)
from sweep.definition.measure import StoreColumn
from sweep.evaluation.exact_moments import deviation_of, mean_of, quantiles_of, total_of
from sweep.store.store import Store
from sweep.store.table import StudyTable, to_display_unit

NUMBER_PATTERN = re.compile(r"(?<![\w.])-?\d+(\.\d+)?([eE][-+]?\d+)?(?![\w.]*`)")
"""A number in a message. Messages that differ in numbers only belong to one reason of failure."""


@dataclass(frozen=True)
class Failure:
    """A reason of failure: `count` variants have `status`.

    `message` and `number` are of the first one.
    """

    status: str
    message: str
    count: int
    number: int


def failures_of(table: StudyTable) -> tuple[Failure, ...]:
    """Return the reasons of failure of the unfinished variants, the most frequent one first.

    Variants with the same status, and messages that differ in numbers only, are one reason; a
    number inside a quoted name counts as text. Ties are in the order of the first variant. Empty if
    all are finished.
    """
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
        zip(pairs.tolist(), own[firsts].tolist(), counts.tolist(), strict=True),
        key=lambda row: row[1],
    ):
        key = names[state], NUMBER_PATTERN.sub("#", messages[text])
        known = failures.get(key)
        number = known.number if known else first
        message = known.message if known else messages[text]
        failures[key] = Failure(key[0], message, count + (known.count if known else 0), number)
    return tuple(sorted(failures.values(), key=lambda one: (-one.count, one.number)))


RATE_DENOMINATORS = {"missed": "truths", "first_missed": ""}
"""Parts of a match that are rates, with the part that holds the number of trials.

An empty text means one trial for each variant that has a value.
"""

LINE_FIELDS = ("mean", "deviation", "median", "p5", "p95", "low", "high", "total")
"""The statistics of a measure in the CSV file, besides intervals."""

RATE_FIELDS = ("hits", "share")
"""The columns of a rate in the CSV file, besides its interval."""


@dataclass(frozen=True)
class SummaryLine:
    """Statistics of one measure in one group.

    They are of `count` numbers [unit] from `draws` independent draws. A statistic that needs more
    numbers is NaN. The intervals have the confidence of the study.
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
    """The frequency of an outcome in one group.

    There are `hits` in `count` trials from `draws` independent draws.
    """

    group: Mapping[str, str]
    measure: str
    hits: int
    count: int
    draws: int
    interval: Interval

    @property
    def share(self) -> float:
        """The rate hits / count; NaN without trials."""
        return self.hits / self.count if self.count else math.nan


@dataclass(frozen=True)
class Summary:
    """The results of a study.

    They are the number of variants by status, failures, and statistics and rates by group.
    """

    study: str
    digest: str
    expected: int
    counts: Mapping[str, int]
    failures: tuple[Failure, ...]
    confidence: float
    lines: tuple[SummaryLine, ...]
    rates: tuple[Rate, ...]

    def csv(self) -> str:
        """Return statistics and rates as CSV text with numbers in SI.

        The header has the group names, measure, unit, count, draws, LINE_FIELDS, RATE_FIELDS and
        `<statistic>_from` and `_to` of mean, median and share. Rows of statistics come before rows
        of rates. Cells that do not apply, and NaN, are empty.
        """
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
            writer.writerow({**_group_cells(line), **own, "draws": line.draws})
        for rate in self.rates:
            own = {"measure": rate.measure, "unit": "1", "count": rate.count, "draws": rate.draws}
            own |= {"hits": rate.hits, "share": rate.share if rate.count else ""}
            share = _interval_columns("share", rate.interval)
            writer.writerow({**_group_cells(rate), **own, **share})
        return text.getvalue()


def _group_cells(line: SummaryLine | Rate) -> dict[str, str]:
    """Return the group of a line as cells of CSV."""
    return {name: escape_formula(text) for name, text in line.group.items()}


def _interval_columns(name: str, interval: Interval) -> dict[str, float]:
    """Return the columns `<name>_from` and `<name>_to`; empty without an interval."""
    return {f"{name}_from": interval[0], f"{name}_to": interval[1]} if interval else {}


def summary_of(store: Store) -> Summary:
    """Return the summary of the stored variants.

    Statistics and rates include finished variants only, by group; a group without any is left out.
    Measures of texts and truth values have no statistics; truth values and the parts
    RATE_DENOMINATORS of a match have rates. Raises SpecError for a damaged store, MissingToolError
    without pyarrow.
    """
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
    """Yield labels and mask (n_variants,) of finished variants for each group that has any.

    Without grouping columns there is one group, also if it is empty.
    """
    keys = [group_values(table, name) for name in group_names(table)]
    for places in itertools.product(*(range(len(names)) for _, names in keys)):
        chosen = table.is_done
        for place, (column, _) in zip(places, keys, strict=True):
            chosen = chosen & (column == place)
        names = [names[place] for place, (_, names) in zip(places, keys, strict=True)]
        if chosen.any() or len(keys) == 0:
            yield dict(zip(group_names(table), names, strict=True)), chosen


def group_names(table: StudyTable) -> list[str]:
    """Return the columns by which results are grouped.

    These are the columns in the study's `summary: by`, else those of `variant` and `scenario` that
    have more than one value; possibly none.
    """
    if table.store.manifest.presentation.by:
        return list(table.store.manifest.presentation.by)
    return [name for name in ("variant", "scenario") if len(table.read_categories(name)[1]) > 1]


def group_values(table: StudyTable, name: str) -> tuple[NDArray[np.int64], list[str]]:
    """Return the index (n_variants,) of each value in the list of different ones, and their names.

    `name` is `variant`, `scenario` (in order of first occurrence) or a variable (in ascending
    order; names are enumeration words or numbers in the display unit, `-` for missing). Raises
    StopIteration for a measure.
    """
    if name in ("variant", "scenario"):
        return table.read_categories(name)
    manifest = table.store.manifest
    values, places = np.unique(table.read_reals(name), return_inverse=True)
    column = next(column for column in manifest.varied if column.name == name)
    words = manifest.words.get(name)
    names = [words[int(v)] if words else format_value(float(v), column) for v in values]
    return places.reshape(-1), names


def format_value(value: float, column: StoreColumn) -> str:
    """Return a value [SI] of a column in its display unit, like `12.5 ms`; `-` for NaN.

    It has six digits; the unit is left out if it is 1.
    """
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
    """Return the statistics of the values (n,) [SI] of a column in one group."""
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
    """Yield the rates of a truth measure, or of the missed events of a match, for each group.

    Yield nothing for other columns.
    """
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
