"""Rename: find the declaration and the references of a symbol, and rename it."""

from __future__ import annotations

from pathlib import Path

from lsprotocol import types

from language.expressions.name_rules import check_name
from language.ir.root_region import CHART
from language.overlays.expand_document import display_path
from language.text.diagnostic import Problems
from modewright.lsp.hover import reference_at
from modewright.lsp.positions import range_of, source_text, uri_of
from modewright.lsp.reference import Reference, find_references, references_to
from modewright.lsp.rename_check import RenameRefused, replace_last_part, require_same_meaning
from modewright.lsp.symbol_table import load_symbol_table
from modewright.lsp.workspace import Workspace


def definition(workspace: Workspace, path: Path, position: types.Position) -> list[types.Location]:
    """Return the declarations of the symbol at a position, all in the file of the symbol.

    An equation may have several; empty if there is no symbol.
    """
    reference = reference_at(workspace, path, position)
    found = find_references(workspace, reference.symbol.file) if reference else []
    return [
        _location(workspace, each)
        for each in found
        if reference and each.symbol.identity == reference.symbol.identity and each.is_declaration
    ]


def references(
    workspace: Workspace, path: Path, position: types.Position, with_declaration: bool
) -> list[types.Location]:
    """Return the places in the project that refer to the symbol at a position.

    Declarations are left out unless `with_declaration`; empty if there is no symbol.
    """
    reference = reference_at(workspace, path, position)
    found = references_to(workspace, reference.symbol) if reference else []
    return [
        _location(workspace, each) for each in found if with_declaration or not each.is_declaration
    ]


def rename(
    workspace: Workspace, path: Path, position: types.Position, name: str
) -> types.WorkspaceEdit:
    """Return the edits that give the symbol at a position the new last part `name` everywhere.

    Raises RenameRefused if there is no symbol, the name is invalid or used, the symbol is outside
    the project, in a template or the main region, its name is broken over lines, or the new name
    would mean something else or cause errors.
    """
    reference = reference_at(workspace, path, position)
    if reference is None:
        raise RenameRefused("there is nothing here that has a name")
    _require_renamable(workspace, reference, name)
    symbol = reference.symbol
    last = symbol.name.rpartition(".")[2]
    if not last:
        raise RenameRefused("names inside a template cannot be renamed")
    spans = list(dict.fromkeys(each.span for each in references_to(workspace, symbol)))
    for span in spans:
        if source_text(span) != last:
            raise RenameRefused(f"{span}: the name is written over several lines")
    require_same_meaning(workspace, symbol, spans, name)
    changes: dict[str, list[types.TextEdit]] = {}
    for span in spans:
        edit = types.TextEdit(range_of(span, workspace.encoding), name)
        changes.setdefault(uri_of(Path(span.source.name)), []).append(edit)
    return types.WorkspaceEdit(changes=changes)


def _require_renamable(workspace: Workspace, reference: Reference, name: str) -> None:
    """Raise RenameRefused for an invalid or used name, and for symbols outside the project."""
    symbol = reference.symbol
    problems = Problems()
    check_name(name, reference.span, problems)
    if problems.reported:
        raise RenameRefused(problems.reported[0].label)
    if not workspace.is_in_project(symbol.file):
        raise RenameRefused(f"`{symbol.name}` is declared in {display_path(symbol.file)}, not here")
    if (symbol.group, symbol.name) == ("region", CHART):
        raise RenameRefused(f"`{CHART}` is a word of the language: the region of the signal `mode`")
    new = replace_last_part(symbol.name, name)
    files = {Path(each.span.source.name).resolve() for each in references_to(workspace, symbol)}
    for file in sorted(files):
        symbols = load_symbol_table(workspace, file)
        other = symbols.names.get((symbol.group, new)) if symbols else None
        if other:
            raise RenameRefused(f"`{name}` is a name already: {other.span}")


def _location(workspace: Workspace, reference: Reference) -> types.Location:
    """Return the location of a reference."""
    where = range_of(reference.span, workspace.encoding)
    return types.Location(uri_of(Path(reference.span.source.name)), where)
