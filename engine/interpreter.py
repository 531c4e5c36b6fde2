"""Interpreter: runs the blocks of a Program, each operation as a closure over one frame."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

from engine.closures import Compiler, Frame
from language.program import Program

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


class Interpreter:
    """A Program with its frame of values. Variables start at 0 or false, `init` has run."""

    def __init__(self, program: Program) -> None:
        """Build the closures. `X_Derive` and `X_Init` of the C code are run here too."""
        self.program = program
        names = [v.name for v in program.variables] + [c.name for c in program.constants]
        self._slots = {name: slot for slot, name in enumerate(names)}
        self._frame: Frame = [_initial(v.type, v.size) for v in program.variables]
        self._frame += [constant.value for constant in program.constants]
        compiler = Compiler(program, self._slots)
        self._blocks = compiler.blocks
        for entry in ("derive", "init"):
            if entry in self._blocks and program.period is not None:
                self.run(entry)
        if program.period is None and "derive" in self._blocks:
            self.run("derive")

    def get(self, name: str) -> Any:
        """Return the value of a variable or constant, `group.name`."""
        return self._frame[self._slots[name]]

    def set(self, name: str, value: float | int | bool) -> None:
        """Set a variable."""
        self._frame[self._slots[name]] = value

    def has(self, name: str) -> bool:
        """Tell whether the Program has a variable or constant."""
        return name in self._slots

    def run(self, block: str) -> None:
        """Run a block."""
        frame = self._frame
        for action in self._blocks[block]:
            action(frame)

    def reader(self, names: tuple[str, ...]) -> Callable[[], tuple[Any, ...]]:
        """Return a function that returns the values of some variables."""
        slots = [self._slots[name] for name in names]
        frame = self._frame
        return lambda: tuple([frame[slot] for slot in slots])


def _initial(kind: str, size: int) -> Any:
    return [INITIAL[kind]] * size if size else INITIAL[kind]
