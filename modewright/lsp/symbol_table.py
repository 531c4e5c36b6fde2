"""Symbol table: the names of a spec including those of its base, model and instances."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from language.ir.root_region import CHART
from language.text.diagnostic import Span
from language.text.document import Document, Entry, MappingNode, ScalarNode
from language.text.node_edit import mapping_entries
from modewright.editing.key_shape import MappingOf
from modewright.editing.node_kinds import places
from modewright.lsp.workspace import Workspace, root_text

VALUE_SECTIONS = {
    "parameters": "parameter",
    "inputs": "input",
    "states": "state",
    "discrete": "discrete variable",
    "equations": "equation",
    "sensors": "sensor",
    "instances": "instance",
    "outputs": "output",
    "measures": "measure",
    "vary": "what varies",
}
"""Sections that declare names for expressions, with the kind of each."""
OTHER_SECTIONS = {
    "modes": "mode",
    "regions": "region",
    "templates": "template",
    "faults": "fault",
    "events": "event",
}
"""Sections that declare other names, with the group of each."""
MAX_DEPTH = 20
"""Largest depth of bases, models and instances."""


@dataclass(frozen=True)
class Symbol:
    """A named thing with the place of its declaration.

    `group` is `value`, `mode`, `region`, `template`, `fault`, `event`, `column` or `spec`. The name
    of a mode or region is its path.
    """

    file: Path
    group: str
    name: str
    kind: str
    span: Span
    node: object = field(compare=False, repr=False, default=None)

    @property
    def identity(self) -> tuple[Path, str, str]:
        """The file, group and name; two symbols are the same if these are equal."""
        return self.file, self.group, self.name


@dataclass
class SymbolTable:
    """The symbols of a spec by group and name."""

    file: Path
    document: Document
    names: dict[tuple[str, str], Symbol] = field(default_factory=dict)
    instances: dict[str, SymbolTable] = field(default_factory=dict)
    model: SymbolTable | None = None
    target: SymbolTable | None = None

    @property
    def is_automaton(self) -> bool:
        """Whether the names contain an automaton: the spec itself, or one to which it refers.

        References are the base, or the spec `of` a scenario, study or calibration and of a test's
        scenario.
        """
        return ("spec", "automaton") in {(each.group, each.kind) for each in self.names.values()}

    def in_groups(self, *groups: str) -> list[Symbol]:
        """Return the symbols of the named groups in the order in which they were added.

        Symbols of instances and of the model are in their own tables.
        """
        return [each for (group, _), each in self.names.items() if group in groups]


def load_symbol_table(workspace: Workspace, path: Path, depth: int = 0) -> SymbolTable | None:
    """Return the symbol table of a file; None if it was never valid or `depth` is over MAX_DEPTH.

    `depth` counts the references (bases, models, instances) that led to the file.
    """
    document = workspace.document(path)
    if document is None or depth > MAX_DEPTH:
        return None
    return build_symbol_table(workspace, path, document, depth)


def build_symbol_table(
    workspace: Workspace, path: Path, document: Document, depth: int = 0
) -> SymbolTable:
    """Return the symbol table of a document, with the names of the specs to which it refers.

    These are its base (`extends`), parameters, states and inputs of its model, and all names of the
    system `of` or of a test's scenario; they take precedence over its own. A study also has the
    parameters of its instances without prefix. Specs that cannot be read are left out. `depth`
    counts the references that led to it.
    """
    symbols = SymbolTable(path.resolve(), document)
    base = _referenced_symbols(workspace, symbols, "extends", depth)
    if base:
        symbols.names.update(base.names)
        symbols.instances.update(base.instances)
        symbols.model, symbols.target = base.model, base.target
    model = _referenced_symbols(workspace, symbols, "model", depth)
    if model:
        symbols.model = model
        shared = ("parameter", "state", "input")
        for each in model.in_groups("value"):
            if each.kind in shared:
                symbols.names[each.group, each.name] = each
    target = _referenced_symbols(workspace, symbols, "of", depth) or _tested_symbols(
        workspace, symbols, depth
    )
    if target:
        symbols.target = target
        symbols.names.update(target.names)
        symbols.instances.update(target.instances)
        if target.is_automaton:  # a lone automaton is an instance with its own name
            symbols.instances[target.document.name] = target
    if document.kind == "study":  # a name without instance refers to all instances
        for inner in symbols.instances.values():
            for each in inner.in_groups("value"):
                if each.kind == "parameter":
                    symbols.names.setdefault((each.group, each.name), each)
    for symbol in _iter_symbols(symbols.file, document):
        symbols.names.setdefault((symbol.group, symbol.name), symbol)
    _add_instances(workspace, symbols, depth)
    return symbols


def _tested_symbols(workspace: Workspace, symbols: SymbolTable, depth: int) -> SymbolTable | None:
    """Return the symbols of the system of a test's scenario, named or inline; None for others."""
    if symbols.document.kind != "test":
        return None
    written = symbols.document.root.get("scenario")
    if isinstance(written, MappingNode):
        of = written.get("of")
        path = workspace.find_file(of.text, symbols.file) if isinstance(of, ScalarNode) else None
        return load_symbol_table(workspace, path, depth + 1) if path else None
    scenario = _referenced_symbols(workspace, symbols, "scenario", depth)
    return scenario.target if scenario else None


