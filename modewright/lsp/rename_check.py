"""Rename check: check the project that a rename would produce before the edits are returned."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path

from language.text.diagnostic import Problem, Span
from modewright.api.spec_check import check_without_proofs
from modewright.lsp.reference import references_to
from modewright.lsp.symbol_table import Symbol
from modewright.lsp.workspace import Workspace


class RenameRefused(Exception):
    """A symbol cannot be renamed; the message states the reason."""


def replace_last_part(path: str, name: str) -> str:
    """Return a dotted path with `name` as its last part; `name` itself if there is no dot."""
    outer, dot, _ = path.rpartition(".")
    return f"{outer}{dot}{name}"


def require_same_meaning(
    workspace: Workspace, symbol: Symbol, spans: Sequence[Span], name: str
) -> None:
    """Raise RenameRefused if the new name denotes something else or causes errors.

    `spans` are the places to edit. They are edited in a copy of the workspace, where the renamed
    symbol must have as many references on each line as before. An edited file, or one that contains
    the old name, must not have more errors than before; slow checks are not run.
    """
    after = Workspace(
        workspace.root, workspace.encoding, workspace.texts | _edited_texts(spans, name)
    )
    new = replace(symbol, name=replace_last_part(symbol.name, name))
    if _count_lines(each.span for each in references_to(after, new)) != _count_lines(spans):
        raise RenameRefused(f"`{name}` would mean something else at one of the places")
    last = symbol.name.rpartition(".")[2]
    edited = {Path(span.source.name).resolve() for span in spans}
    for path, document in workspace.documents():
        text = "\n".join(document.name_span.source.lines)
        if path in edited or re.search(rf"\b{last}\b", text):
            _require_no_new_error(workspace, after, path)


def _require_no_new_error(workspace: Workspace, after: Workspace, path: Path) -> None:
    """Raise RenameRefused if a file has more errors than before."""
    broken = _find_errors(after, path)
    if not broken:
        return
    before = _find_errors(workspace, path)
    known = {each.label for each in before}
    if len(broken) > len(before):
        first = next((each for each in broken if each.label not in known), broken[0])
        raise RenameRefused(f"a reference to it is not recognised: {first.span}: {first.label}")


def _find_errors(workspace: Workspace, path: Path) -> list[Problem]:
    """Return the errors of a file without slow checks."""
    found = check_without_proofs(str(path), workspace.root, workspace.texts).problems
    return [each for each in found if each.severity == "error"]


def _edited_texts(spans: Sequence[Span], name: str) -> dict[Path, str]:
    """Return the texts of the edited files with the new name."""
    lines_by_file: dict[Path, list[str]] = {}
    for span in sorted(spans, key=lambda each: (each.line, -each.column)):
        lines = lines_by_file.setdefault(Path(span.source.name).resolve(), list(span.source.lines))
        text, start = lines[span.line - 1], span.column - 1
        lines[span.line - 1] = text[:start] + name + text[start + span.width :]
    return {path: "\n".join(lines) + "\n" for path, lines in lines_by_file.items()}


def _count_lines(spans: Iterable[Span]) -> Counter[tuple[str, int]]:
    """Return the number of spans in each line of each file."""
    return Counter((each.source.name, each.line) for each in set(spans))
