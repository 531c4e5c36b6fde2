"""Interpreter: executes the blocks of a Program as closures over one frame of values.

The closures are compiled once for each Program and shared by its interpreters.
"""

from __future__ import annotations

from collections.abc import Callable
from operator import itemgetter
from typing import Any, Protocol

from engine.interpreter.block_compiler import BlockCompiler, FunctionMap
from engine.interpreter.expression_closures import Frame
from engine.interpreter.number_arithmetic import ARITHMETIC_OF_TYPE
from engine.interpreter.value_frame import RANGE_VIOLATIONS
from language.ir.analysis_cache import cache_on_owner
from language.ir.program import Program


class Stepper(Protocol):
    """Protocol of an executor of a Program: the interpreter, scipy or compiled C."""

    def get(self, name: str) -> Any:
        """Return the value of a variable."""

    def set(self, name: str, value: float | int | bool) -> None:
        """Set a variable."""

    def run(self, block: str) -> None:
        """Run a block of the Program."""

    def make_reader(self, names: tuple[str, ...]) -> Callable[[], tuple[Any, ...]]:
        """Return a function that returns the values of some variables, in their order."""

    def pop_range_violations(self) -> tuple[str, ...]:
        """Return the signals that left their range since the last call, and clear the record."""


class Interpreter:
    """Executor of a Program with its own frame of values."""

    def __init__(self, program: Program, functions: FunctionMap | None = None) -> None:
        """Create a frame and run `derive` and `init`, as `X_Derive` and `X_Init` of the C code.

        Variables are 0 or false before. `functions` replace elementary functions of the Program by
        name; they get and return numbers of the number type.
        """
        self.program = program
        compiler = BlockCompiler(program, functions) if functions else _compile_program(program)
        self._slots = compiler.scope.slots
        self._blocks = compiler.blocks
        self._real = compiler.reals
        self._arithmetic = ARITHMETIC_OF_TYPE[program.number_type]
        self._is_float64 = program.number_type == "float64"
        self._frame: Frame = compiler.scope.new_frame()
        for entry in ("derive", "init"):
            if entry in self._blocks:
                self.run(entry)

    def get(self, name: str) -> Any:
        """Return the value of a variable or constant, `group.name`.

        A float32 is returned as a Python float; arrays as they are stored. Raises KeyError for an
        unknown name.
        """
        value = self._frame[self._slots[name]]
        return value if self._is_float64 else self._arithmetic.to_python(value)

    def set(self, name: str, value: float | int | bool) -> None:
        """Set a variable or constant, `group.name`; a real is rounded to the number type.

        Values of other types are stored as given. Derived values are not updated. Raises KeyError
        for an unknown name.
        """
        if name in self._real:
            if self._is_float64:
                value = float(value)
            else:
                with self._arithmetic.suppress_warnings():
                    value = self._arithmetic.real(value)
        self._frame[self._slots[name]] = value

    def pop_range_violations(self) -> tuple[str, ...]:
        """Return the signals that left their range since the last call, and clear the record.

        Each signal occurs once, in the order of the first violations.
        """
        violations = self._frame[self._slots[RANGE_VIOLATIONS]]
        names = tuple(violations)
        violations.clear()
        return names

    def has(self, name: str) -> bool:
        """Return whether the Program has a variable or constant of the name `group.name`."""
        return name in self._slots

    def run(self, block: str) -> None:
        """Run a block of the Program on the frame. Raises KeyError for an unknown block."""
        if self._is_float64:
            self._blocks[block](self._frame)
        else:
            with self._arithmetic.suppress_warnings():
                self._blocks[block](self._frame)

    def make_reader(self, names: tuple[str, ...]) -> Callable[[], tuple[Any, ...]]:
        """Return a function that returns the present values of some names, in their order.

        The values are those of `get`. Raises KeyError for an unknown name.
        """
        slots = [self._slots[name] for name in names]
        frame, to_python = self._frame, self._arithmetic.to_python
        if self._is_float64 and len(slots) > 1:
            pick = itemgetter(*slots)
            return lambda: pick(frame)
        return lambda: tuple([to_python(frame[slot]) for slot in slots])


@cache_on_owner
def _compile_program(program: Program) -> BlockCompiler:
    """Return the closures of a Program; all interpreters of the Program share them."""
    with ARITHMETIC_OF_TYPE[program.number_type].suppress_warnings():
        return BlockCompiler(program)
