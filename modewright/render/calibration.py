"""Calibration output: print calibration pages, imports and recomputed numbers."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from rich.console import Console
from rich.markup import escape

from codegen.exchange.calibration.calibration_page import format_constant_value, page_name
from codegen.exchange.calibration.value_conversion import Remark
from language.expressions.units import display_unit
from language.ir.program import Constant, unqualified_name
from language.text.diagnostic import Problem, render_all
from language.text.sanitise import escape_invisible
from modewright.api.calibrations import CalibrationPage, ImportedPage, ResolvedPage, SolvedChange
from modewright.api.spec_check import problem_json
from modewright.render.pluralisation import pluralise
from modewright.runtime.json_format import format_entry

MAX_SHOWN = 12
"""Largest number of remarks of a kind, and of changes, that are printed; --json has all."""


def print_page(screen: Console, page: CalibrationPage) -> None:
    """Print each tunable parameter with value and unit, and the numbers of both kinds.

    A table is printed with the number of its values only; solved numbers are counted only.
    """
    for constant in page.tunable:
        screen.print(_constant_line(page, constant), highlight=False, markup=False, soft_wrap=True)
    solved = pluralise(len(page.solved), "solved number")
    screen.print(
        f"{pluralise(len(page.tunable), 'tunable parameter')}, {solved}",
        highlight=False,
        soft_wrap=True,
    )


def print_import(screen: Console, imported: ImportedPage) -> None:
    """Print warnings, the imported values, remarks, stale solved numbers and the number of values.

    At most MAX_SHOWN warnings and remarks of each kind are printed; of the stale numbers the count
    and the largest change.
    """
    _print_warnings(screen, imported.warnings)
    for name, text in imported.values.items():
        screen.print(f"{name} = {text}", highlight=False, markup=False, soft_wrap=True)
    _print_remarks(screen, imported.remarks)
    if imported.stale:
        worst = _largest_change(imported.stale)
        screen.print(
            f"[yellow]stale[/]: {_count_of_solved(imported.stale, imported.page)} "
            "of the file were solved for "
            f"other values, the farthest {escape(worst.name)} by {worst.relative:.2g}; "
            "`modewright calibration resolve` solves them anew",
            highlight=False,
        )
    screen.print(
        f"{pluralise(len(imported.values), 'value')} taken", highlight=False, soft_wrap=True
    )


def print_resolved(screen: Console, resolved: ResolvedPage) -> None:
    """Print warnings, the page, remarks and the changed solved numbers, the largest change first.

    Of warnings, changes and remarks of each kind at most MAX_SHOWN are printed. Added solved
    numbers are counted only.
    """
    _print_warnings(screen, resolved.warnings)
    print_page(screen, resolved.page)
    _print_remarks(screen, resolved.remarks)
    if resolved.added:
        screen.print(
            f"{pluralise(len(resolved.added), 'solved number')} added",
            highlight=False,
            soft_wrap=True,
        )
    if not resolved.changes:
        screen.print("no solved number changed", highlight=False, soft_wrap=True)
        return
    worst = _largest_change(resolved.changes)
    screen.print(
        f"{_count_of_solved(resolved.changes, resolved.page)} changed, "
        f"the farthest {escape(worst.name)} by {worst.relative:.2g} of its size",
        highlight=False,
        soft_wrap=True,
    )
    ranked = sorted(resolved.changes, key=lambda change: -change.relative)
    for change in ranked[:MAX_SHOWN]:
        line = f"  {change.name}: {change.before:.6g} -> {change.after:.6g}, {change.relative:.2g}"
        screen.print(line, highlight=False, markup=False, soft_wrap=True)
    if len(ranked) > MAX_SHOWN:
        screen.print(f"  ... and {len(ranked) - MAX_SHOWN} more", highlight=False, soft_wrap=True)


def page_json(page: CalibrationPage) -> dict[str, Any]:
    """Return a page as a dict for JSON, with values in SI.

    The keys are automaton, numbers (the number type), tunable (value and unit) and solved (value).
    A value is a number, the word of an enumeration, or the list of a table.
    """
    return {
        **format_entry("calibration"),
        "automaton": page.program.name,
        "numbers": page.program.number_type,
        "tunable": {
            page_name(page.program, c): {
                "value": _constant_value(c),
                "unit": display_unit(c.unit),
            }
            for c in page.tunable
        },
        "solved": {page_name(page.program, c): c.value for c in page.solved},
    }


def import_json(imported: ImportedPage) -> dict[str, Any]:
    """Return an import as a dict for JSON.

    The keys are automaton, values (literals with unit), remarks, stale (changes of solved numbers)
    and problems (warnings).
    """
    return {
        **format_entry("calibration-import"),
        "automaton": imported.page.program.name,
        "values": dict(imported.values),
        "remarks": _remarks_json(imported.remarks),
        "stale": _changes_json(imported.stale),
        "problems": [problem_json(problem) for problem in imported.warnings],
    }


def resolved_json(resolved: ResolvedPage) -> dict[str, Any]:
    """Return a recomputed page as a dict for JSON.

    It has the keys of `page_json`, and changed, added, remarks and problems.
    """
    return {
        **page_json(resolved.page),
        **format_entry("calibration-resolution"),
        "changed": _changes_json(resolved.changes),
        "added": list(resolved.added),
        "remarks": _remarks_json(resolved.remarks),
        "problems": [problem_json(problem) for problem in resolved.warnings],
    }


def _changes_json(changes: Sequence[SolvedChange]) -> dict[str, Any]:
    """Return changes as a dict for JSON."""
    return {
        "count": len(changes),
        "largest_relative": _largest_change(changes).relative if changes else 0.0,
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
    """Return remarks as a list for JSON."""
    return [
        {
            "kind": remark.kind,
            "name": remark.name,
            "text": remark.text,
            "line": remark.span.line if remark.span else None,
        }
        for remark in remarks
    ]


def _constant_value(constant: Constant) -> Any:
    """Return the value of a parameter: number, word, or list of a table."""
    if constant.items:
        return list(constant.items)
    return constant.values[int(constant.value)] if constant.values else constant.value


def _constant_line(page: CalibrationPage, constant: Constant) -> str:
    """Return a parameter with its value, or the size of a table."""
    if constant.items:
        return f"{unqualified_name(constant.name)}: a table of {len(constant.items)} values"
    text = format_constant_value(constant.value, constant, page.program.number_type)
    unit = display_unit(constant.unit) if constant.type == "real" else "1"
    return f"{unqualified_name(constant.name)} = {text}" + ("" if unit == "1" else f" {unit}")


def _print_remarks(screen: Console, remarks: Sequence[Remark]) -> None:
    """Print remarks by kind, at most MAX_SHOWN of each."""
    for kind in dict.fromkeys(remark.kind for remark in remarks):
        mine = [remark for remark in remarks if remark.kind == kind]
        for remark in mine[:MAX_SHOWN]:
            where = escape(escape_invisible(f"{remark.span}: ")) if remark.span else ""
            text = escape(escape_invisible(f"{remark.name} {remark.text}"))
            line = f"{where}[yellow]{kind}[/]: {text}"
            screen.print(line, highlight=False, soft_wrap=True)
        if len(mine) > MAX_SHOWN:
            screen.print(
                f"... and {len(mine) - MAX_SHOWN} more {kind}", highlight=False, soft_wrap=True
            )


def _print_warnings(screen: Console, problems: Sequence[Problem]) -> None:
    """Print warnings, at most MAX_SHOWN."""
    if problems:
        text = render_all(problems[:MAX_SHOWN])
        screen.print(text, highlight=False, markup=False, soft_wrap=True)
    if len(problems) > MAX_SHOWN:
        screen.print(f"... and {len(problems) - MAX_SHOWN} more", highlight=False, soft_wrap=True)


def _count_of_solved(changes: Sequence[SolvedChange], page: CalibrationPage) -> str:
    """Return `n of m solved numbers`."""
    return f"{len(changes)} of {pluralise(len(page.solved), 'solved number')}"


def _largest_change(changes: Sequence[SolvedChange]) -> SolvedChange:
    """Return the change with the largest relative size."""
    return max(changes, key=lambda change: change.relative)
