"""Interpreter: runs the blocks of a Program, each operation as a closure over one frame."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from operator import itemgetter
from typing import Any, Protocol

from engine.interpreter.block_compiler import BlockCompiler
from engine.interpreter.expression_closures import Frame
from engine.interpreter.number_arithmetic import ARITHMETIC_OF_TYPE
from engine.interpreter.value_frame import RANGE_VIOLATIONS
from language.ir.program import Program


class Stepper(Protocol):
    """What the engine needs of something that runs a Program."""

    def get(self, name: str) -> Any:
        """Return the value of a variable."""

    def set(self, name: str, value: float | int | bool) -> None:
        """Set a variable."""

    def run(self, block: str) -> None:
        """Run a block of the Program."""

    def make_reader(self, names: tuple[str, ...]) -> Callable[[], tuple[Any, ...]]:
        """Return a function that returns the values of some variables."""

    def pop_range_violations(self) -> tuple[str, ...]:
        """Return the signals that left their range since this was asked last."""


class Interpreter:
    """A Program with its frame of values. Variables start at 0 or false, `init` has run."""

    def __init__(self, program: Program) -> None:
        """Take the closures. `X_Derive` and `X_Init` of the C code are run here too."""
        self.program = program
        compiler = _compile_program(_ProgramIdentity(program))
        self._slots = compiler.scope.slots
        self._blocks = compiler.blocks
        self._real = compiler.reals
        self._arithmetic = ARITHMETIC_OF_TYPE[program.number_type]
        self._is_plain = program.number_type == "float64"
        self._frame: Frame = compiler.scope.new_frame()
        for entry in ("derive", "init"):
            if entry in self._blocks:
                self.run(entry)

    def get(self, name: str) -> Any:
        """Return the value of a variable or constant, `group.name`."""
        value = self._frame[self._slots[name]]
        return value if self._is_plain else self._arithmetic.to_python(value)

    def set(self, name: str, value: float | int | bool) -> None:
        """Set a variable; a real is rounded to the number type, once."""
        if name in self._real:
            if self._is_plain:
                value = float(value)
            else:
                with self._arithmetic.suppress_warnings():
                    value = self._arithmetic.real(value)
        self._frame[self._slots[name]] = value

    def pop_range_violations(self) -> tuple[str, ...]:
        """Return the signals that left their range since this was asked last."""
        violations = self._frame[self._slots[RANGE_VIOLATIONS]]
        names = tuple(violations)
        violations.clear()
        return names

    def has(self, name: str) -> bool:
        """Tell whether the Program has a variable or constant."""
        return name in self._slots

    def run(self, block: str) -> None:
        """Run a block."""
        if self._is_plain:
            self._blocks[block](self._frame)
        else:
            with self._arithmetic.suppress_warnings():
                self._blocks[block](self._frame)

    def make_reader(self, names: tuple[str, ...]) -> Callable[[], tuple[Any, ...]]:
        """Return a function that returns the values of some variables."""
        slots = [self._slots[name] for name in names]
        frame, plain = self._frame, self._arithmetic.to_python
        if self._is_plain and len(slots) > 1:
            together = itemgetter(*slots)
            return lambda: together(frame)
        return lambda: tuple([plain(frame[slot]) for slot in slots])


class _ProgramIdentity:
    """A Program that equals itself alone: to tell whether two are equal takes longer than a run."""

    def __init__(self, program: Program) -> None:
        self.program = program

    def __hash__(self) -> int:
        return id(self.program)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _ProgramIdentity) and other.program is self.program


@lru_cache(maxsize=64)
def _compile_program(key: _ProgramIdentity) -> BlockCompiler:
    """Return the closures of a Program: all interpreters of one Program share them."""
    with ARITHMETIC_OF_TYPE[key.program.number_type].suppress_warnings():
        return BlockCompiler(key.program)
