"""Asked: what alone fits where one sort of name is asked for, be it words of an enum or modes."""

from __future__ import annotations

import re
from collections.abc import Iterator

from language.document import Items, Scalar, Table
from language.symbols import SYMBOLS, TIME
from modewright.editing.guide import Place
from modewright.lsp.mention import region_of
from modewright.lsp.namespace import Declared, Namespace

DECLARING = ("inputs", "discrete", "parameters")
"""Sections in which keys below a name hold its value, too."""
HOLDING = ("initial", "default", "value", "start")
"""Those keys; so do the times of `steps`."""
Named = tuple[str, Declared]
"""What is offered, and what it is of."""


def asked(space: Namespace, place: Place, before: str) -> list[Named] | None:
    """Return what alone fits; None where nothing of that kind is asked for.

    `before` is what stands on the line before the word that is being written.
    """
    called = re.search(r"\b(in|fault)\(\s*$", before)
    if called:
        return list(all_modes(space) if called[1] == "in" else _everywhere(space, ("fault",)))
    compared = re.search(r"([\w.$]+)\s*[!=]=\s*$", before)
    if compared:
        return _compared(space, compared[1])
    if place.path[:1] == ("expect",) and place.section == "modes":
        return _listed(space, place.path)
    if place.section == "raise":
        return [(each.name, each) for each in space.group("event") if not _is_input(each)]
    if place.section == "event" and space.document.kind != "test":
        return [(each.name, each) for each in space.group("event")]
    if place.section == "wait":
        return [(each.name, each) for each in space.group("value") if _is_time(each)]
    held = _held(place.path)
    return _words(space, held) if held else None


def all_modes(space: Namespace) -> Iterator[Named]:
    """Yield the modes by their paths, those of instances and of the model by theirs."""
    yield from _everywhere(space, ("mode",))
    if space.model:
        for each in space.model.group("mode"):
            yield f"{space.model.document.name}.{each.name}", each


def _everywhere(space: Namespace, groups: tuple[str, ...]) -> Iterator[Named]:
    yield from ((each.name, each) for each in space.group(*groups))
    for name, inner in space.instances.items():
        yield from ((f"{name}.{each.name}", each) for each in inner.group(*groups))


def _compared(space: Namespace, path: str) -> list[Named] | None:
    """Return the modes of a region, named beside it, or the words of an enum."""
    region = region_of(space, path)
    if region is None:
        return _words(space, path)
    inner, name = region
    regions = [each.name for each in inner.group("region") if each.name and each.name != "chart"]
    own = f"{name}." if name else ""
    others = tuple(f"{each}." for each in regions if not own.startswith(f"{each}."))
    return [
        (each.name.removeprefix(own), each)
        for each in inner.group("mode")
        if each.name.startswith(own) and not each.name.startswith(others)
    ]


def _listed(space: Namespace, path: tuple[str, ...]) -> list[Named] | None:
    """Return the innermost modes of the region beside which a test lists them."""
    expected = space.document.root.get("expect")
    own = expected.get(path[1]) if isinstance(expected, Table) else None
    of = own.get("of") if isinstance(own, Table) else None
    region = of.text if isinstance(of, Scalar) else ""
    found = _compared(space, region) or _compared(space, f"{region}.mode".removeprefix("."))
    outer = tuple(name for name, _ in found or ())
    return found and [
        (name, each) for name, each in found if not any(o.startswith(f"{name}.") for o in outer)
    ]


def _held(path: tuple[str, ...]) -> str:
    """Return the name whose value stands at a path, if it is one."""
    if len(path) > 2 and path[0] in DECLARING:
        return path[1] if path[2] in HOLDING or path[2:3] == ("steps",) else ""
    return path[-1] if path else ""


def _words(space: Namespace, path: str) -> list[Named] | None:
    """Return the words of an enum, then what else has the same words; None for what is none."""
    values = list(_everywhere(space, ("value",)))
    of = next((each for name, each in values if name == path and _enumerated(each)), None)
    if of is None:
        return None
    words = _enumerated(of)
    others = [(name, each) for name, each in values if each.identity != of.identity]
    same = [(name, each) for name, each in others if _enumerated(each) == words]
    return [*((word, of) for word in words), *same]


def _enumerated(declared: Declared) -> list[str]:
    values = declared.node.get("values") if isinstance(declared.node, Table) else None
    nodes = values.nodes if isinstance(values, Items) else ()
    return [node.text for node in nodes if isinstance(node, Scalar)]


def _is_input(event: Declared) -> bool:
    given = event.node.get("from") if isinstance(event.node, Table) else None
    return isinstance(given, Scalar) and given.text == "input"


def _is_time(declared: Declared) -> bool:
    """Tell whether this is a parameter that is a time, by its unit or its value."""
    if declared.kind != "parameter" or not isinstance(declared.node, Table):
        return False
    unit, value = declared.node.get("unit"), declared.node.get("value")
    if isinstance(unit, Scalar):
        return unit.text in SYMBOLS and SYMBOLS[unit.text][1] == TIME
    word = value.text.rpartition(" ")[2] if isinstance(value, Scalar) else ""
    return word in SYMBOLS and SYMBOLS[word][1] == TIME
