"""Desk: the open texts by project, and which of them are to be checked; one check at a time."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from lsprotocol import types

from language.document import lines_of
from modewright.lsp.positions import path_of
from modewright.lsp.problems import diagnostics
from modewright.lsp.proving import proven
from modewright.lsp.world import World, root_of

QUIET_SECONDS = 0.02
"""How long nothing must be written before a text is checked: what is pasted comes in one go."""
PAUSE_SECONDS = 0.5
"""How long nothing must be written before what takes long is looked for."""

Publish = Callable[[str, int | None, list[types.Diagnostic]], None]


@dataclass(frozen=True)
class Proven:
    """What took long to find of a text, with its lines: it is shown on until it is found anew."""

    lines: tuple[str, ...]
    found: tuple[types.Diagnostic, ...]

    def still(self, lines: tuple[str, ...]) -> list[types.Diagnostic]:
        """Return what lies on lines that are as they were."""
        places = [(each, each.range.start.line) for each in self.found]
        return [each for each, k in places if lines[k : k + 1] == self.lines[k : k + 1]]


@dataclass
class Desk:
    """What is open in the editor: worlds by folder, addresses and versions by file."""

    publish: Publish
    encoding: str = "utf-16"
    worlds: dict[Path, World] = field(default_factory=dict)
    opened: dict[Path, tuple[str, int | None]] = field(default_factory=dict)
    waiting: dict[Path, None] = field(default_factory=dict)
    unproven: dict[Path, list[types.Diagnostic]] = field(default_factory=dict)
    proofs: dict[Path, Proven] = field(default_factory=dict)
    checking: asyncio.Task[None] | None = None
    proving: asyncio.Task[None] | None = None

    def world(self, uri: str) -> tuple[World, Path]:
        """Return the project of a file, and its path."""
        path = path_of(uri)
        root = root_of(path)
        if root not in self.worlds:
            self.worlds[root] = World(root, self.encoding)
        return self.worlds[root], path

    def changed(self, uri: str, version: int | None, text: str | None) -> None:
        """Take a new text of a file (None: it is closed); it is checked soon, others after it."""
        world, path = self.world(uri)
        world.open(path, None if text is None else _whole(text))
        if text is None:
            self.opened.pop(path, None)
            self.waiting.pop(path, None)
            self.publish(uri, None, [])
        else:
            self.opened[path] = uri, version
            self.waiting = {path: None, **self.waiting}
        others = (other for other in self.opened if other != path and other in world.texts)
        self.waiting.update(dict.fromkeys(others))
        if self.proving:
            self.proving.cancel()
        if self.checking is None or self.checking.done():
            self.checking = asyncio.get_running_loop().create_task(self._check())

    async def _check(self) -> None:
        """Check what waits, what was changed last first; a text that changed meanwhile, again."""
        while self.waiting:
            before = dict(self.opened)
            await asyncio.sleep(QUIET_SECONDS)
            if self.opened != before or not self.waiting:
                continue
            path = next(iter(self.waiting))
            del self.waiting[path]
            uri, version = self.opened[path]
            world, _ = self.world(uri)
            found = await asyncio.to_thread(diagnostics, world, path)
            if self.opened.get(path) == (uri, version):
                kept = self._still(path, world) if _has_no_error(found) else []
                self.publish(uri, version, [*found, *kept])
                if _has_no_error(found):
                    self.unproven[path] = found
        self.proving = asyncio.get_running_loop().create_task(self._prove())

    def _still(self, path: Path, world: World) -> list[types.Diagnostic]:
        known = self.proofs.get(path)
        return known.still(lines_of(world.texts[path])) if known else []

    async def _prove(self) -> None:
        """Look for what takes long in the texts without errors; the next change ends this."""
        await asyncio.sleep(PAUSE_SECONDS)
        while self.unproven:
            path, before = next(iter(self.unproven.items()))
            if path in self.opened:
                uri, version = self.opened[path]
                world, _ = self.world(uri)
                found = await proven(world, path)
                if found is not None:
                    more = tuple(each for each in found if each not in before)
                    self.proofs[path] = Proven(lines_of(world.texts[path]), more)
                    self.publish(uri, version, found)
            self.unproven.pop(path, None)


def _whole(text: str) -> str:
    """Return a text with a sign in place of each half of a character, which no file can hold."""
    return text.encode("utf-16", "surrogatepass").decode("utf-16", "replace")


def _has_no_error(found: list[types.Diagnostic]) -> bool:
    return all(each.severity != types.DiagnosticSeverity.Error for each in found)
