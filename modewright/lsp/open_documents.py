"""Desk: the open texts by project, and which of them are to be checked; one check at a time."""

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
"""How long nothing must be written before a text is checked: what is pasted comes in one go."""
PROOF_DELAY_SECONDS = 0.5
"""How long nothing must be written before what takes long is looked for."""

Publish = Callable[[str, int | None, list[types.Diagnostic]], None]


@dataclass(frozen=True)
class ProofResult:
    """What took long to find of a text, with its lines: it is shown on until it is found anew."""

    lines: tuple[str, ...]
    diagnostics: tuple[types.Diagnostic, ...]

    def unchanged_diagnostics(self, lines: tuple[str, ...]) -> list[types.Diagnostic]:
        """Return what lies on lines that are as they were."""
        places = [(each, each.range.start.line) for each in self.diagnostics]
        return [each for each, k in places if lines[k : k + 1] == self.lines[k : k + 1]]


@dataclass
class OpenDocuments:
    """What is open in the editor: worlds by folder, addresses and versions by file."""

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
        """Return the project of a file, and its path."""
        path = path_of(uri)
        root = project_root_of(path)
        if root not in self.workspaces:
            self.workspaces[root] = Workspace(root, self.encoding)
        return self.workspaces[root], path

    def update(self, uri: str, version: int | None, text: str | None) -> None:
        """Take a new text of a file (None: it is closed); it is checked soon, others after it."""
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
        """Check what waits, what was changed last first; a text that changed meanwhile, again."""
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
        known = self.proof_results.get(path)
        return known.unchanged_diagnostics(lines_of(workspace.texts[path])) if known else []

    async def _prove(self) -> None:
        """Look for what takes long in the texts without errors; the next change ends this."""
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
    """Return a text with a sign in place of each half of a character, which no file can hold."""
    return text.encode("utf-16", "surrogatepass").decode("utf-16", "replace")


def _has_no_error(diagnostics: list[types.Diagnostic]) -> bool:
    return all(each.severity != types.DiagnosticSeverity.Error for each in diagnostics)
