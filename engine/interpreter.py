"""Interpreter: runs the blocks of a Program, each operation as a closure over one frame."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from operator import itemgetter
from typing import Any, Protocol

from engine.arithmetic import ARITHMETIC
from engine.closures import Compiler
from engine.frame import LEFT_RANGE
from engine.shapes import Frame
from language.program import Program


class Stepper(Protocol):
    """What the engine needs of something that runs a Program."""

    def get(self, name: str) -> Any:
        """Return the value of a variable."""

    def set(self, name: str, value: float | int | bool) -> None:
        """Set a variable."""

    def run(self, block: str) -> None:
        """Run a block of the Program."""

    def reader(self, names: tuple[str, ...]) -> Callable[[], tuple[Any, ...]]:
        """Return a function that returns the values of some variables."""

    def left(self) -> tuple[str, ...]:
        """Return the signals that left their range since this was asked last."""


class Interpreter:
    """A Program with its frame of values. Variables start at 0 or false, `init` has run."""

    def __init__(self, program: Program) -> None:
        """Take the closures. `X_Derive` and `X_Init` of the C code are run here too."""
        self.program = program
        compiler = _closures_of(_Same(program))
        self._slots = compiler.scope.slots
        self._blocks = compiler.blocks
        self._real = compiler.reals
        self._arithmetic = ARITHMETIC[program.number]
        self._is_plain = program.number == "float64"
        self._frame: Frame = compiler.scope.frame()
        for entry in ("derive", "init"):
            if entry in self._blocks:
                self.run(entry)

    def get(self, name: str) -> Any:
        """Return the value of a variable or constant, `group.name`."""
        value = self._frame[self._slots[name]]
        return value if self._is_plain else self._arithmetic.plain(value)

    def set(self, name: str, value: float | int | bool) -> None:
        """Set a variable; a real is rounded to the number type, once."""
        if name in self._real:
            if self._is_plain:
                value = float(value)
            else:
                with self._arithmetic.quiet():
                    value = self._arithmetic.real(value)
        self._frame[self._slots[name]] = value

    def left(self) -> tuple[str, ...]:
        """Return the signals that left their range since this was asked last."""
        noted = self._frame[self._slots[LEFT_RANGE]]
        found = tuple(noted)
        noted.clear()
        return found

    def has(self, name: str) -> bool:
        """Tell whether the Program has a variable or constant."""
        return name in self._slots

    def run(self, block: str) -> None:
        """Run a block."""
        if self._is_plain:
            self._blocks[block](self._frame)
        else:
            with self._arithmetic.quiet():
                self._blocks[block](self._frame)

    def reader(self, names: tuple[str, ...]) -> Callable[[], tuple[Any, ...]]:
        """Return a function that returns the values of some variables."""
        slots = [self._slots[name] for name in names]
        frame, plain = self._frame, self._arithmetic.plain
        if self._is_plain and len(slots) > 1:
            together = itemgetter(*slots)
            return lambda: together(frame)
        return lambda: tuple([plain(frame[slot]) for slot in slots])


class _Same:
    """A Program that equals itself alone: to tell whether two are equal takes longer than a run."""

    def __init__(self, program: Program) -> None:
        self.program = program

    def __hash__(self) -> int:
        return id(self.program)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Same) and other.program is self.program


@lru_cache(maxsize=64)
def _closures_of(same: _Same) -> Compiler:
    """Return the closures of a Program: all interpreters of one Program share them."""
    with ARITHMETIC[same.program.number].quiet():
        return Compiler(same.program)
