"""Expected symbols: determine the names that fit where a certain sort of name is required.

Examples are modes after `est.mode ==` and words after an enumeration.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from language.expressions.unit_symbols import SYMBOLS, TIME
from language.text.document import MappingNode, ScalarNode, SequenceNode
from modewright.editing.node_kinds import Place
from modewright.lsp.reference import region_of
from modewright.lsp.symbol_table import Symbol, SymbolTable

DECLARING_SECTIONS = ("inputs", "discrete", "parameters")
"""Sections whose entries contain values of the declared name."""
VALUE_KEYS = ("initial", "default", "value", "start")
"""The keys of these values, besides the times of `steps`."""
NamedSymbol = tuple[str, Symbol]
"""A proposed name and its symbol."""


def expected_symbols(symbols: SymbolTable, place: Place, before: str) -> list[NamedSymbol] | None:
    """Return the names that fit at a place with their symbols; None if any name is possible.

    `before` is the text of the line before the word. Restricted are: arguments of `in(` and
    `fault(`, the other side of `==` and `!=` with a mode or an enumeration, expected modes of
    tests, events of `raise` and `event`, times of `wait`, and values of enumerations.
    """
    query = re.search(r"\b(in|fault)\(\s*$", before)
    if query:
        return list(
            qualified_modes(symbols)
            if query[1] == "in"
            else _qualified_symbols(symbols, ("fault",))
        )
    comparison = re.search(r"([\w.$]+)\s*[!=]=\s*$", before)
    if comparison:
        return _comparable_symbols(symbols, comparison[1])
    if place.path[:1] == ("expect",) and place.section == "modes":
        return _testable_modes(symbols, place.path)
    if place.section == "raise":
        return [
            (each.name, each) for each in symbols.in_groups("event") if not _is_input_event(each)
        ]
    if place.section == "event" and symbols.document.kind != "test":
        return [(each.name, each) for each in symbols.in_groups("event")]
    if place.section == "wait":
        return [(each.name, each) for each in symbols.in_groups("value") if _is_time(each)]
    assigned_name = _assigned_name_of(place.path)
    return _enum_symbols(symbols, assigned_name) if assigned_name else None


def qualified_modes(symbols: SymbolTable) -> Iterator[NamedSymbol]:
    """Yield the modes by path: own ones, those of instances, those of the model.

    The names of the last two have the name of the instance or model and a dot as prefix.
    """
    yield from _qualified_symbols(symbols, ("mode",))
    if symbols.model:
        for each in symbols.model.in_groups("mode"):
            yield f"{symbols.model.document.name}.{each.name}", each


def _qualified_symbols(symbols: SymbolTable, groups: tuple[str, ...]) -> Iterator[NamedSymbol]:
    """Yield the symbols of groups, including those of instances with prefixes."""
    yield from ((each.name, each) for each in symbols.in_groups(*groups))
    for name, inner in symbols.instances.items():
        yield from ((f"{name}.{each.name}", each) for each in inner.in_groups(*groups))


def _comparable_symbols(symbols: SymbolTable, path: str) -> list[NamedSymbol] | None:
    """Return the modes of a region, or the words of an enumeration; None for other names."""
    region = region_of(symbols, path)
    if region is None:
        return _enum_symbols(symbols, path)
    inner, name = region
    regions = [
        each.name for each in inner.in_groups("region") if each.name and each.name != "chart"
    ]
    own = f"{name}." if name else ""
    others = tuple(f"{each}." for each in regions if not own.startswith(f"{each}."))
    return [
        (each.name.removeprefix(own), each)
        for each in inner.in_groups("mode")
        if each.name.startswith(own) and not each.name.startswith(others)
    ]


def _testable_modes(symbols: SymbolTable, path: tuple[str, ...]) -> list[NamedSymbol] | None:
    """Return the leaf modes of the region of an expectation."""
    expected = symbols.document.root.get("expect")
    own = expected.get(path[1]) if isinstance(expected, MappingNode) else None
    of = own.get("of") if isinstance(own, MappingNode) else None
    region = of.text if isinstance(of, ScalarNode) else ""
    found = _comparable_symbols(symbols, region) or _comparable_symbols(
        symbols, f"{region}.mode".removeprefix(".")
    )
    outer = tuple(name for name, _ in found or ())
    return found and [
        (name, each) for name, each in found if not any(o.startswith(f"{name}.") for o in outer)
    ]


def _assigned_name_of(path: tuple[str, ...]) -> str:
    """Return the name whose value is at a path; empty if there is none."""
    if len(path) > 2 and path[0] in DECLARING_SECTIONS:
        return path[1] if path[2] in VALUE_KEYS or path[2:3] == ("steps",) else ""
    return path[-1] if path else ""


def _enum_symbols(symbols: SymbolTable, path: str) -> list[NamedSymbol] | None:
    """Return the words of an enumeration and the symbols with the same words; None for others."""
    values = list(_qualified_symbols(symbols, ("value",)))
    of = next((each for name, each in values if name == path and _enum_words(each)), None)
    if of is None:
        return None
    words = _enum_words(of)
    others = [(name, each) for name, each in values if each.identity != of.identity]
    same = [(name, each) for name, each in others if _enum_words(each) == words]
    return [*((word, of) for word in words), *same]


def _enum_words(symbol: Symbol) -> list[str]:
    """Return the words of an enumeration; empty for other symbols."""
    values = symbol.node.get("values") if isinstance(symbol.node, MappingNode) else None
    nodes = values.nodes if isinstance(values, SequenceNode) else ()
    return [node.text for node in nodes if isinstance(node, ScalarNode)]


def _is_input_event(event: Symbol) -> bool:
    """Return whether an event comes from an input."""
    given = event.node.get("from") if isinstance(event.node, MappingNode) else None
    return isinstance(given, ScalarNode) and given.text == "input"


def _is_time(symbol: Symbol) -> bool:
    """Return whether a symbol is a parameter that is a time, by its unit or value."""
    if symbol.kind != "parameter" or not isinstance(symbol.node, MappingNode):
        return False
    unit, value = symbol.node.get("unit"), symbol.node.get("value")
    if isinstance(unit, ScalarNode):
        return unit.text in SYMBOLS and SYMBOLS[unit.text][1] == TIME
    word = value.text.rpartition(" ")[2] if isinstance(value, ScalarNode) else ""
    return word in SYMBOLS and SYMBOLS[word][1] == TIME
