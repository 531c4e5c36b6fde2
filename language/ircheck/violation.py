"""Violations: what a checker of Programs finds, with the rule, the place and the values."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from language.ir.ops import Op
from language.ir.printer import block_lines

Rule = Literal["declaration", "reference", "type", "range", "assignment", "dead-store", "interface"]
"""The rules of the checker.

    declaration  names, types, modes, transitions and outputs are declared once and fit together
    reference    each name, block, function and fault that an operation names exists
    type         the types of expressions, arguments, conditions and targets agree
    range        literals, indices, cases, counts and limits are within their ranges
    assignment   a work variable is assigned before it is read
    dead-store   no name is declared, and no work variable assigned, that nothing reads
    interface    a block writes what its kind may write, and text declares what a block accesses
"""


@dataclass(frozen=True)
class Violation:
    """A violated rule: the place in the Program, and what is wrong with the values."""

    rule: Rule
    place: str
    message: str

    def __str__(self) -> str:
        """Return the violation as one line."""
        return f"[{self.rule}] {self.place}: {self.message}"


MAX_PLACE_WIDTH = 100
"""Longest text of an operation in a place [characters]."""


def operation_place(block: str, op: Op) -> str:
    """Return the place of an operation: its block and the first line of its text."""
    line = next(block_lines((op,)), type(op).__name__).split("    # ")[0]
    text = line if len(line) <= MAX_PLACE_WIDTH else f"{line[: MAX_PLACE_WIDTH - 3]}..."
    return f"block {block}, `{text}`"
