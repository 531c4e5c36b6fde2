"""Desk: the open texts by project, and which of them are to be checked; one check at a time."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from lsprotocol import types

from modewright.lsp.positions import path_of
from modewright.lsp.problems import diagnostics
from modewright.lsp.world import World, root_of

QUIET_SECONDS = 0.02
"""How long nothing must be written before a text is checked: what is pasted comes in one go."""

Publish = Callable[[str, int | None, list[types.Diagnostic]], None]


@dataclass
class Desk:
    """What is open in the editor: worlds by folder, addresses and versions by file."""

    publish: Publish
    encoding: str = "utf-16"
    worlds: dict[Path, World] = field(default_factory=dict)
    opened: dict[Path, tuple[str, int | None]] = field(default_factory=dict)
    waiting: dict[Path, None] = field(default_factory=dict)
    task: asyncio.Task[None] | None = None

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
        world.open(path, text)
        if text is None:
            self.opened.pop(path, None)
            self.waiting.pop(path, None)
            self.publish(uri, None, [])
        else:
            self.opened[path] = uri, version
            self.waiting = {path: None, **self.waiting}
        others = (other for other in self.opened if other != path and other in world.texts)
        self.waiting.update(dict.fromkeys(others))
        self._begin()

    def _begin(self) -> None:
        if self.task is None or self.task.done():
            self.task = asyncio.get_running_loop().create_task(self._check())

    async def _check(self) -> None:
        """Check what waits, what was changed last first; a text that changed meanwhile, again."""
        while self.waiting:
            before = dict(self.opened)
            await asyncio.sleep(QUIET_SECONDS)
            if self.opened != before:
                continue
            path = next(iter(self.waiting), None)
            if path is None:
                continue
            del self.waiting[path]
            uri, version = self.opened[path]
            world, _ = self.world(uri)
            found = await asyncio.to_thread(diagnostics, world, path)
            if self.opened.get(path) == (uri, version):
                self.publish(uri, version, found)
