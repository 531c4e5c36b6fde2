"""Mutant: a small mistake in one of the two back ends, or in what one of them is given."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, Literal

import pytest

from language.ir.ops import Block, Op
from language.ir.program import Program
from language.ir.rewrite_ops import map_operations

Patch = Callable[[pytest.MonkeyPatch], None]
Change = Callable[[Op], Block]


def unpatched(patch: pytest.MonkeyPatch) -> None:
    """Change nothing."""


def same(program: Program) -> Program:
    """Return the Program as it is."""
    return program


@dataclass(frozen=True)
class Mutant:
    """`patch` while one side works; `rewrite` of the Program that this side is given."""

    name: str
    side: Literal["interpreter", "generator"]
    patch: Patch = unpatched
    rewrite: Callable[[Program], Program] = same


def item(name: str, key: str, value: Any) -> Patch:
    """Return a patch of an entry of a mapping, given as `module.NAME`."""

    def apply(patch: pytest.MonkeyPatch) -> None:
        module, _, attribute = name.rpartition(".")
        holder = __import__(module, fromlist=[attribute])
        patch.setitem(getattr(holder, attribute), key, value)

    return apply


def attribute(name: str, value: Any) -> Patch:
    """Return a patch of an attribute, given as `module.name`."""
    return lambda patch: patch.setattr(name, value)


def rewrite_operations(change: Change) -> Callable[[Program], Program]:
    """Return what replaces each operation of a Program by some."""

    def rewrite(program: Program) -> Program:
        blocks = {name: map_operations(block, change) for name, block in program.blocks.items()}
        return dataclasses.replace(program, blocks=blocks)

    return rewrite


def drop_lines(text: str) -> Callable[[Callable[..., Iterator[str]]], Callable[..., Any]]:
    """Return what makes of a generator of lines one that leaves some out."""

    def outer(made: Callable[..., Iterator[str]]) -> Callable[..., Any]:
        return lambda *words: [line for line in made(*words) if line.strip() != text]

    return outer
