"""Thing: what a key path of a spec is about - a parameter, a mode, a transition, a guard."""

from __future__ import annotations

from dataclasses import dataclass

from language.document import Scalar, Table
from language.tree import at

Path = tuple[str, ...]

TEXTS = "texts"
"""The group of what has no influence."""
SUBSECTIONS = (
    *("transitions", "equations", "flow", "terms", "entry", "exit", "update", "invariant"),
    *("modes", "regions", "observer", "runs"),
)
"""Keys of a mode that are told on their own."""
MODE_SECTIONS = {
    "equations": "equations",
    "flow": "flow",
    "terms": "terms",
    "entry": "actions",
    "exit": "actions",
    "update": "actions",
    "invariant": "invariants",
}
"""The groups of what is named inside a mode."""
ASPECTS = {"when": "guard", "to": "target"}
"""Words for keys, where the field has another one."""
SECTIONS = (
    *("parameters", "inputs", "states", "discrete", "equations", "flow", "terms", "faults"),
    *("events", "tables", "elements", "places", "instances", "sensors", "connections", "outputs"),
    *("initial", "columns", "constants", "measures", "plots", "vary", "set", "variants", "pages"),
    *("expect", "effects", "redirect"),
)
"""Sections whose keys are names of things."""


@dataclass(frozen=True)
class Thing:
    """What a path is about, and in which respect; the respect of the thing itself is empty."""

    group: str
    title: str
    aspect: str


def thing_of(path: Path, root: Table) -> Thing | None:
    """Return the thing of a path; None for a section, which is none itself."""
    thing = _thing(path, root)
    if thing and path[-1] in ("about", "req"):
        return Thing(TEXTS, thing.title, thing.aspect)
    return thing


def is_section(path: Path) -> bool:
    """Tell whether what a path leads to holds named things: at the root, or in a mode or region."""
    return len(_mode(path)[1]) == 1 and (len(path) == 1 or path[-1] in ("modes", "regions"))


def _thing(path: Path, root: Table) -> Thing | None:
    mode, rest = _mode(path)
    if not mode:
        return _of_section(rest, root)
    if not rest:
        return Thing("modes", mode, "") if path[-2] == "modes" else None
    section, *inner = rest
    if section == "transitions":
        return _transition(mode, path, inner, root)
    if section in MODE_SECTIONS:
        if not inner:
            return None
        kind = section if MODE_SECTIONS[section] == "actions" else ""
        aspect = " ".join((*([kind] if kind else []), *inner[1:]))
        return Thing(MODE_SECTIONS[section], f"{inner[0]} in {mode}", aspect)
    if section in ("observer", "runs"):
        return Thing("observers and runs", mode, ".".join(rest))
    if section in ("modes", "regions"):
        return None
    return Thing("modes", mode, ".".join(rest))


def _mode(path: Path) -> tuple[str, Path]:
    """Return the mode that a path goes through, dotted, and the rest of the path."""
    found: list[str] = []
    k = 0
    while k + 1 < len(path) and path[k] in ("modes", "regions"):
        found.append(path[k + 1])
        k += 2
    return ".".join(found), path[k:]


def _of_section(path: Path, root: Table) -> Thing | None:
    section, *rest = path
    node = root.get(section)
    if section in ("modes", "regions"):
        return None
    if isinstance(node, Table) and section in SECTIONS:
        if not rest:
            return None
        return Thing(section, rest[0], ".".join(ASPECTS.get(key, key) for key in rest[1:]))
    return Thing("settings", section, ".".join(rest))


def _transition(mode: str, path: Path, inner: list[str], root: Table) -> Thing | None:
    if not inner:
        return None
    name, *aspect = inner
    node = at(root, path[: len(path) - len(aspect)])
    to = node.get("to") if isinstance(node, Table) else None
    target = to.text if isinstance(to, Scalar) else name
    title = f"{mode} -> {target}" if target == name else f"{mode} -> {target} ({name})"
    return Thing("transitions", title, ".".join(ASPECTS.get(key, key) for key in aspect))
