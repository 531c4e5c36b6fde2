"""Show sensitivity: indices as a table and as plain data."""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from language.text import visible
from modewright.show import finite
from modewright.show_study import interval_text, progress_text, short
from sweep.sensitivity import FEWEST, Index, Sensitivity

WHOLE = {"saltelli": "blocks", "morris": "paths"}


def print_sensitivity(console: Console, found: Sensitivity) -> None:
    """Print the indices by group and measure, the largest first."""
    text = f"{found.study}: {found.method}; {progress_text(found.counts, found.expected)}"
    console.print(visible(text), highlight=False, markup=False)
    if sum(found.counts.values()) < found.expected:
        text = "unfinished: the same `modewright sweep STUDY --out DIR` goes on"
        console.print(text, highlight=False, markup=False)
    if not found.indices:
        return
    first = found.indices[0]
    sure = f"{found.confidence * 100:g} %"
    values = [head for name in first.values for head in (name, sure)]
    table = Table(
        *first.group, "measure", "of", *values, WHOLE[found.method], box=None, pad_edge=False,
        header_style="bold",
    )  # fmt: skip
    for one in ordered_indices(found):
        groups = (escape(visible(name)) for name in one.group.values())
        table.add_row(*groups, one.measure, escape(one.name), *_cells(one))
    console.print(table)
    for text in untold_texts(found):
        console.print(text, highlight=False, markup=False)


def untold_texts(found: Sensitivity) -> list[str]:
    """Return a note where some indices are not told, for want of complete blocks or paths."""
    few = sum(one.used < FEWEST for one in found.indices)
    whole = WHOLE[found.method]
    hint = f"fewer than {FEWEST} {whole} are complete (every point done and with the measure)"
    return [f"{few} of {len(found.indices)} indices are not told (-): {hint}"] if few else []


def ordered_indices(found: Sensitivity) -> list[Index]:
    """Return the indices with the largest of each measure first."""
    key = "total" if found.method == "saltelli" else "mu_star"
    places: dict[object, int] = {}
    for one in found.indices:
        places.setdefault((*one.group.values(), one.measure), len(places))
    return sorted(
        found.indices,
        key=lambda one: (
            places[(*one.group.values(), one.measure)],
            math.inf if math.isnan(one.values[key]) else -one.values[key],
        ),
    )


def sensitivity_json(found: Sensitivity) -> dict[str, Any]:
    """Return the indices as plain data; what is not there is null."""
    return {
        "study": found.study,
        "digest": found.digest,
        "expected": found.expected,
        "counts": dict(found.counts),
        "method": found.method,
        "fewest": FEWEST,
        "confidence": found.confidence,
        "indices": [
            {**asdict(one), "values": finite(one.values), "intervals": _plain(one)}
            for one in found.indices
        ],
    }


def _plain(one: Index) -> dict[str, Any]:
    return {
        name: list(finite({"from": pair[0], "to": pair[1]}).values()) if pair else None
        for name, pair in one.intervals.items()
    }


def _cells(one: Index) -> list[str]:
    found = []
    for name, value in one.values.items():
        found += [short(value), interval_text(one.intervals[name])]
    return [*found, f"{one.used} of {one.count}"]
