"""Diagram elements: the elements of a diagram - regions, modes and transitions."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Literal

from modewright.diagram.label_text import ModeKind

ModePath = tuple[str, ...]
"""The path of a mode from the root."""

Shade = Literal["", "covered", "part", "missed"]
"""The test coverage of a mode or a transition; empty if unknown."""


@dataclass(frozen=True)
class Arrow:
    """A transition between two modes (paths from the root) with the lines of its label."""

    source: ModePath
    target: ModePath
    lines: tuple[str, ...]
    name: str = ""
    shade: Shade = ""


@dataclass(frozen=True)
class ModeBox:
    """A mode with its path, the lines of its content and its inner regions."""

    path: ModePath
    lines: tuple[str, ...]
    regions: tuple[RegionBox, ...] = ()
    shade: Shade = ""
    kind: ModeKind = ""

    @property
    def name(self) -> str:
        """The last key of the path."""
        return self.path[-1]


@dataclass(frozen=True)
class RegionBox:
    """A region with its modes and its initial mode; the name is empty for a single region."""

    name: str
    initial: str
    modes: tuple[ModeBox, ...]


def lift_arrow(arrow: Arrow) -> Arrow:
    """Return the arrow between the enclosing modes of both ends that are in the same region.

    Both paths are cut one key behind the common prefix of the paths to their parents. An end that
    is inside the mode at the cut is named in a line before the label: `from a.b`, `to a.b` (without
    the cut path). An arrow within one region does not change.
    """
    depth = 0
    for a, b in zip(arrow.source[:-1], arrow.target[:-1], strict=False):
        if a != b:
            break
        depth += 1
    source, target = arrow.source[: depth + 1], arrow.target[: depth + 1]
    lines = list(arrow.lines)
    if target != arrow.target:
        lines.insert(0, f"to {'.'.join(arrow.target[depth + 1 :])}")
    if source != arrow.source:
        lines.insert(0, f"from {'.'.join(arrow.source[depth + 1 :])}")
    return dataclasses.replace(arrow, source=source, target=target, lines=tuple(lines))
