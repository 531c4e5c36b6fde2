"""Overlays: merging of a partial tree (variant, template user) into a base tree, key by key."""

from __future__ import annotations

from language.text.diagnostic import Problems, suggest_name
from language.text.document import Entry, MappingNode, ScalarNode, SequenceNode, YamlNode


def apply_overlay(
    base: MappingNode, overlay: MappingNode, problems: Problems, *, is_template: bool = False
) -> MappingNode:
    """Return `base` merged with `overlay` (docs/language.md, "Variants, effects, calibrations").

    Mappings are merged key by key at every depth; keys of the base keep their order, new keys
    follow. Any other value replaces that of the base. `{remove: true}` removes a key; it is an
    error if the base does not have the key, also below a new key. A scalar or a sequence equal to
    that of the base gives a warning unless `is_template` is true. Problems, all of kind "overlay",
    are added to `problems`; nothing is raised.
    """
    entries = dict(base.entries)
    for entry in overlay:
        present = base.entries.get(entry.key)
        if _is_removal(entry.node):
            if present is None:
                label = f"`{entry.key}` cannot be removed: it is not there"
                problems.error("overlay", entry.span, label, suggest_name(entry.key, base.entries))
            entries.pop(entry.key, None)
        elif present is None:
            entries[entry.key] = _reject_removals(entry, base, problems)
        else:
            node = _merge_entry(present, entry, problems, is_template)
            entries[entry.key] = Entry(entry.key, present.span, node)
    return MappingNode(entries, base.span)


def without_keys(mapping: MappingNode, *keys: str) -> MappingNode:
    """Return a copy of a mapping without the given keys; absent keys are ignored.

    Keys of mappings below stay.
    """
    entries = {key: entry for key, entry in mapping.entries.items() if key not in keys}
    return MappingNode(entries, mapping.span)


def _is_removal(node: YamlNode) -> bool:
    """Return whether a node is `{remove: true}`."""
    if not isinstance(node, MappingNode) or set(node.entries) != {"remove"}:
        return False
    value = node.get("remove")
    return isinstance(value, ScalarNode) and value.text == "true"


def _reject_removals(entry: Entry, base: MappingNode, problems: Problems) -> Entry:
    """Return a new entry without its removals; report each, since the base has no such key."""
    if not isinstance(entry.node, MappingNode):
        return entry
    nested_problems = Problems()
    node = apply_overlay(MappingNode({}, entry.node.span), entry.node, nested_problems)
    near = suggest_name(entry.key, base.entries)
    for problem in nested_problems.reported:
        hint = problem.help or (f"`{entry.key}` is new: {near}" if near else "")
        problems.error("overlay", problem.span, problem.label, hint)
    return Entry(entry.key, entry.span, node)


def _merge_entry(base: Entry, overlay: Entry, problems: Problems, template: bool) -> YamlNode:
    """Return the node that results from an entry of the overlay over an entry of the base."""
    if isinstance(base.node, MappingNode) and isinstance(overlay.node, MappingNode):
        return apply_overlay(base.node, overlay.node, problems, is_template=template)
    if (
        not template
        and not isinstance(base.node, MappingNode)
        and _plain_content(base.node) == _plain_content(overlay.node)
    ):
        label = f"`{overlay.key}` is overridden by the value that it has"
        problems.warning("overlay", overlay.span, label, f"it is given at {base.span}")
    return overlay.node


def _plain_content(node: YamlNode) -> object:
    """Return the content of a node as text, tuples and dicts, without spans, for comparison."""
    match node:
        case ScalarNode():
            return node.text
        case SequenceNode():
            return tuple(_plain_content(item) for item in node.nodes)
        case MappingNode():
            return {entry.key: _plain_content(entry.node) for entry in node}
