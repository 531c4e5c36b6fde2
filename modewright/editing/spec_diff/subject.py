"""Subject: determine what a key path of a spec describes - a parameter, a mode, a guard etc."""

from __future__ import annotations

from dataclasses import dataclass

from language.text.document import MappingNode, ScalarNode
from language.text.node_edit import find_node

KeyPath = tuple[str, ...]

TEXT_GROUP = "texts"
"""The group of texts without influence on results."""
SUBSECTIONS = (
    *("transitions", "equations", "flow", "terms", "entry", "exit", "update", "invariant"),
    *("modes", "regions", "observer", "runs"),
)
"""Keys of a mode whose entries are separate subjects."""
MODE_SECTION_GROUPS = {
    "equations": "equations",
    "flow": "flow",
    "terms": "terms",
    "entry": "actions",
    "exit": "actions",
    "update": "actions",
    "invariant": "invariants",
}
"""The groups of the named entries of a mode, by section."""
ASPECT_NAMES = {"when": "guard", "to": "target"}
"""Terms for keys that have another name in the field."""
NAMED_SECTIONS = (
    *("parameters", "inputs", "states", "discrete", "equations", "flow", "terms", "faults"),
    *("events", "tables", "elements", "places", "instances", "sensors", "connections", "outputs"),
    *("initial", "columns", "constants", "measures", "plots", "vary", "set", "variants", "pages"),
    *("expect", "effects", "redirect"),
)
"""Sections whose keys are names."""


@dataclass(frozen=True)
class Subject:
    """The subject of a path and the aspect of it; the aspect is empty for the subject itself."""

    group: str
    title: str
    aspect: str


def subject_of(path: KeyPath, root: MappingNode) -> Subject | None:
    """Return the subject of a key path; None for a section, a region or a table of transitions.

    Below a mode the groups are modes, transitions (title `mode -> target`), those of
    MODE_SECTION_GROUPS (title `name in mode`) and `observers and runs`. At the root a key of
    NAMED_SECTIONS is the group of its entries; other keys are in `settings`. Paths that end in
    `about` or `req` are in TEXT_GROUP.
    """
    subject = _find_subject(path, root)
    if subject and path[-1] in ("about", "req"):
        return Subject(TEXT_GROUP, subject.title, subject.aspect)
    return subject


def is_section(path: KeyPath) -> bool:
    """Return whether a path leads to a section of named entries.

    Sections are the keys at the root, and `modes` and `regions` in modes and regions; not other
    sections of a mode, such as `transitions`.
    """
    return len(_split_mode(path)[1]) == 1 and (len(path) == 1 or path[-1] in ("modes", "regions"))


def _find_subject(path: KeyPath, root: MappingNode) -> Subject | None:
    """Return the subject of a path without regard to texts."""
    mode, rest = _split_mode(path)
    if not mode:
        return _section_subject(rest, root)
    if not rest:
        return Subject("modes", mode, "") if path[-2] == "modes" else None
    section, *inner = rest
    if section == "transitions":
        return _transition_subject(mode, path, inner, root)
    if section in MODE_SECTION_GROUPS:
        if not inner:
            return None
        kind = section if MODE_SECTION_GROUPS[section] == "actions" else ""
        aspect = " ".join((*([kind] if kind else []), *inner[1:]))
        return Subject(MODE_SECTION_GROUPS[section], f"{inner[0]} in {mode}", aspect)
    if section in ("observer", "runs"):
        return Subject("observers and runs", mode, ".".join(rest))
    if section in ("modes", "regions"):
        return None
    return Subject("modes", mode, ".".join(rest))


def _split_mode(path: KeyPath) -> tuple[str, KeyPath]:
    """Return the dotted mode at the start of a path, and the rest of the path."""
    found: list[str] = []
    k = 0
    while k + 1 < len(path) and path[k] in ("modes", "regions"):
        found.append(path[k + 1])
        k += 2
    return ".".join(found), path[k:]


def _section_subject(path: KeyPath, root: MappingNode) -> Subject | None:
    """Return the subject of a path in a section at the root."""
    section, *rest = path
    node = root.get(section)
    if section in ("modes", "regions"):
        return None
    if isinstance(node, MappingNode) and section in NAMED_SECTIONS:
        if not rest:
            return None
        return Subject(section, rest[0], ".".join(ASPECT_NAMES.get(key, key) for key in rest[1:]))
    return Subject("settings", section, ".".join(rest))


def _transition_subject(
    mode: str, path: KeyPath, inner: list[str], root: MappingNode
) -> Subject | None:
    """Return the subject of a path in a transition, titled `mode -> target`."""
    if not inner:
        return None
    name, *aspect = inner
    node = find_node(root, path[: len(path) - len(aspect)])
    to = node.get("to") if isinstance(node, MappingNode) else None
    target = to.text if isinstance(to, ScalarNode) else name
    title = f"{mode} -> {target}" if target == name else f"{mode} -> {target} ({name})"
    return Subject("transitions", title, ".".join(ASPECT_NAMES.get(key, key) for key in aspect))
