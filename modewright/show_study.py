"""Show study: the summary of a study as tables and as plain data."""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from language.text import visible
from modewright.show import finite
from sweep.summary import Line, Rate, Summary


def print_summary(console: Console, summary: Summary) -> None:
    """Print how variants ended, the measures by group, and rates."""
    total = sum(summary.counts.values())
    ended = ", ".join(f"{count} {name}" for name, count in summary.counts.items())
    text = f"{summary.study}: {total} of {summary.expected} variants: {ended or 'none yet'}"
    console.print(visible(text), highlight=False, markup=False)
    if summary.lines:
        console.print(_lines(summary))
    if summary.rates:
        console.print(_rates(summary))


def summary_json(summary: Summary) -> dict[str, Any]:
    """Return a summary as plain data; what is not there is null."""
    return {
        "study": summary.study,
        "digest": summary.digest,
        "expected": summary.expected,
        "counts": dict(summary.counts),
        "confidence": summary.confidence,
        "measures": [finite(asdict(line)) for line in summary.lines],
        "rates": [finite(asdict(rate)) for rate in summary.rates],
    }


def _lines(summary: Summary) -> Table:
    groups = list(summary.lines[0].group)
    sure = f"{summary.confidence * 100:g} %"
    table = Table(
        *groups, "measure", escape("[unit]"), "n", "median", sure, "mean", sure, "sd", "p95",
        "min", "max", box=None, pad_edge=False, header_style="bold",
    )  # fmt: skip
    for line in summary.lines:
        table.add_row(*(escape(visible(line.group[name])) for name in groups), *_cells(line))
    return table


def _cells(line: Line) -> list[str]:
    numbers = (line.mean, line.deviation, line.p95, line.low, line.high)
    mean, deviation, p95, low, high = (short(number) for number in numbers)
    return [
        line.measure, escape(line.unit), str(line.count), short(line.median),
        interval_text(line.median_interval), mean, interval_text(line.mean_interval), deviation,
        p95, low, high,
    ]  # fmt: skip


def _rates(summary: Summary) -> Table:
    groups = list(summary.rates[0].group)
    sure = f"{summary.confidence * 100:g} % (Wilson)"
    table = Table(*groups, "rate", "hits", "of", "share", sure, box=None, pad_edge=False,
                  header_style="bold")  # fmt: skip
    for rate in summary.rates:
        table.add_row(*(escape(visible(rate.group[name])) for name in groups), *_rate_cells(rate))
    return table


def _rate_cells(rate: Rate) -> list[str]:
    share = rate.hits / rate.count if rate.count else math.nan
    return [
        rate.measure,
        str(rate.hits),
        str(rate.count),
        short(share),
        interval_text(rate.interval),
    ]


def interval_text(interval: tuple[float, float] | None) -> str:
    """Return the ends of an interval as text."""
    return f"{short(interval[0])} .. {short(interval[1])}" if interval else "-"


def short(number: float) -> str:
    """Return a number to five digits; what is not there as a dash."""
    return "-" if math.isnan(number) else f"{number:.5g}"