def _referenced_symbols(
    workspace: Workspace, symbols: SymbolTable, key: str, depth: int
) -> SymbolTable | None:
    """Return the symbols of the spec to which a key refers; None if there is none."""
    name = root_text(symbols.document, key)
    path = workspace.find_file(name, symbols.file) if name else None
    return load_symbol_table(workspace, path, depth + 1) if path else None


def _add_instances(workspace: Workspace, symbols: SymbolTable, depth: int) -> None:
    """Add the symbol tables of the instances."""
    for entry in mapping_entries(symbols.document.root.get("instances")):
        of = entry.node.get("of") if isinstance(entry.node, MappingNode) else None
        path = workspace.find_file(of.text, symbols.file) if isinstance(of, ScalarNode) else None
        inner = load_symbol_table(workspace, path, depth + 1) if path else None
        if inner:
            symbols.instances[entry.key] = inner


def _iter_symbols(file: Path, document: Document) -> Iterator[Symbol]:
    """Yield the symbols that a document declares."""
    yield Symbol(file, "spec", document.name, document.kind, document.name_span, document)
    is_calibration = document.kind in ("calibration", "scenario")
    for place in places(document.root):
        if not isinstance(place.node, MappingNode) or not isinstance(place.kind, MappingOf):
            continue
        for entry in place.node:
            symbol = None if is_calibration else _make_symbol(file, place.path, entry)
            if symbol:
                yield symbol


def _make_symbol(file: Path, path: tuple[str, ...], entry: Entry) -> Symbol | None:
    """Return the symbol that an entry declares; None if it declares none."""
    section = path[-1] if path else ""
    if entry.key.startswith("$"):
        return None
    is_inner = "observer" in path or "redirect" in path
    is_value = len(path) == 1 or section == "equations"
    if section in VALUE_SECTIONS and not is_inner and is_value:
        word = VALUE_SECTIONS[section]
        return Symbol(file, "value", entry.key, word, entry.text_span, entry.node)
    if section == "columns" and "transition_table" in path:
        name = column_name(path, entry.key)
        return Symbol(file, "column", name, "column of a table", entry.text_span, entry.node)
    if section in OTHER_SECTIONS:
        word = OTHER_SECTIONS[section]
        name = _symbol_name(word, path, entry.key)
        return Symbol(file, word, name, word, entry.text_span, entry.node)
    return None


def _symbol_name(word: str, path: tuple[str, ...], key: str) -> str:
    """Return the name of a symbol: the path of a mode or region, else the key."""
    if word == "mode" or (word == "region" and key != CHART):
        return mode_path((*path, key))
    return key


def mode_path(path: tuple[str, ...]) -> str:
    """Return the path of the mode to which keys lead, joined with dots; empty for no mode.

    Examples are `gap`, `tyre.upper` in a region and `drive.creep` nested. The region `chart` does
    not appear; keys below the mode are ignored.
    """
    found: list[str] = []
    k = 0
    while k + 1 < len(path) and path[k] in ("modes", "regions"):
        if not (path[k] == "regions" and path[k + 1] == CHART):
            found.append(path[k + 1])
        k += 2
    return ".".join(found)


def column_name(path: tuple[str, ...], key: str) -> str:
    """Return `mode.key` for a column of the transition table at a path, which makes it unique.

    The mode is empty for a table at the root.
    """
    return f"{mode_path(path)}.{key}"
