"""Metrics output: show memory and instructions of generated C as table, page and JSON."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from typing import Any

from rich.table import Table

from codegen.harness.instruction_count import InstructionCounts
from codegen.harness.metrics import Metrics
from modewright.runtime.json_format import format_entry

AutomatonMetrics = tuple[Metrics, InstructionCounts | None]
"""The metrics of an automaton, with instruction counts if they were measured."""
HEADS = (
    *("automaton", "ROM", "code", "constants", "page", "RAM", "data", "stack", "instructions"),
    "at most",
)
ABOUT = (
    "Bytes on a Cortex-M4F, -O2. ROM: code, constants and the default calibration page. RAM: one "
    "instance; data: static data. Stack: the largest stack of a step including its calls. "
    "Instructions of a step: mean, minimum and maximum of the counted steps; at most: the bound "
    "from the machine code, with all iterations of loops and the longer side of each branch."
)
"""The explanation on the page."""
STYLE = """body{font:14px/1.45 system-ui,sans-serif;margin:2rem;color:#222;max-width:60rem}
table{border-collapse:collapse}
th,td{padding:.35rem .7rem;border-bottom:1px solid #ddd;text-align:right}
th:first-child,td:first-child{text-align:left}svg{display:block;margin:.3rem 0 1.2rem}
@media(prefers-color-scheme:dark){body{background:#161616;color:#ddd}td,th{border-color:#444}}"""
WIDTH, HEIGHT = 900, 90
"""Size of the figure of instructions over steps [px]."""


def metrics_table(automata: Sequence[AutomatonMetrics]) -> Table:
    """Return the metrics as a table with a row for each automaton and the columns HEADS.

    Instructions are `not counted` without counts, the bound is `no bound` if there is none.
    """
    table = Table(*HEADS, box=None, pad_edge=False, header_style="bold")
    for measured in automata:
        table.add_row(*_row(measured))
    return table


def metrics_json(automata: Sequence[AutomatonMetrics]) -> dict[str, Any]:
    """Return the fields of the metrics of each automaton as a dict for JSON.

    `instructions` are the counts of all steps, or None.
    """
    return {
        **format_entry("metrics"),
        "target": "cortex-m4f",
        "automata": [
            {
                **vars(metrics),
                "beside": list(metrics.beside),
                "rom": metrics.rom,
                "instructions": counts and list(counts.steps),
            }
            for metrics, counts in automata
        ],
    }


def metrics_html(automata: Sequence[AutomatonMetrics]) -> str:
    """Return a self-contained page with the table and the reasons for missing bounds.

    Automata with instruction counts have a figure of the instructions of each step.
    """
    heads = "".join(f"<th>{escape(head)}</th>" for head in HEADS)
    rows = "".join(
        "<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in _row(measured)) + "</tr>\n"
        for measured in automata
    )
    reasons = "".join(f"<p>{escape(line)}</p>\n" for line in unbounded_lines(automata))
    pictures = "".join(_instructions_svg(metrics, counts) for metrics, counts in automata if counts)
    return (
        f"<!doctype html><meta charset=utf-8><title>metrics</title><style>{STYLE}</style>\n"
        f"<h1>Resources of generated C</h1><p>{escape(ABOUT)}</p>\n"
        f"<table><tr>{heads}</tr>\n{rows}</table>\n{reasons}{pictures}"
    )


def _row(measured: AutomatonMetrics) -> tuple[str, ...]:
    """Return the cells of an automaton."""
    metrics, counts = measured
    stack = f"{metrics.stack}{' and more' if metrics.beside else ''}"
    sizes = (metrics.rom, metrics.code, metrics.constants, metrics.page)
    ram = (metrics.instance, metrics.data)
    numbers = (str(size) for size in (*sizes, *ram))
    most = "no bound" if metrics.longest is None else str(metrics.longest)
    return metrics.name, *numbers, stack, str(counts) if counts else "not counted", most


def unbounded_lines(automata: Sequence[AutomatonMetrics]) -> list[str]:
    """Return the reason for each automaton without a bound on the instructions of a step.

    A line is `name: no bound of a step: reason`; empty if all have a bound.
    """
    unbounded = [metrics for metrics, _ in automata if metrics.longest is None]
    return [f"{one.name}: no bound of a step: {one.unbounded}" for one in unbounded]


def _instructions_svg(metrics: Metrics, counts: InstructionCounts) -> str:
    """Return a figure of the instructions over the steps: minimum and maximum in each pixel."""
    steps, most = counts.steps, max(counts.steps, default=0) or 1
    wide = max(1, -(-len(steps) // WIDTH))
    lines = []
    for x, start in enumerate(range(0, len(steps), wide)):
        part = steps[start : start + wide]
        high, low = (HEIGHT * (1 - value / most) for value in (max(part), min(part)))
        lines.append(f"M{x} {low + 0.5:.1f}V{high:.1f}")
    title = escape(f"{metrics.name}: instructions of {len(steps)} steps, {counts}")
    return (
        f"<h2>{title}</h2>"
        f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" width="{WIDTH}" height="{HEIGHT}">'
        f'<path d="{"".join(lines)}" stroke="#2a6fb0" fill="none"/></svg>\n'
    )
