"""The longest step: code laid out as a compiler does has the bound that its shape has."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import pytest
from hypothesis import given, strategies as st

from codegen.harness.disassembly import Instruction
from codegen.harness.worst_case_instructions import UnboundedError, longest_path

Shape = int | tuple[Any, ...]
"""A number of instructions, or (`if`, then, otherwise), (`loop`, turns, body), (`then`, parts)."""
PLAIN = st.integers(1, 4)
SHAPES = st.recursive(
    PLAIN,
    lambda inner: st.one_of(
        st.tuples(st.just("if"), inner, inner),
        st.tuples(st.just("loop"), st.integers(2, 24), inner),
        st.tuples(st.just("then"), st.lists(inner, min_size=1, max_size=3)),
    ),
    max_leaves=12,
)


@dataclass
class Layout:
    """Machine code of shapes from an address on, one instruction at each; loops test at the top."""

    code: list[Instruction] = field(default_factory=list)
    begin: int = 0
    loops: int = 0

    @property
    def end(self) -> int:
        """The address of what comes next."""
        return self.begin + len(self.code)

    def put(self, name: str, around: Mapping[str, int], target: int = -1) -> int:
        place = self.end
        operands = f"{target:x} <there>" if target >= 0 else "r0"
        self.code.append(Instruction(f"{place:x}", name, operands, around))
        return place

    def aim(self, place: int, target: int) -> None:
        number = place - self.begin
        led = dataclasses.replace(self.code[number], operands=f"{target:x} <there>")
        self.code[number] = led

    def lay(self, shape: Shape, around: Mapping[str, int]) -> int:
        """Lay a shape out; return the most instructions that it takes."""
        if isinstance(shape, int):
            for _ in range(shape):
                self.put("adds", around)
            return shape
        if shape[0] == "then":
            return sum(self.lay(part, around) for part in shape[1])
        if shape[0] == "if":
            test = self.put("cbz", around)
            then = self.lay(shape[1], around)
            over = self.put("b.n", around)
            self.aim(test, self.end)
            otherwise = self.lay(shape[2], around)
            self.aim(over, self.end)
            return 1 + max(then + 1, otherwise)
        self.loops += 1
        inside = {**around, f"a.c:{self.loops}": shape[1]}
        head = self.put("cmp", inside)
        out = self.put("bge.w", inside)
        body = self.lay(shape[2], inside)
        self.put("b.w", inside, head)
        self.aim(out, self.end)
        return int(shape[1] * (body + 3) + 2)


@given(SHAPES)
def test_the_bound_is_that_of_the_shape(shape: Shape) -> None:
    laid = Layout()
    most = laid.lay(shape, {})
    laid.put("bx", {})
    assert longest_path({"step": tuple(laid.code)}, "step") == most + 1


def test_a_call_takes_what_is_called_and_a_branch_out_does_too() -> None:
    helper, step = Layout(begin=256), Layout()
    most = helper.lay(("if", 3, 7), {}) + 1
    helper.put("bx", {})
    step.put("bl", {}, 256)
    step.put("cbz", {}, 3)
    step.put("adds", {})
    step.put("b.w", {}, 256)
    found = longest_path({"step": tuple(step.code), "helper": tuple(helper.code)}, "step")
    assert found == 1 + most + 1 + 1 + 1 + most


@pytest.mark.parametrize(
    ("name", "target", "told"),
    [
        ("b.n", 0, "step has a loop of which no end is known"),
        ("blx", -1, "blx r0 calls what is not known"),
        ("tbb", -1, "a table of branches is not followed"),
    ],
)
def test_what_has_no_bound_is_told(name: str, target: int, told: str) -> None:
    laid = Layout()
    laid.put("adds", {})
    laid.put(name, {}, target)
    laid.put("bx", {})
    with pytest.raises(UnboundedError, match=told):
        longest_path({"step": tuple(laid.code)}, "step")
