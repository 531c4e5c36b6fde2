"""Order: where the order of keys means something, and what moves when it is another one."""

from __future__ import annotations

from collections.abc import Sequence

from language.document import Table

COUNTED = {"modes": "numbers of modes move", "faults": "bits of faults move"}
"""Sections whose names are numbered as they come, each after all before it."""
ORDERED = {
    "events": "what comes at once is heard in another order",
    "regions": "what is done at once is done in another order",
    "instances": "what is done at once is done in another order",
}
"""Sections in which it counts who stands before whom; `instances` are regions of an automaton."""


def what_moves(section: str, old: Table, new: Table) -> str:
    """Return what the other order of the keys of a section changes; empty for nothing."""
    before, after = _counted(section, old), _counted(section, new)
    both = [key for key in before if key in after]
    if section in COUNTED and _places(both, before) != _places(both, after):
        return COUNTED[section]
    if section in ORDERED and both != [key for key in after if key in before]:
        return ORDERED[section]
    return ""


def _places(keys: Sequence[str], among: Sequence[str]) -> list[int]:
    return [among.index(key) for key in keys]


def _counted(section: str, table: Table) -> list[str]:
    """Return the keys whose order counts: modes that say their number do without."""
    is_mode = section == "modes"
    return [
        e.key for e in table if not (is_mode and isinstance(e.node, Table) and e.node.get("number"))
    ]
