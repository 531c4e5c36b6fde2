"""Open documents: track the texts of the editor and schedule their checks one after another."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from lsprotocol import types

from language.text.document import lines_of
from modewright.lsp.background_check import run_background_check
from modewright.lsp.diagnostics import check_quickly
from modewright.lsp.positions import path_of
from modewright.lsp.workspace import Workspace, project_root_of

DEBOUNCE_SECONDS = 0.02
"""Time [s] without changes before a quick check."""
PROOF_DELAY_SECONDS = 0.5
"""Time [s] without changes before the slow checks."""

Publish = Callable[[str, int | None, list[types.Diagnostic]], None]
"""A function that sends diagnostics: URI, version, diagnostics."""


@dataclass(frozen=True)
class ProofResult:
    """The result of the slow checks of a text; it remains visible until the next one."""

    lines: tuple[str, ...]
    diagnostics: tuple[types.Diagnostic, ...]

    def unchanged_diagnostics(self, lines: tuple[str, ...]) -> list[types.Diagnostic]:
        """Return the diagnostics whose first line has the same text and number in `lines`."""
        places = [(each, each.range.start.line) for each in self.diagnostics]
        return [each for each, k in places if lines[k : k + 1] == self.lines[k : k + 1]]


@dataclass
class OpenDocuments:
    """The open files with their workspaces, pending checks and results."""

    publish: Publish
    encoding: str = "utf-16"
    workspaces: dict[Path, Workspace] = field(default_factory=dict)
    open_files: dict[Path, tuple[str, int | None]] = field(default_factory=dict)
    pending_checks: dict[Path, None] = field(default_factory=dict)
    pending_proofs: dict[Path, list[types.Diagnostic]] = field(default_factory=dict)
    proof_results: dict[Path, ProofResult] = field(default_factory=dict)
    check_task: asyncio.Task[None] | None = None
    proof_task: asyncio.Task[None] | None = None

    def workspace_of(self, uri: str) -> tuple[Workspace, Path]:
        """Return the workspace of the project of a file, and the path of the file.

        The workspace is created at the first call for a project.
        """
        path = path_of(uri)
        root = project_root_of(path)
        if root not in self.workspaces:
            self.workspaces[root] = Workspace(root, self.encoding)
        return self.workspaces[root], path

    def update(self, uri: str, version: int | None, text: str | None) -> None:
        """Store the new text of a file, restart pending slow checks and schedule quick checks.

        The file is checked first, then the other open files of its project. None as text closes the
        file: its diagnostics are cleared. `version` is published with the diagnostics. Must be
        called in an event loop.
        """
        workspace, path = self.workspace_of(uri)
        workspace.set_text(path, None if text is None else _replace_surrogates(text))
        if text is None:
            self.open_files.pop(path, None)
            self.pending_checks.pop(path, None)
            self.publish(uri, None, [])
        else:
            self.open_files[path] = uri, version
            self.pending_checks = {path: None, **self.pending_checks}
        others = (other for other in self.open_files if other != path and other in workspace.texts)
        self.pending_checks.update(dict.fromkeys(others))
        if self.proof_task:
            self.proof_task.cancel()
        if self.check_task is None or self.check_task.done():
            self.check_task = asyncio.get_running_loop().create_task(self._check())

    async def _check(self) -> None:
        """Run the pending quick checks, last change first.
        A result is discarded if the text changed meanwhile. Slow checks follow at the end.
        """
        while self.pending_checks:
            before = dict(self.open_files)
            await asyncio.sleep(DEBOUNCE_SECONDS)
            if self.open_files != before or not self.pending_checks:
                continue
            path = next(iter(self.pending_checks))
            del self.pending_checks[path]
            uri, version = self.open_files[path]
            workspace, _ = self.workspace_of(uri)
            found = await asyncio.to_thread(check_quickly, workspace, path)
            if self.open_files.get(path) == (uri, version):
                unchanged = (
                    self._unchanged_diagnostics(path, workspace) if _has_no_error(found) else []
                )
                self.publish(uri, version, [*found, *unchanged])
                if _has_no_error(found):
                    self.pending_proofs[path] = found
        self.proof_task = asyncio.get_running_loop().create_task(self._prove())

    def _unchanged_diagnostics(self, path: Path, workspace: Workspace) -> list[types.Diagnostic]:
        """Return the earlier results of slow checks on unchanged lines."""
        known = self.proof_results.get(path)
        return known.unchanged_diagnostics(lines_of(workspace.texts[path])) if known else []

    async def _prove(self) -> None:
        """Run the slow checks of texts without errors; the next change cancels this."""
        await asyncio.sleep(PROOF_DELAY_SECONDS)
        while self.pending_proofs:
            path, before = next(iter(self.pending_proofs.items()))
            if path in self.open_files:
                uri, version = self.open_files[path]
                workspace, _ = self.workspace_of(uri)
                found = await run_background_check(workspace, path)
                if found is not None:
                    more = tuple(each for each in found if each not in before)
                    self.proof_results[path] = ProofResult(lines_of(workspace.texts[path]), more)
                    self.publish(uri, version, found)
            self.pending_proofs.pop(path, None)


def _replace_surrogates(text: str) -> str:
    """Return a text with unpaired surrogates replaced, which no file can contain."""
    return text.encode("utf-16", "surrogatepass").decode("utf-16", "replace")


def _has_no_error(diagnostics: list[types.Diagnostic]) -> bool:
    """Return whether no diagnostic is an error."""
    return all(each.severity != types.DiagnosticSeverity.Error for each in diagnostics)
