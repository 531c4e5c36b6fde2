"""Transition table reader: expansion of transition tables into ordinary transitions.

    transition_table:
      columns: {start: {when: key == crank, priority: 2}, hot: {when: temp > 90 degC, priority: 1}}
      rows:
        idle: {start: run, hot: stay}
        run: {start: stay, hot: idle}

A column is a transition without a target. A cell is the target, or `stay` for no transition. Each
mode beside the table needs a row, and each row needs all columns. The checks of transitions decide
whether two columns can fire together (decision 0009).
"""

from __future__ import annotations

from collections.abc import Mapping

from language.readers.base_reader import Reader
from language.readers.transition_reader import CHART_TRANSITION_KEYS, TRANSITION_KEYS
from language.text.diagnostic import Problems, suggest_name
from language.text.document import Entry, MappingNode, ScalarNode, YamlNode

TABLE_KEY = "transition_table"
COLUMN_KEYS = tuple(key for key in (*TRANSITION_KEYS, *CHART_TRANSITION_KEYS) if key != "to")
STAY = "stay"
"""The content of a cell without a transition."""


def expand_transition_tables(tree: MappingNode, problems: Problems) -> MappingNode:
    """Return a tree in which the tables of the root, of regions and of modes are expanded.

    Each table becomes transitions of the modes beside it, named like the columns, after the own
    ones; the key `transition_table` is removed. A cell `stay` gives no transition. Tables inside
    templates are not expanded.

    Reported, not raised: a table without modes or columns, missing or unknown rows and cells, a
    mode called `stay`, and a transition with the name of a column (which wins).
    """
    reader = _TransitionTableReader(problems)
    return reader.expand_table(reader.expand_children(tree, ("modes", "regions")))


class _TransitionTableReader(Reader):
    """Expands the transition tables of a tree."""

    def expand_children(self, tree: MappingNode, keys: tuple[str, ...]) -> MappingNode:
        """Return a mapping in which the tables below the sections `keys` are expanded."""
        expanded = dict(tree.entries)
        for key in keys:
            group = tree.get(key)
            if isinstance(group, MappingNode):
                parts = {
                    entry.key: _replace_node(entry, self._expand_node(entry.node))
                    for entry in group
                }
                expanded[key] = _replace_node(expanded[key], MappingNode(parts, group.span))
        return MappingNode(expanded, tree.span)

    def _expand_node(self, node: YamlNode) -> YamlNode:
        """Return the node of a mode or region with all its tables expanded."""
        return (
            self.expand_table(self.expand_children(node, ("modes", "regions")))
            if isinstance(node, MappingNode)
            else node
        )

    def expand_table(self, tree: MappingNode) -> MappingNode:
        """Return a mapping whose own table is removed and expanded into its `modes`.

        A mapping without a table is returned unchanged. A table without modes or columns, and rows
        of unknown modes, are reported.
        """
        entry, modes = tree.entries.get(TABLE_KEY), tree.get("modes")
        if entry is None:
            return tree
        entries = {key: other for key, other in tree.entries.items() if key != TABLE_KEY}
        body = self.read_mapping(entry.node, TABLE_KEY, ("columns", "rows"))
        columns = {
            column.key: column for column in self.named_entries(body.get("columns"), "columns")
        }
        rows = {row.key: row for row in self.read_mapping(body.get("rows"), "rows")}
        if not isinstance(modes, MappingNode) or not columns:
            label = "a transition table is beside `modes` and has at least one column"
            self.problems.error("missing", entry.span, label)
            return MappingNode(entries, tree.span)
        for column in columns.values():
            self.read_mapping(column.node, f"columns.{column.key}", COLUMN_KEYS)
        for key, row in rows.items():
            if key not in modes.entries:
                hint = suggest_name(key, modes.entries)
                self.problems.error("name", row.span, f"there is no mode `{key}`", hint)
        expanded_modes = {
            mode.key: self._expand_mode(mode, rows.get(mode.key), columns, entry) for mode in modes
        }
        entries["modes"] = _replace_node(entries["modes"], MappingNode(expanded_modes, modes.span))
        return MappingNode(entries, tree.span)

    def _expand_mode(
        self, mode: Entry, row: Entry | None, columns: Mapping[str, Entry], table: Entry
    ) -> Entry:
        """Return a mode with the transitions of its row added to its own.

        A missing row, an unknown column and a transition with the name of a column are reported.
        """
        if mode.key == STAY:
            label = f"`{STAY}` in a cell leads nowhere: no mode beside a table has this name"
            self.problems.error("name", mode.span, label)
        if row is None:
            label = f"the mode `{mode.key}` has no row"
            hint = f"add `{mode.key}: {{{', '.join(f'{name}: {STAY}' for name in columns)}}}`"
            self.problems.error("incomplete", table.span, label, hint)
            return mode
        cells = {cell.key: cell for cell in self.read_mapping(row.node, row.key)}
        for key, cell in cells.items():
            if key not in columns:
                label = f"there is no column `{key}`"
                self.problems.error("name", cell.span, label, suggest_name(key, columns))
        body = mode.node if isinstance(mode.node, MappingNode) else MappingNode({}, mode.node.span)
        old = body.get("transitions")
        transitions = dict(old.entries) if isinstance(old, MappingNode) else {}
        for name, column in columns.items():
            transition = self._read_cell(row, cells.get(name), column)
            if transition and name in transitions:
                label = f"`{name}` is a transition of `{mode.key}` and a column"
                hint = f"the transition is at {transitions[name].span}"
                self.problems.error("duplicate", transition.span, label, hint)
            elif transition:
                transitions[name] = transition
        if not transitions:
            return mode
        new_entry = Entry("transitions", row.span, MappingNode(transitions, row.span))
        return _replace_node(
            mode, MappingNode({**body.entries, "transitions": new_entry}, body.span)
        )

    def _read_cell(self, row: Entry, cell: Entry | None, column: Entry) -> Entry | None:
        """Return the transition of a cell, or None for `stay`.

        A missing cell is reported and gives None.
        """
        if cell is None:
            label = f"row `{row.key}` has no cell for `{column.key}`"
            self.problems.error("incomplete", row.span, label, f"a mode, or `{STAY}`")
            return None
        target = self.read_scalar(cell.node, column.key, cell.span)
        if target is None or target.text == STAY or not isinstance(column.node, MappingNode):
            return None
        to = Entry("to", target.span, ScalarNode(target.text, target.span))
        return Entry(
            column.key, target.span, MappingNode({**column.node.entries, "to": to}, cell.span)
        )


def _replace_node(entry: Entry, node: YamlNode) -> Entry:
    """Return an entry with the same key and place and another node."""
    return Entry(entry.key, entry.span, node)
