"""Sensitivity output: print sensitivity indices."""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from language.text.sanitise import escape_invisible
from modewright.render.run import nonfinite_to_none
from modewright.render.study import format_number, interval_text, progress_text
from modewright.runtime.json_format import format_entry
from sweep.analysis.sensitivity import MIN_COMPLETE, Index, Sensitivity

DESIGN_UNITS = {"saltelli": "blocks", "morris": "paths"}
"""The units of each design."""


def print_sensitivity(console: Console, sensitivity: Sensitivity) -> None:
    """Print the indices in the order of `sort_indices` with their confidence intervals.

    Before them are the progress and a hint if variants are missing, after them the notes about
    missing indices. Without indices there is no table.
    """
    progress = progress_text(sensitivity.counts, sensitivity.expected)
    text = f"{sensitivity.study}: {sensitivity.method}; {progress}"
    console.print(escape_invisible(text), highlight=False, markup=False)
    if sum(sensitivity.counts.values()) < sensitivity.expected:
        text = "unfinished: the same `modewright sweep STUDY --out DIR` goes on"
        console.print(text, highlight=False, markup=False)
    if not sensitivity.indices:
        return
    first = sensitivity.indices[0]
    sure = f"{sensitivity.confidence * 100:g} %"
    values = [head for name in first.values for head in (name, sure)]
    unit = DESIGN_UNITS[sensitivity.method]
    table = Table(
        *first.group, "measure", "of", *values, unit,
        box=None, pad_edge=False, header_style="bold",
    )  # fmt: skip
    for one in sort_indices(sensitivity):
        groups = (escape(escape_invisible(name)) for name in one.group.values())
        table.add_row(*groups, one.measure, escape(one.name), *_cells(one))
    console.print(table)
    for text in incomplete_index_notes(sensitivity):
        console.print(text, highlight=False, markup=False)


def incomplete_index_notes(sensitivity: Sensitivity) -> list[str]:
    """Return one note about missing indices, or an empty list.

    An index is missing if fewer than MIN_COMPLETE blocks (saltelli) or paths (morris) are complete.
    """
    few = sum(one.used < MIN_COMPLETE for one in sensitivity.indices)
    whole = DESIGN_UNITS[sensitivity.method]
    hint = f"fewer than {MIN_COMPLETE} {whole} are complete (every point done and with the measure)"
    return [f"{few} of {len(sensitivity.indices)} indices are missing (-): {hint}"] if few else []


def sort_indices(sensitivity: Sensitivity) -> list[Index]:
    """Return the indices by group and measure, the largest first and NaN last.

    Groups and measures keep their order; the key is `total` for saltelli and `mu_star` for morris.
    """
    key = "total" if sensitivity.method == "saltelli" else "mu_star"
    places: dict[object, int] = {}
    for one in sensitivity.indices:
        places.setdefault((*one.group.values(), one.measure), len(places))
    return sorted(
        sensitivity.indices,
        key=lambda one: (
            places[(*one.group.values(), one.measure)],
            math.inf if math.isnan(one.values[key]) else -one.values[key],
        ),
    )


def sensitivity_json(sensitivity: Sensitivity) -> dict[str, Any]:
    """Return the indices in their stored order as a dict for JSON.

    Numbers that are not finite and missing intervals are null.
    """
    return {
        **format_entry("sensitivity"),
        "study": sensitivity.study,
        "digest": sensitivity.digest,
        "expected": sensitivity.expected,
        "counts": dict(sensitivity.counts),
        "method": sensitivity.method,
        "fewest": MIN_COMPLETE,
        "confidence": sensitivity.confidence,
        "indices": [
            {
                **asdict(one),
                "values": nonfinite_to_none(one.values),
                "intervals": _intervals_json(one),
            }
            for one in sensitivity.indices
        ],
    }


def _intervals_json(index: Index) -> dict[str, Any]:
    """Return the intervals of an index by name."""
    return {
        name: list(nonfinite_to_none({"from": pair[0], "to": pair[1]}).values()) if pair else None
        for name, pair in index.intervals.items()
    }


def _cells(index: Index) -> list[str]:
    """Return the cells of an index."""
    found = []
    for name, value in index.values.items():
        found += [format_number(value), interval_text(index.intervals[name])]
    return [*found, f"{index.used} of {index.count}"]
