"""References: find the places of a spec that refer to a symbol."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from language.ir.root_region import CHART
from language.text.diagnostic import Span
from modewright.lsp.mode_resolution import NamePart, Resolution, resolve_mode_parts, split_name
from modewright.lsp.name_occurrence import QUERIED_KINDS, NameOccurrence
from modewright.lsp.symbol_table import (
    Symbol,
    SymbolTable,
    column_name,
    load_symbol_table,
    mode_path,
)
from modewright.lsp.workspace import Workspace

STUDY_PREFIXES = ("initial", "inputs")
"""Prefixes of names in studies: `initial.plant.theta_d`, `inputs.T_req.start`."""
SPEC_LOCAL_KINDS = ("template", "fault")
"""Sorts of names that are local to a spec; the event of a study is a mode."""
INSTANCE_SECTIONS = (("values",), ("inputs",))
"""Sections of an instance whose keys are names of the instance."""
SPEC_TARGETS = ("automaton", "system", "scenario", "map", "calibration", "spec", "effect")
"""Sorts of names that denote files."""


@dataclass(frozen=True)
class Reference:
    """A part of a name that refers to a symbol; `path` are the keys that lead to it."""

    symbol: Symbol
    span: Span
    path: tuple[str, ...]
    is_key: bool

    @property
    def is_declaration(self) -> bool:
        """Whether this declares the symbol.

        Besides the place of the symbol these are, for an equation, its keys in all modes of the
        declaring file.
        """
        is_equation = self.is_key and self.path[-2:-1] == ("equations",)
        return self.span == self.symbol.span or (is_equation and self.is_in_declaring_file)

    @property
    def is_in_declaring_file(self) -> bool:
        """Whether this is in the file that declares the symbol."""
        return Path(self.span.source.name).resolve() == self.symbol.file


def find_references(workspace: Workspace, path: Path) -> list[Reference]:
    """Return the references to known symbols in a spec, in the order of the file.

    Each part of a dotted name is a reference of its own; unknown parts are left out. Empty if the
    spec was never valid.
    """
    symbols = load_symbol_table(workspace, path)
    result = []
    for name in workspace.names(path) if symbols else ():
        assert symbols is not None
        for (offset, part), symbol in resolve_name(workspace, symbols, name):
            if symbol:
                span = name.span.subspan(offset, len(part))
                result.append(Reference(symbol, span, name.path, name.is_key))
    return result


def references_to(workspace: Workspace, symbol: Symbol) -> list[Reference]:
    """Return all references to a symbol, declarations included, in the project and its own file.

    Those of the file that declares it come first, then those of other files sorted by path.
    """
    files = dict.fromkeys((symbol.file, *(path for path, _ in workspace.documents())))
    return [
        reference
        for path in files
        for reference in find_references(workspace, path)
        if reference.symbol.identity == symbol.identity
    ]


def resolve_name(workspace: Workspace, symbols: SymbolTable, name: NameOccurrence) -> Resolution:
    """Yield the parts of a name with the symbols that they denote, None for an unknown part.

    The kind of the name decides where it is searched: the files of the project, modes, columns,
    templates, faults and events, else values, instances and modes. A name that is not dotted or
    denotes a file is one part. May yield nothing for unknown names.
    """
    whole = (0, name.text)
    if name.kind in SPEC_TARGETS:
        yield whole, _resolve_spec(workspace, symbols, name)
    elif name.kind in ("mode", "region") and name.path[-2:-1] in (("modes",), ("regions",)):
        yield whole, _symbol_of_key(symbols, name)
    elif name.kind == "mode" and name.owner is not None:
        yield from _resolve_mode(*_split_instance(symbols, name.owner), split_name(name.text))
    elif name.kind == "mode":
        yield from resolve_mode_parts(symbols, split_name(name.text), name.path)
    elif name.kind == "column":
        yield whole, symbols.names.get(("column", column_name(name.path, name.text)))
    elif name.kind in SPEC_LOCAL_KINDS or (
        name.kind == "event" and (name.kind, name.text) in symbols.names
    ):
        yield whole, symbols.names.get((name.kind, name.text))
    else:
        parts = split_name(name.text)
        if name.kind == "model_mode":
            yield from _resolve_model_mode(symbols, parts)
            return
        region = region_of(symbols, name.owner or "") if name.kind == "compared" else None
        if region:
            yield from _resolve_mode(*region, parts)
            return
        if name.kind == "signal" and "measures" in name.path and symbols.model:
            symbols = symbols.model
        if name.path[:1] == ("instances",) and name.is_key and name.path[2:3] in INSTANCE_SECTIONS:
            symbols = symbols.instances.get(name.path[1], symbols)
        if symbols.document.kind == "study" and parts[0][1] in STUDY_PREFIXES:
            parts = parts[1:]
        yield from _resolve_value(symbols, parts, name)


def _resolve_spec(
    workspace: Workspace, symbols: SymbolTable, name: NameOccurrence
) -> Symbol | None:
    """Return the symbol of a file by name; None if there is none."""
    if name.text == symbols.document.name:
        return symbols.names.get(("spec", name.text))
    path = workspace.find_file(name.text, symbols.file, is_effect=name.kind == "effect")
    document = workspace.document(path) if path else None
    if path is None or document is None or document.name != name.text:
        return None
    return Symbol(path, "spec", name.text, document.kind, document.name_span, document)


def _symbol_of_key(symbols: SymbolTable, name: NameOccurrence) -> Symbol | None:
    """Return the mode or region that a key declares."""
    inner = mode_path(name.path) if name.path[-2:] != ("regions", CHART) else CHART
    return symbols.names.get((name.kind, inner))


def _resolve_value(
    symbols: SymbolTable, parts: Sequence[NamePart], name: NameOccurrence
) -> Resolution:
    """Yield the symbols of a name in an expression; arguments of `in` are modes."""
    if not parts:
        return
    head, *rest = parts
    symbol = (
        symbols.names.get(("value", head[1]))
        if name.kind not in QUERIED_KINDS.values() or rest
        else None
    )
    if symbol is None and head[1] in symbols.instances:
        symbol = symbols.names.get(("spec", head[1]))  # an automaton alone is its own instance
    if head[1] in symbols.instances and rest:
        yield head, symbol
        yield from _resolve_value(symbols.instances[head[1]], rest, replace(name, path=()))
    elif symbols.model and rest and head[1] == symbols.model.document.name:
        yield from _resolve_model_mode(symbols, parts)
    elif name.kind == "asked_fault":
        yield head, symbols.names.get(("fault", head[1]))
    elif symbol and not rest:
        yield head, symbol
    else:
        found = list(resolve_mode_parts(symbols, parts, name.path))
        event = None if rest or found else symbols.names.get(("event", head[1]))
        yield from found or [(head, event or symbol)]


def region_of(symbols: SymbolTable, path: str) -> tuple[SymbolTable, str] | None:
    """Return the symbol table and the region whose mode a name denotes; None for other names.

    Such names are `mode` (the region is empty), `gap` for a region of that name, both with an
    instance as prefix, and each of them with `.mode`: `est.mode`, `est.gap`, `est.gap.mode`.
    """
    inner, region = _split_instance(symbols, path)
    if region.rpartition(".")[2] == "mode":
        return inner, region.rpartition(".")[0]
    return (inner, region) if ("region", region) in inner.names else None


def _split_instance(symbols: SymbolTable, path: str) -> tuple[SymbolTable, str]:
    """Return the symbol table of the instance at the start of a path, and the rest of the path."""
    head, _, region = path.partition(".")
    return (symbols.instances[head], region) if head in symbols.instances else (symbols, path)


def _resolve_mode(symbols: SymbolTable, region: str, parts: Sequence[NamePart]) -> Resolution:
    """Yield the symbols of the name of a mode in a region; an empty region is the main one."""
    before = split_name(region) if region else []
    found = list(resolve_mode_parts(symbols, [*before, *parts]))
    yield from found[len(before) :]


def _resolve_model_mode(symbols: SymbolTable, parts: Sequence[NamePart]) -> Resolution:
    """Yield the symbols of the name of a mode of the model, with the model's name as prefix."""
    model = symbols.model
    if model and len(parts) > 1 and parts[0][1] == model.document.name:
        yield parts[0], model.names.get(("spec", parts[0][1]))
        yield from resolve_mode_parts(model, parts[1:])
