"""Rename: where something is declared and named, and the edits that give it another name."""

from __future__ import annotations

from pathlib import Path

from lsprotocol import types

from language.model import CHART
from language.names import check_name
from language.problem import Problems
from language.project import shown
from modewright.lsp.hover import mention_at
from modewright.lsp.mention import Mention, mentions, mentions_of
from modewright.lsp.namespace import namespace
from modewright.lsp.positions import range_of, uri_of, written_at
from modewright.lsp.renamed import RenameRefused, renamed, require_same_meaning
from modewright.lsp.world import World


def definition(world: World, path: Path, position: types.Position) -> list[types.Location]:
    """Return where the thing at a position is declared; an equation of modes in each of them."""
    mention = mention_at(world, path, position)
    found = mentions(world, mention.declared.file) if mention else []
    return [
        _location(world, each)
        for each in found
        if mention and each.declared.identity == mention.declared.identity and each.is_declaration
    ]


def references(
    world: World, path: Path, position: types.Position, with_declaration: bool
) -> list[types.Location]:
    """Return where the thing at a position is named, in the whole project."""
    mention = mention_at(world, path, position)
    found = mentions_of(world, mention.declared) if mention else []
    return [_location(world, each) for each in found if with_declaration or not each.is_declaration]


def rename(world: World, path: Path, position: types.Position, name: str) -> types.WorkspaceEdit:
    """Return the edits that rename the thing at a position everywhere. Raises RenameRefused."""
    mention = mention_at(world, path, position)
    if mention is None:
        raise RenameRefused("there is nothing here that has a name")
    _check(world, mention, name)
    declared = mention.declared
    last = declared.name.rpartition(".")[2]
    if not last:
        raise RenameRefused("what stands inside a template is not followed")
    spans = list(dict.fromkeys(each.span for each in mentions_of(world, declared)))
    for span in spans:
        if written_at(span) != last:
            raise RenameRefused(f"{span}: the name is written over several lines")
    require_same_meaning(world, declared, spans, name)
    changes: dict[str, list[types.TextEdit]] = {}
    for span in spans:
        edit = types.TextEdit(range_of(span, world.encoding), name)
        changes.setdefault(uri_of(Path(span.source.name)), []).append(edit)
    return types.WorkspaceEdit(changes=changes)


def _check(world: World, mention: Mention, name: str) -> None:
    declared = mention.declared
    problems = Problems()
    check_name(name, mention.span, problems)
    if problems.found:
        raise RenameRefused(problems.found[0].label)
    if not world.is_ours(declared.file):
        raise RenameRefused(f"`{declared.name}` is declared in {shown(declared.file)}, not here")
    if (declared.group, declared.name) == ("region", CHART):
        raise RenameRefused(f"`{CHART}` is a word of the language: the region that `mode` tells of")
    new = renamed(declared.name, name)
    files = {Path(each.span.source.name).resolve() for each in mentions_of(world, declared)}
    for file in sorted(files):
        space = namespace(world, file)
        other = space.names.get((declared.group, new)) if space else None
        if other:
            raise RenameRefused(f"`{name}` is a name already: {other.span}")


def _location(world: World, mention: Mention) -> types.Location:
    where = range_of(mention.span, world.encoding)
    return types.Location(uri_of(Path(mention.span.source.name)), where)
