"""Overlay: lay a partial tree over another one (variants, templates), by name."""

from __future__ import annotations

from language.document import Entry, Items, Node, Scalar, Table
from language.problem import Problems, nearest


def lay(base: Table, over: Table, problems: Problems, *, template: bool = False) -> Table:
    """Return `base` with `over` laid over it (docs/language.md, "Variants, effects, calibrations").

    Mappings merge by name, to any depth; a scalar or a list replaces; `{remove: true}` removes.
    A removal of what is absent is a problem; an override by an equal value is a warning,
    unless `base` is a template.
    """
    entries = dict(base.entries)
    for entry in over:
        present = base.entries.get(entry.key)
        if _is_removal(entry.node):
            if present is None:
                label = f"`{entry.key}` cannot be removed: it is not there"
                problems.error("overlay", entry.span, label, nearest(entry.key, base.entries))
            entries.pop(entry.key, None)
        elif present is None:
            entries[entry.key] = _added(entry, base, problems)
        else:
            node = _combined(present, entry, problems, template)
            entries[entry.key] = Entry(entry.key, present.span, node)
    return Table(entries, base.span)


def without(table: Table, *keys: str) -> Table:
    """Return the table without some of its keys."""
    kept = {key: entry for key, entry in table.entries.items() if key not in keys}
    return Table(kept, table.span)


def _is_removal(node: Node) -> bool:
    if not isinstance(node, Table) or set(node.entries) != {"remove"}:
        return False
    value = node.get("remove")
    return isinstance(value, Scalar) and value.text == "true"


def _added(entry: Entry, base: Table, problems: Problems) -> Entry:
    """Nothing can be removed inside what is new."""
    if not isinstance(entry.node, Table):
        return entry
    found = Problems()
    made = lay(Table({}, entry.node.span), entry.node, found)
    near = nearest(entry.key, base.entries)
    for problem in found.found:
        hint = problem.help or (f"`{entry.key}` is new: {near}" if near else "")
        problems.error("overlay", problem.span, problem.label, hint)
    return Entry(entry.key, entry.span, made)


def _combined(base: Entry, over: Entry, problems: Problems, template: bool) -> Node:
    if isinstance(base.node, Table) and isinstance(over.node, Table):
        return lay(base.node, over.node, problems, template=template)
    if not template and not isinstance(base.node, Table) and _value(base.node) == _value(over.node):
        label = f"`{over.key}` is overridden by the value that it has"
        problems.warning("overlay", over.span, label, f"it is given at {base.span}")
    return over.node


def _value(node: Node) -> object:
    """What a tree says, without its places."""
    match node:
        case Scalar():
            return node.text
        case Items():
            return tuple(_value(item) for item in node.nodes)
        case Table():
            return {entry.key: _value(entry.node) for entry in node}
