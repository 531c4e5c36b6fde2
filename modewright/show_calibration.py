"""Show calibration: what was written to, taken from, or solved for a calibration page."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from rich.console import Console
from rich.markup import escape

from codegen.exchange.desk import Remark
from codegen.exchange.page import page_name, value_text
from language.problem import Problem, render_all
from language.program import Constant, short
from language.text import visible
from language.units import shown_unit
from modewright.calibrations import CalibrationPage, Change, ImportedPage, ResolvedPage
from modewright.checking import problem_json
from modewright.console import counted

MOST_SHOWN = 12
"""Most remarks of a kind and changes shown to a person; all of them are in --json."""


def print_page(screen: Console, page: CalibrationPage) -> None:
    """Print the tunable parameters of a page, and how many numbers were solved."""
    for constant in page.tunable:
        screen.print(_line(page, constant), highlight=False, markup=False, soft_wrap=True)
    solved = counted(len(page.solved), "solved number")
    screen.print(
        f"{counted(len(page.tunable), 'tunable parameter')}, {solved}",
        highlight=False,
        soft_wrap=True,
    )


def print_import(screen: Console, found: ImportedPage) -> None:
    """Print the values that were taken and what is to be known of them."""
    _print_warnings(screen, found.warnings)
    for name, text in found.values.items():
        screen.print(f"{name} = {text}", highlight=False, markup=False, soft_wrap=True)
    _print_remarks(screen, found.remarks)
    if found.stale:
        worst = _worst(found.stale)
        screen.print(
            f"[yellow]stale[/]: {_of_all(found.stale, found.page)} of the file were solved for "
            f"other values, the farthest {escape(worst.name)} by {worst.relative:.2g}; "
            "`modewright calibration resolve` solves them anew",
            highlight=False,
        )
    screen.print(f"{counted(len(found.values), 'value')} taken", highlight=False, soft_wrap=True)


def print_resolved(screen: Console, found: ResolvedPage) -> None:
    """Print which solved numbers changed, the farthest first, and by how much."""
    _print_warnings(screen, found.warnings)
    print_page(screen, found.page)
    _print_remarks(screen, found.remarks)
    if found.added:
        screen.print(
            f"{counted(len(found.added), 'solved number')} added", highlight=False, soft_wrap=True
        )
    if not found.changes:
        screen.print("no solved number changed", highlight=False, soft_wrap=True)
        return
    worst = _worst(found.changes)
    screen.print(
        f"{_of_all(found.changes, found.page)} changed, the farthest {escape(worst.name)} "
        f"by {worst.relative:.2g} of its size",
        highlight=False,
        soft_wrap=True,
    )
    ranked = sorted(found.changes, key=lambda change: -change.relative)
    for change in ranked[:MOST_SHOWN]:
        line = f"  {change.name}: {change.before:.6g} -> {change.after:.6g}, {change.relative:.2g}"
        screen.print(line, highlight=False, markup=False, soft_wrap=True)
    if len(ranked) > MOST_SHOWN:
        screen.print(f"  ... and {len(ranked) - MOST_SHOWN} more", highlight=False, soft_wrap=True)


def page_json(page: CalibrationPage) -> dict[str, Any]:
    """Return a page as JSON, values in SI."""
    return {
        "automaton": page.program.name,
        "numbers": page.program.number,
        "tunable": {
            page_name(page.program, c): {"value": _value(page, c), "unit": shown_unit(c.unit)}
            for c in page.tunable
        },
        "solved": {page_name(page.program, c): c.value for c in page.solved},
    }


def import_json(found: ImportedPage) -> dict[str, Any]:
    """Return what was taken as JSON."""
    return {
        "automaton": found.page.program.name,
        "values": dict(found.values),
        "remarks": _remarks_json(found.remarks),
        "stale": _changes_json(found.stale),
        "problems": [problem_json(problem) for problem in found.warnings],
    }


def resolved_json(found: ResolvedPage) -> dict[str, Any]:
    """Return a page solved anew as JSON, with what changed."""
    return {
        **page_json(found.page),
        "changed": _changes_json(found.changes),
        "added": list(found.added),
        "remarks": _remarks_json(found.remarks),
        "problems": [problem_json(problem) for problem in found.warnings],
    }


def _changes_json(changes: Sequence[Change]) -> dict[str, Any]:
    return {
        "count": len(changes),
        "largest_relative": _worst(changes).relative if changes else 0.0,
        "numbers": [
            {
                "name": change.name,
                "before": change.before,
                "after": change.after,
                "relative": change.relative,
            }
            for change in changes
        ],
    }


def _remarks_json(remarks: Sequence[Remark]) -> list[dict[str, Any]]:
    return [
        {
            "kind": remark.kind,
            "name": remark.name,
            "text": remark.text,
            "line": remark.span.line if remark.span else None,
        }
        for remark in remarks
    ]


def _value(page: CalibrationPage, constant: Constant) -> Any:
    if constant.items:
        return list(constant.items)
    return constant.values[int(constant.value)] if constant.values else constant.value


def _line(page: CalibrationPage, constant: Constant) -> str:
    """A parameter with its value; of a table how many there are."""
    if constant.items:
        return f"{short(constant.name)}: a table of {len(constant.items)} values"
    text = value_text(constant.value, constant, page.program.number)
    unit = shown_unit(constant.unit) if constant.type == "real" else "1"
    return f"{short(constant.name)} = {text}" + ("" if unit == "1" else f" {unit}")


def _print_remarks(screen: Console, remarks: Sequence[Remark]) -> None:
    """Print remarks by kind; of many of one kind the first ones."""
    for kind in dict.fromkeys(remark.kind for remark in remarks):
        mine = [remark for remark in remarks if remark.kind == kind]
        for remark in mine[:MOST_SHOWN]:
            where = escape(visible(f"{remark.span}: ")) if remark.span else ""
            told = escape(visible(f"{remark.name} {remark.text}"))
            line = f"{where}[yellow]{kind}[/]: {told}"
            screen.print(line, highlight=False, soft_wrap=True)
        if len(mine) > MOST_SHOWN:
            screen.print(
                f"... and {len(mine) - MOST_SHOWN} more {kind}", highlight=False, soft_wrap=True
            )


def _print_warnings(screen: Console, problems: Sequence[Problem]) -> None:
    if problems:
        text = render_all(problems[:MOST_SHOWN])
        screen.print(text, highlight=False, markup=False, soft_wrap=True)
    if len(problems) > MOST_SHOWN:
        screen.print(f"... and {len(problems) - MOST_SHOWN} more", highlight=False, soft_wrap=True)


def _of_all(changes: Sequence[Change], page: CalibrationPage) -> str:
    return f"{len(changes)} of {counted(len(page.solved), 'solved number')}"


def _worst(changes: Sequence[Change]) -> Change:
    return max(changes, key=lambda change: change.relative)
