"""Site: where a mode is read - its key path, its region, and what is around it."""

from __future__ import annotations

from dataclasses import dataclass

from language.model import Mode


@dataclass(frozen=True)
class ModeContext:
    """Where a mode stands.

    `position` counts the modes of the region before it; `above` is the mode around it, if any;
    `holds_modes` tells that there are modes inside, which may come to an end.
    """

    key: str
    region: str
    position: int
    parent: Mode | None = None
    has_inner_modes: bool = False
