"""A block computes an expression once, until a variable that it reads is written."""

from __future__ import annotations

import dataclasses

from language.ir.ops import Assign, Binary, Op, Ref, Unary, real
from language.ir.printer import block_lines
from language.passes.common_subexpressions import eliminate_common_subexpressions
from tests.language.passes.test_parameter_folding import slide


def product() -> Binary:
    return Binary("*", Unary("-", Ref("state.x")), Ref("state.y"))


def rewritten(*block: Op) -> list[str]:
    program = dataclasses.replace(slide(), blocks={"step": block})
    return list(block_lines(eliminate_common_subexpressions(program).blocks["step"]))


def test_a_repeated_expression_is_computed_once() -> None:
    assert rewritten(Assign("state.a", product()), Assign("state.b", product())) == [
        "work.minus_x_y := ((- state.x) * state.y)    # (-x) * y",
        "state.a := work.minus_x_y",
        "state.b := work.minus_x_y",
    ]


def test_one_object_on_both_sides_of_a_write_is_computed_twice() -> None:
    shared = product()
    ops = (Assign("state.a", shared), Assign("state.x", real(3.0)), Assign("state.b", shared))
    assert rewritten(*ops) == list(block_lines(ops))
