"""Truth: a table of conditions and rows, of which exactly one holds."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from language.model.declaration import Formula
from language.text.diagnostic import Span


@dataclass(frozen=True)
class TruthRow:
    """A row of a truth table: what each condition is (None: whatever), and what it then writes.

    A row of no marks was told to be none; `is_rest` is the last one, `else`: what no other is for.
    """

    name: str
    marks: tuple[bool | None, ...]
    assignments: Mapping[str, Formula]
    span: Span
    is_else: bool = False


@dataclass(frozen=True)
class TruthTable:
    """Conditions by name, and rows of which exactly one holds (language/lowering/truth_tables.py)."""

    name: str
    conditions: Mapping[str, Formula]
    rows: tuple[TruthRow, ...]
    key: str
    span: Span

    @property
    def assigned_names(self) -> tuple[str, ...]:
        """The discrete variables that some row writes, each once."""
        return tuple(dict.fromkeys(name for row in self.rows for name in row.assignments))


def truth_table_formulas(tables: Iterable[TruthTable]) -> list[Formula]:
    """Return the conditions of truth tables, and what their rows write."""
    formulas: list[Formula] = []
    for table in tables:
        formulas += table.conditions.values()
        formulas += (formula for row in table.rows for formula in row.assignments.values())
    return formulas
