"""Study output: print the summary of a study."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from language.expressions.units import display_unit
from language.text.sanitise import escape_invisible
from modewright.render.run import nonfinite_to_none
from modewright.runtime.json_format import format_entry
from sweep.analysis.summary import Rate, Summary, SummaryLine

MAX_FAILURES = 5
"""Largest number of reasons that are printed; --json and the store have all."""


def print_summary(console: Console, summary: Summary) -> None:
    """Print the number of variants by status, reasons of failure, and tables of measures and rates.

    Empty tables are left out.
    """
    text = f"{summary.study}: {progress_text(summary.counts, summary.expected)}"
    console.print(escape_invisible(text), highlight=False, markup=False)
    for text in failure_texts(summary):
        console.print(f"  {escape_invisible(text)}", highlight=False, markup=False)
    if summary.lines:
        console.print(_measure_table(summary))
    if summary.rates:
        console.print(_rate_table(summary))


def progress_text(counts: Mapping[str, int], expected: int) -> str:
    """Return the number of stored variants: `7 of 10 variants: 6 done, 1 stopped`.

    `expected` is the number of all variants; without stored ones the list is `none yet`.
    """
    ended = ", ".join(f"{count} {name}" for name, count in counts.items())
    return f"{sum(counts.values())} of {expected} variants: {ended or 'none yet'}"


def failure_texts(summary: Summary) -> list[str]:
    """Return the MAX_FAILURES most frequent reasons of failure, and a line that counts the others.

    A line is `count status: message (variant n)`, with the first variant of that reason.
    """
    texts = [
        f"{one.count} {one.status}: {one.message} (variant {one.number})"
        for one in summary.failures[:MAX_FAILURES]
    ]
    rest = summary.failures[MAX_FAILURES:]
    if rest:
        others = "1 other reason" if len(rest) == 1 else f"{len(rest)} other reasons"
        texts.append(f"{sum(one.count for one in rest)} for {others}")
    return texts


def summary_json(summary: Summary) -> dict[str, Any]:
    """Return a summary as a dict for JSON; it has all failures, and numbers not finite are null."""
    return {
        **format_entry("summary"),
        "study": summary.study,
        "digest": summary.digest,
        "expected": summary.expected,
        "counts": dict(summary.counts),
        "failures": [asdict(failure) for failure in summary.failures],
        "confidence": summary.confidence,
        "measures": [nonfinite_to_none(asdict(line)) for line in summary.lines],
        "rates": [nonfinite_to_none(asdict(rate)) for rate in summary.rates],
    }


def _measure_table(summary: Summary) -> Table:
    """Return the table of measures."""
    groups = list(summary.lines[0].group)
    sure = f"{summary.confidence * 100:g} %"
    table = Table(
        *groups, "measure", escape("[unit]"), "n", "draws", "median", sure, "mean", sure, "sd",
        "p95", "min", "max", box=None, pad_edge=False, header_style="bold",
    )  # fmt: skip
    for line in summary.lines:
        table.add_row(
            *(escape(escape_invisible(line.group[name])) for name in groups), *_measure_cells(line)
        )
    return table


def _measure_cells(line: SummaryLine) -> list[str]:
    """Return the cells of a measure."""
    numbers = (line.mean, line.deviation, line.p95, line.low, line.high)
    mean, deviation, p95, low, high = (format_number(number) for number in numbers)
    return [
        line.measure, escape(display_unit(line.unit)), str(line.count), str(line.draws),
        format_number(line.median), interval_text(line.median_interval), mean,
        interval_text(line.mean_interval), deviation, p95, low, high,
    ]  # fmt: skip


def _rate_table(summary: Summary) -> Table:
    """Return the table of rates."""
    groups = list(summary.rates[0].group)
    sure = f"{summary.confidence * 100:g} % (Wilson)"
    table = Table(*groups, "rate", "hits", "of", "draws", "share", sure, box=None, pad_edge=False,
                  header_style="bold")  # fmt: skip
    for rate in summary.rates:
        table.add_row(
            *(escape(escape_invisible(rate.group[name])) for name in groups), *_rate_cells(rate)
        )
    return table


def _rate_cells(rate: Rate) -> list[str]:
    """Return the cells of a rate."""
    return [
        rate.measure,
        str(rate.hits),
        str(rate.count),
        str(rate.draws),
        format_number(rate.share),
        interval_text(rate.interval),
    ]


def interval_text(interval: tuple[float, float] | None) -> str:
    """Return the ends of an interval as `low .. high` with five digits; `-` for None."""
    return f"{format_number(interval[0])} .. {format_number(interval[1])}" if interval else "-"


def format_number(number: float) -> str:
    """Return a number with five significant digits; `-` for NaN."""
    return "-" if math.isnan(number) else f"{number:.5g}"
