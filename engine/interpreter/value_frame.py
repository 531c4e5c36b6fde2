"""Value frame: the values of a Program in one list, and the slot of each name in it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from engine.interpreter.expression_closures import Frame
from engine.interpreter.number_arithmetic import ARITHMETIC_OF_TYPE
from language.ir.program import Constant, Program

INITIAL_VALUES = {"real": 0.0, "truth": False, "whole": 0}
"""Initial value of a variable of each type."""
RANGE_VIOLATIONS = "left range"
"""Name of the slot with the signals that left their range, as keys of a dict."""


@dataclass
class FrameLayout:
    """Slots of names and literals in a frame, and the initial value of every slot."""

    slots: dict[str, int]
    values: Frame
    literals: dict[str, int] = field(default_factory=dict)

    def slot_of_literal(self, value: Any) -> int:
        """Return the slot of a literal; a new literal is appended to the frame.

        Literals are equal if type and `repr` are, so that 0, 0.0, -0.0 and False have different
        slots.
        """
        key = f"{type(value).__name__} {value!r}"  # 0, 0.0, -0.0 and False are different literals
        if key not in self.literals:
            self.literals[key] = len(self.values)
            self.values.append(value)
        return self.literals[key]

    def new_frame(self) -> Frame:
        """Return a new frame with the initial values; lists are copied, dicts are empty."""
        return [list(v) if type(v) is list else {} if type(v) is dict else v for v in self.values]


def frame_layout_of(program: Program) -> FrameLayout:
    """Return the layout of a Program: variables, constants, then `RANGE_VIOLATIONS`.

    Variables are 0 or false (`INITIAL_VALUES`), arrays lists of them. Constants have their values
    in the number type; a table is a tuple. The last slot has an empty dict.
    """
    value = ARITHMETIC_OF_TYPE[program.number_type].to_frame_value
    names = [v.name for v in program.variables] + [c.name for c in program.constants]
    initial = {kind: value(number) for kind, number in INITIAL_VALUES.items()}
    values: Frame = [
        [initial[v.type]] * v.size if v.size else initial[v.type] for v in program.variables
    ]
    values += [_constant_value(program, constant) for constant in program.constants]
    return FrameLayout(
        {name: slot for slot, name in enumerate([*names, RANGE_VIOLATIONS])}, [*values, {}]
    )


def _constant_value(program: Program, constant: Constant) -> Any:
    """Return a constant in the number type; a table is a tuple."""
    value = ARITHMETIC_OF_TYPE[program.number_type].to_frame_value
    if constant.items:
        return tuple(value(item) for item in constant.items)
    return value(constant.value)
