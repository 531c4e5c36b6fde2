"""Truth table: data classes of a table of conditions and rows of which exactly one applies."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from language.model.declaration import Formula
from language.text.diagnostic import Span


@dataclass(frozen=True)
class TruthRow:
    """A row of a truth table: the required value of each condition, and the assignments of the row.

    A mark None stands for either value. A row without marks had an error that was reported.
    `is_else` marks the row `else`, which applies if no other row does.
    """

    name: str
    marks: tuple[bool | None, ...]
    assignments: Mapping[str, Formula]
    span: Span
    is_else: bool = False


@dataclass(frozen=True)
class TruthTable:
    """Conditions by name, and rows of which exactly one applies.

    The module language/lowering/truth_tables.py translates it.
    """

    name: str
    conditions: Mapping[str, Formula]
    rows: tuple[TruthRow, ...]
    key: str
    span: Span

    @property
    def assigned_names(self) -> tuple[str, ...]:
        """The variables that at least one row assigns, each once, in order of first occurrence."""
        return tuple(dict.fromkeys(name for row in self.rows for name in row.assignments))


def truth_table_formulas(tables: Iterable[TruthTable]) -> list[Formula]:
    """Return the conditions and then the assigned expressions of each table, table by table.

    Assigned expressions are row by row; repetitions stay.
    """
    formulas: list[Formula] = []
    for table in tables:
        formulas += table.conditions.values()
        formulas += (formula for row in table.rows for formula in row.assignments.values())
    return formulas
