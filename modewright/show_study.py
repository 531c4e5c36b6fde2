"""Show study: the summary of a study as tables and as plain data."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from language.text import visible
from language.units import shown_unit
from modewright.show import finite
from sweep.summary import Line, Rate, Summary

MOST_FAILURES = 5
"""Reasons that are told; `--json` and the store have all."""


def print_summary(console: Console, summary: Summary) -> None:
    """Print how variants ended, and why they did otherwise; the measures by group, and rates."""
    text = f"{summary.study}: {progress_text(summary.counts, summary.expected)}"
    console.print(visible(text), highlight=False, markup=False)
    for text in failure_texts(summary):
        console.print(f"  {visible(text)}", highlight=False, markup=False)
    if summary.lines:
        console.print(_lines(summary))
    if summary.rates:
        console.print(_rates(summary))


def progress_text(counts: Mapping[str, int], expected: int) -> str:
    """Return how many variants are there, and how they ended."""
    ended = ", ".join(f"{count} {name}" for name, count in counts.items())
    return f"{sum(counts.values())} of {expected} variants: {ended or 'none yet'}"


def failure_texts(summary: Summary) -> list[str]:
    """Return the most frequent reasons why variants are not done, each with one of its variants."""
    found = [
        f"{one.count} {one.status}: {one.message} (variant {one.number})"
        for one in summary.failures[:MOST_FAILURES]
    ]
    rest = summary.failures[MOST_FAILURES:]
    if rest:
        others = "1 other reason" if len(rest) == 1 else f"{len(rest)} other reasons"
        found.append(f"{sum(one.count for one in rest)} for {others}")
    return found


def summary_json(summary: Summary) -> dict[str, Any]:
    """Return a summary as plain data; what is not there is null."""
    return {
        "study": summary.study,
        "digest": summary.digest,
        "expected": summary.expected,
        "counts": dict(summary.counts),
        "failures": [asdict(failure) for failure in summary.failures],
        "confidence": summary.confidence,
        "measures": [finite(asdict(line)) for line in summary.lines],
        "rates": [finite(asdict(rate)) for rate in summary.rates],
    }


def _lines(summary: Summary) -> Table:
    groups = list(summary.lines[0].group)
    sure = f"{summary.confidence * 100:g} %"
    table = Table(
        *groups, "measure", escape("[unit]"), "n", "draws", "median", sure, "mean", sure, "sd",
        "p95", "min", "max", box=None, pad_edge=False, header_style="bold",
    )  # fmt: skip
    for line in summary.lines:
        table.add_row(*(escape(visible(line.group[name])) for name in groups), *_cells(line))
    return table


def _cells(line: Line) -> list[str]:
    numbers = (line.mean, line.deviation, line.p95, line.low, line.high)
    mean, deviation, p95, low, high = (short(number) for number in numbers)
    return [
        line.measure, escape(shown_unit(line.unit)), str(line.count), str(line.draws),
        short(line.median), interval_text(line.median_interval), mean,
        interval_text(line.mean_interval), deviation, p95, low, high,
    ]  # fmt: skip


def _rates(summary: Summary) -> Table:
    groups = list(summary.rates[0].group)
    sure = f"{summary.confidence * 100:g} % (Wilson)"
    table = Table(*groups, "rate", "hits", "of", "draws", "share", sure, box=None, pad_edge=False,
                  header_style="bold")  # fmt: skip
    for rate in summary.rates:
        table.add_row(*(escape(visible(rate.group[name])) for name in groups), *_rate_cells(rate))
    return table


def _rate_cells(rate: Rate) -> list[str]:
    return [
        rate.measure,
        str(rate.hits),
        str(rate.count),
        str(rate.draws),
        short(rate.share),
        interval_text(rate.interval),
    ]


def interval_text(interval: tuple[float, float] | None) -> str:
    """Return the ends of an interval as text."""
    return f"{short(interval[0])} .. {short(interval[1])}" if interval else "-"


def short(number: float) -> str:
    """Return a number to five digits; what is not there as a dash."""
    return "-" if math.isnan(number) else f"{number:.5g}"
