"""Renamed: a project as it would be after a rename, looked at before anybody gets the edits."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path

from language.problem import Problem, Span
from modewright.checking import errors_first
from modewright.lsp.mention import mentions_of
from modewright.lsp.namespace import Declared
from modewright.lsp.world import World


class RenameRefused(Exception):
    """A name cannot be given; the message says why."""


def renamed(path: str, name: str) -> str:
    """Return the path of something that gets another name of its own."""
    outer, dot, _ = path.rpartition(".")
    return f"{outer}{dot}{name}"


def require_same_meaning(
    world: World, declared: Declared, spans: Sequence[Span], name: str
) -> None:
    """Raise RenameRefused where the new name means something else, or breaks what was right."""
    after = World(world.root, world.encoding, world.texts | _texts(spans, name))
    new = replace(declared, name=renamed(declared.name, name))
    if _lines(each.span for each in mentions_of(after, new)) != _lines(spans):
        raise RenameRefused(f"`{name}` would mean something else at one of the places")
    last = declared.name.rpartition(".")[2]
    edited = {Path(span.source.name).resolve() for span in spans}
    for path, document in world.documents():
        text = "\n".join(document.name_span.source.lines)
        if path in edited or re.search(rf"\b{last}\b", text):
            _require_no_new_error(world, after, path)


def _require_no_new_error(world: World, after: World, path: Path) -> None:
    broken = _errors(after, path)
    if not broken:
        return
    before = _errors(world, path)
    known = {each.label for each in before}
    if len(broken) > len(before):
        first = next((each for each in broken if each.label not in known), broken[0])
        raise RenameRefused(f"it is named where this is not followed: {first.span}: {first.label}")


def _errors(world: World, path: Path) -> list[Problem]:
    found = errors_first(str(path), world.root, world.texts).problems
    return [each for each in found if each.severity == "error"]


def _texts(spans: Sequence[Span], name: str) -> dict[Path, str]:
    """Return the texts of the files that are edited, with the new name in all places."""
    found: dict[Path, list[str]] = {}
    for span in sorted(spans, key=lambda each: (each.line, -each.column)):
        lines = found.setdefault(Path(span.source.name).resolve(), list(span.source.lines))
        text, start = lines[span.line - 1], span.column - 1
        lines[span.line - 1] = text[:start] + name + text[start + span.width :]
    return {path: "\n".join(lines) + "\n" for path, lines in found.items()}


def _lines(spans: Iterable[Span]) -> Counter[tuple[str, int]]:
    return Counter((each.source.name, each.line) for each in set(spans))
