"""Transition table: for each mode and each column where it leads, as ordinary transitions.

    transition_table:
      columns: {start: {when: key == crank, priority: 2}, hot: {when: temp > 90 degC, priority: 1}}
      rows:
        idle: {start: run, hot: stay}
        run: {start: stay, hot: idle}

A column is a transition without its target; a cell is the target, or `stay`. Complete: each of the
modes beside the table has a row, each row all columns. Whether two columns can fire together is a
question about the transitions that come of it (decision 0009).
"""

from __future__ import annotations

from collections.abc import Mapping

from language.document import Entry, Node, Scalar, Table
from language.problem import Problems, nearest
from language.reader import Reader
from language.transition_reader import CHART_WAY_KEYS, TRANSITION_KEYS

KEY = "transition_table"
COLUMN_KEYS = tuple(key for key in (*TRANSITION_KEYS, *CHART_WAY_KEYS) if key != "to")
STAY = "stay"


def with_transition_tables(tree: Table, problems: Problems) -> Table:
    """Return an automaton's tree with the transitions of its tables in their modes."""
    reader = _TableReader(problems)
    return reader.written(reader.inside(tree, ("modes", "regions")))


class _TableReader(Reader):
    """Reads tables wherever modes stand."""

    def inside(self, tree: Table, keys: tuple[str, ...]) -> Table:
        """Return a tree in whose modes and regions the tables are written out."""
        found = dict(tree.entries)
        for key in keys:
            group = tree.get(key)
            if isinstance(group, Table):
                parts = {entry.key: _changed(entry, self._below(entry.node)) for entry in group}
                found[key] = _changed(found[key], Table(parts, group.span))
        return Table(found, tree.span)

    def _below(self, node: Node) -> Node:
        return (
            self.written(self.inside(node, ("modes", "regions")))
            if isinstance(node, Table)
            else node
        )

    def written(self, tree: Table) -> Table:
        """Return a tree whose own table, if it has one, is written out in the modes beside it."""
        entry, modes = tree.entries.get(KEY), tree.get("modes")
        if entry is None:
            return tree
        kept = {key: other for key, other in tree.entries.items() if key != KEY}
        body = self.table(entry.node, KEY, ("columns", "rows"))
        columns = {column.key: column for column in self.named(body.get("columns"), "columns")}
        rows = {row.key: row for row in self.table(body.get("rows"), "rows")}
        if not isinstance(modes, Table) or not columns:
            label = "a transition table stands beside `modes` and has at least one column"
            self.problems.error("missing", entry.span, label)
            return Table(kept, tree.span)
        for column in columns.values():
            self.table(column.node, f"columns.{column.key}", COLUMN_KEYS)
        for key, row in rows.items():
            if key not in modes.entries:
                hint = nearest(key, modes.entries)
                self.problems.error("name", row.span, f"there is no mode `{key}`", hint)
        led = {mode.key: self._mode(mode, rows.get(mode.key), columns, entry) for mode in modes}
        kept["modes"] = _changed(kept["modes"], Table(led, modes.span))
        return Table(kept, tree.span)

    def _mode(
        self, mode: Entry, row: Entry | None, columns: Mapping[str, Entry], table: Entry
    ) -> Entry:
        """Return a mode with the transitions of its row."""
        if mode.key == STAY:
            label = f"`{STAY}` in a cell leads nowhere: no mode beside a table has this name"
            self.problems.error("name", mode.span, label)
        if row is None:
            label = f"the mode `{mode.key}` has no row"
            hint = f"add `{mode.key}: {{{', '.join(f'{name}: {STAY}' for name in columns)}}}`"
            self.problems.error("incomplete", table.span, label, hint)
            return mode
        cells = {cell.key: cell for cell in self.table(row.node, row.key)}
        for key, cell in cells.items():
            if key not in columns:
                label = f"there is no column `{key}`"
                self.problems.error("name", cell.span, label, nearest(key, columns))
        body = mode.node if isinstance(mode.node, Table) else Table({}, mode.node.span)
        old = body.get("transitions")
        ways = dict(old.entries) if isinstance(old, Table) else {}
        for name, column in columns.items():
            way = self._way(row, cells.get(name), column)
            if way and name in ways:
                label = f"`{name}` is a transition of `{mode.key}` and a column"
                hint = f"the transition is at {ways[name].span}"
                self.problems.error("duplicate", way.span, label, hint)
            elif way:
                ways[name] = way
        if not ways:
            return mode
        made = Entry("transitions", row.span, Table(ways, row.span))
        return _changed(mode, Table({**body.entries, "transitions": made}, body.span))

    def _way(self, row: Entry, cell: Entry | None, column: Entry) -> Entry | None:
        """Return the transition of a cell, None where it stays."""
        if cell is None:
            label = f"`{row.key}` says nothing of `{column.key}`"
            self.problems.error("incomplete", row.span, label, f"a mode, or `{STAY}`")
            return None
        target = self.scalar(cell.node, column.key, cell.span)
        if target is None or target.text == STAY or not isinstance(column.node, Table):
            return None
        to = Entry("to", target.span, Scalar(target.text, target.span))
        return Entry(column.key, target.span, Table({**column.node.entries, "to": to}, cell.span))


def _changed(entry: Entry, node: Node) -> Entry:
    return Entry(entry.key, entry.span, node)
