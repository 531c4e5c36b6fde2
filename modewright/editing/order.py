"""Order: where the order of keys means something, and what moves when it is another one."""

from __future__ import annotations

from collections.abc import Sequence

from language.text.document import MappingNode

NUMBERED_SECTIONS = {"modes": "numbers of modes move", "faults": "bits of faults move"}
"""Sections whose names are numbered as they come, each after all before it."""
ORDERED_SECTIONS = {
    "events": "what comes at once is heard in another order",
    "regions": "what is done at once is done in another order",
    "instances": "what is done at once is done in another order",
}
"""Sections in which it counts who stands before whom; `instances` are regions of an automaton."""


def describe_reordering(section: str, old: MappingNode, new: MappingNode) -> str:
    """Return what the other order of the keys of a section changes; empty for nothing."""
    before, after = _numbered_keys(section, old), _numbered_keys(section, new)
    both = [key for key in before if key in after]
    if section in NUMBERED_SECTIONS and _indices_of(both, before) != _indices_of(both, after):
        return NUMBERED_SECTIONS[section]
    if section in ORDERED_SECTIONS and both != [key for key in after if key in before]:
        return ORDERED_SECTIONS[section]
    return ""


def _indices_of(keys: Sequence[str], among: Sequence[str]) -> list[int]:
    return [among.index(key) for key in keys]


def _numbered_keys(section: str, table: MappingNode) -> list[str]:
    """Return the keys whose order counts: modes that say their number do without."""
    is_mode = section == "modes"
    return [
        e.key
        for e in table
        if not (is_mode and isinstance(e.node, MappingNode) and e.node.get("number"))
    ]
