"""Truth table reader: named conditions, rows like `"T F -": {permit: false}`, and a last `else`."""

from __future__ import annotations

from collections.abc import Mapping

from language.model.truth_table import TruthRow, TruthTable
from language.readers.base_reader import Reader
from language.text.diagnostic import suggest_name
from language.text.document import Entry, MappingNode

MARKS: Mapping[str, bool | None] = {"T": True, "F": False, "-": None}
"""The value of a condition that each mark requires; None for either value."""
ELSE_ROW = "else"
MARK_ALIASES: Mapping[str, str] = {
    **dict.fromkeys("TtYy1", "T"),
    **dict.fromkeys("FfNn0", "F"),
    **dict.fromkeys("-*Xx", "-"),
}
"""Spellings of marks in other tools, for hints."""
MAX_CONDITIONS = 16
"""Largest number of conditions; the search for an undecided row examines up to 2^16 cases."""


class TruthTableReader(Reader):
    """Reads the section `tables`; `discrete` are the variables that rows may assign."""

    discrete: tuple[str, ...] = ()

    def read_truth_tables(self, tree: MappingNode) -> tuple[TruthTable, ...]:
        """Return the truth tables in the section `tables` of a tree in the order of the file.

        Sets `discrete` to the discrete variables of the tree. A row with wrong marks is reported
        and has no marks. Also reported, and kept: empty `if` or `rows`, more than MAX_CONDITIONS
        conditions, `else` before other rows, and results that are no discrete variables.
        """
        self.discrete = tuple(self.read_mapping(tree.get("discrete"), "discrete").entries)
        node = tree.get("tables")
        return tuple(self._read_table(entry) for entry in self.named_entries(node, "tables"))

    def _read_table(self, entry: Entry) -> TruthTable:
        """Return one table.

        Empty sections, too many conditions and a row `else` that is not the last are reported.
        """
        key = f"tables.{entry.key}"
        body = self.read_mapping(entry.node, key, ("if", "rows"))
        conditions = self.read_formulas(body.get("if"), f"{key}.if")
        for what in ("if", "rows"):
            if not self.read_mapping(body.get(what), what).entries:
                label = f"a truth table has at least one entry in `{what}`"
                self.problems.error("missing", entry.span, label)
        if len(conditions) > MAX_CONDITIONS:
            label = f"`{entry.key}` has {len(conditions)} conditions"
            hint = f"a truth table has at most {MAX_CONDITIONS}: split it"
            self.problems.error("huge", entry.span, label, hint)
        entries = list(self.read_mapping(body.get("rows"), f"{key}.rows"))
        rows = tuple(self._read_row(row, key, len(conditions)) for row in entries)
        for row in rows[:-1]:
            if row.is_else:
                label = f"`{ELSE_ROW}` is not the last row"
                self.problems.error("table", row.span, label, "it applies if no other row does")
        return TruthTable(entry.key, conditions, rows, key, entry.span)

    def _read_row(self, entry: Entry, key: str, width: int) -> TruthRow:
        """Return one row of `width` marks; a row with wrong marks is reported and gets none."""
        is_rest = entry.key == ELSE_ROW
        marks = ["-"] * width if is_rest else entry.key.split()
        if len(marks) != width or not all(mark in MARKS for mark in marks):
            label = f"`{entry.key}` is no row of {width} conditions"
            self.problems.error("table", entry.span, label, _row_hint(entry.key, width))
            marks = []
        results = self.read_formulas(entry.node, f"{key}.rows.{entry.key}")
        for written in self.read_mapping(entry.node, entry.key):
            if written.key not in self.discrete:
                label = f"`{written.key}` is not a discrete variable"
                hint = suggest_name(written.key, self.discrete) or "declare it under `discrete`"
                self.problems.error("name", written.span, label, hint)
        name = ELSE_ROW if is_rest else " ".join(marks)
        return TruthRow(name, tuple(MARKS[mark] for mark in marks), results, entry.span, is_rest)


def _row_hint(key: str, width: int) -> str:
    """Return a hint for a wrong row.

    It is the correct spelling if the marks are recognised, otherwise the form of a row.
    """
    marks = [MARK_ALIASES.get(mark, "") for mark in key if not mark.isspace()]
    if len(marks) == width and all(marks):
        return f'it is written `"{" ".join(marks)}"`'
    if key in ("default", "otherwise", "rest"):
        return f"the last row is `{ELSE_ROW}`: it applies if no other row does"
    return "one of `T`, `F` or `-` for each, with blanks between, in the order of `if`"
