"""What contracts take for granted of pointers is true where functions are called."""

from __future__ import annotations

import pytest

from codegen.emit.c_module import emit_c_files
from codegen.proofs.acsl.assigns_contract import is_inside, required
from modewright.api.simulation import program

HEAD = "estimator_Self *self, const estimator_In *in, estimator_Work *work"


@pytest.mark.parametrize(("name", "inside"), [("estimator", True), ("estimator_simple", False)])
def test_work_is_apart_only_where_it_is_no_part_of_the_instance(name: str, inside: bool) -> None:
    text = emit_c_files(program(name))[f"{name}.c"]
    assert is_inside(text) is inside
    clauses = list(required(HEAD, inside))
    assert clauses[:3] == [
        "requires \\valid(self);",
        "requires \\valid_read(in);",
        "requires \\valid(work);",
    ]
    within = ["requires work == &self->work;", "requires \\separated(self, in);"]
    assert clauses[3:] == (within if inside else ["requires \\separated(self, in, work);"])
