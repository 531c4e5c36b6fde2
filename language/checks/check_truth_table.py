"""Check of truth tables: complete and disjoint rows, one table for each variable."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations

from language.model.automaton import Automaton
from language.model.declaration import Formula
from language.model.truth_table import TruthRow, TruthTable
from language.text.diagnostic import Problems
from language.typecheck.infer import TypeChecker

MARK_TEXT = {True: "T", False: "F", None: "-"}
"""Text of a required condition value; `-` accepts both."""


def check_truth_tables(automaton: Automaton, check: TypeChecker, problems: Problems) -> None:
    """Report truth tables with wrong types, shared variables, or missing or overlapping rows.

    No two tables may assign one variable. Exactly one row must hold for each combination of the
    conditions, `else` aside; an `else` that never holds gives a warning. Rows of a table with wrong
    marks are not examined. Tables of a continuous automaton are an error.
    """
    if automaton.tables and not automaton.is_sampled:
        label = "`tables` belongs to a sampled automaton"
        hint = "an equation holds at every time: `permit: ready and isolated`"
        problems.error("form", automaton.tables[0].span, label, hint)
    writers: dict[str, str] = {}
    for table in automaton.tables:
        for formula in table.conditions.values():
            check.check_condition(formula.tree, "if")
        for name, formula in _row_assignments(table):
            kind = check.environment.types.get(name)
            if kind is not None:
                check.check_assignment(formula.tree, kind, name)
        for name in table.assigned_names:
            if name in writers:
                label = f"`{name}` is written by the tables `{writers[name]}` and `{table.name}`"
                problems.error("writer", table.span, label)
            writers[name] = table.name
        _check_rows(table, problems)


def _row_assignments(table: TruthTable) -> Iterator[tuple[str, Formula]]:
    """Yield the assigned names and formulas of all rows."""
    for row in table.rows:
        yield from row.assignments.items()


def _check_rows(table: TruthTable, problems: Problems) -> None:
    """Report overlapping rows and combinations of conditions without a row.

    An `else` row that never holds gives a warning. A table with an unreadable row is skipped.
    """
    if any(not row.marks for row in table.rows):
        return  # the reader has reported it
    rows = [row for row in table.rows if not row.is_else]
    for earlier, later in combinations(rows, 2):
        both = _row_overlap(earlier, later)
        if both is not None:
            label = (
                f"`{later.name}` and `{earlier.name}` both hold at {_describe_marks(table, both)}"
            )
            problems.error("overlap", later.span, label, "change a `-`: exactly one row holds")
    open_row = _find_uncovered(rows, (), len(table.conditions))
    rest = next((row for row in table.rows if row.is_else), None)
    if rest:
        if open_row is None:
            label = f"`{rest.name}` never holds: there is a row for every case"
            problems.warning("dead", rest.span, label, "remove it")
    elif open_row is not None and table.rows:
        label = f"no row of `{table.name}` holds at {_describe_marks(table, open_row)}"
        hint = f'add a row for it: `"{_format_marks(open_row)}": {{...}}`'
        problems.error("incomplete", table.span, label, hint)


def _row_overlap(earlier: TruthRow, later: TruthRow) -> tuple[bool | None, ...] | None:
    """Return marks at which two rows both hold; None if they are disjoint."""
    pairs = tuple(zip(earlier.marks, later.marks, strict=True))
    if any(None not in pair and pair[0] != pair[1] for pair in pairs):
        return None
    return tuple(left if right is None else right for left, right in pairs)


def _find_uncovered(
    rows: Sequence[TruthRow], before: tuple[bool | None, ...], width: int
) -> tuple[bool | None, ...] | None:
    """Return condition values that no row covers; None if the rows are complete.

    `before` has the values of the first conditions, and `rows` agree with them. `width` is the
    number of conditions. A value of None means that the condition does not matter.
    """
    position = len(before)
    if not rows:
        return before + (None,) * (width - position)
    if any(all(mark is None for mark in row.marks[position:]) for row in rows):
        return None
    if all(row.marks[position] is None for row in rows):
        return _find_uncovered(rows, (*before, None), width)
    for value in (True, False):
        fitting = [row for row in rows if row.marks[position] in (value, None)]
        uncovered = _find_uncovered(fitting, (*before, value), width)
        if uncovered is not None:
            return uncovered
    return None


def _format_marks(marks: Sequence[bool | None]) -> str:
    """Return marks as text: `T F -`."""
    return " ".join(MARK_TEXT[mark] for mark in marks)


def _describe_marks(table: TruthTable, marks: Sequence[bool | None]) -> str:
    """Return marks as text and in words: `T F -` (ready and not isolated)."""
    words = [
        name if mark else f"not {name}"
        for name, mark in zip(table.conditions, marks, strict=True)
        if mark is not None
    ]
    return (
        f"`{_format_marks(marks)}` ({' and '.join(words)})"
        if words
        else f"`{_format_marks(marks)}`"
    )
