"""Interpreter: runs the blocks of a Program, each operation as a closure over one frame."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

from engine.arithmetic import ARITHMETIC
from engine.closures import Compiler, Frame
from language.program import Constant, Program

INITIAL = {"real": 0.0, "truth": False, "whole": 0}


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
        """Build the closures. `X_Derive` and `X_Init` of the C code are run here too."""
        self.program = program
        names = [v.name for v in program.variables] + [c.name for c in program.constants]
        self._slots = {name: slot for slot, name in enumerate(names)}
        self._arithmetic = ARITHMETIC[program.number]
        initial = {kind: self._arithmetic.value(value) for kind, value in INITIAL.items()}
        self._frame: Frame = [
            [initial[v.type]] * v.size if v.size else initial[v.type] for v in program.variables
        ]
        self._frame += [self._constant(constant) for constant in program.constants]
        self._real = [v.type == "real" for v in program.variables]
        self._real += [constant.type == "real" for constant in program.constants]
        with self._arithmetic.quiet():
            compiler = Compiler(program, self._slots)
        self._blocks = compiler.blocks
        self._left = compiler.left
        for entry in ("derive", "init"):
            if entry in self._blocks:
                self.run(entry)

    def _constant(self, constant: Constant) -> Any:
        if constant.items:
            return tuple(self._arithmetic.value(item) for item in constant.items)
        return self._arithmetic.value(constant.value)

    def get(self, name: str) -> Any:
        """Return the value of a variable or constant, `group.name`."""
        return self._arithmetic.plain(self._frame[self._slots[name]])

    def set(self, name: str, value: float | int | bool) -> None:
        """Set a variable; a real is rounded to the number type, once."""
        slot = self._slots[name]
        if self._real[slot]:
            with self._arithmetic.quiet():
                value = self._arithmetic.real(value)
        self._frame[slot] = value

    def left(self) -> tuple[str, ...]:
        """Return the signals that left their range since this was asked last."""
        found = tuple(self._left)
        self._left.clear()
        return found

    def has(self, name: str) -> bool:
        """Tell whether the Program has a variable or constant."""
        return name in self._slots

    def run(self, block: str) -> None:
        """Run a block."""
        frame = self._frame
        with self._arithmetic.quiet():
            for action in self._blocks[block]:
                action(frame)

    def reader(self, names: tuple[str, ...]) -> Callable[[], tuple[Any, ...]]:
        """Return a function that returns the values of some variables."""
        slots = [self._slots[name] for name in names]
        frame, plain = self._frame, self._arithmetic.plain
        return lambda: tuple([plain(frame[slot]) for slot in slots])
