"""Contracts of small charts under Frama-C's WP: each has less in its C than a large one."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from codegen.emit.c_module import emit_c_files
from codegen.proofs.acsl.function_outlining import function_of, move_scratch_to_parameter
from codegen.proofs.acsl.mode_contract import check_contracts
from codegen.toolchain.external_tools import DEBIAN_PACKAGES
from language.loading.load import program_of
from tests.language.spec_builders import automaton

pytestmark = pytest.mark.skipif(
    not all(map(shutil.which, DEBIAN_PACKAGES)), reason="a tool is missing: make system-packages"
)
CHART = """\
language: 1
automaton: small
period: 1 ms
numbers: float64
{keys}
inputs: {{u: {{unit: m, range: [-9, 9]{on_range}}}}}
initial: p
modes:
  p:
    initial: a
    transitions: {{q: {{when: u < -5 m}}}}
    modes: {{a: {{transitions: {{b: {{when: u > 1 m}}}}}}, b: {{}}}}
  q: {{transitions: {{p: {{when: u > 0 m}}}}}}
outputs: [mode]
"""
FAULT = ", on_range: fault"


@pytest.mark.usefixtures("impatient")
@pytest.mark.parametrize(
    ("keys", "on_range"),
    [
        ("order: outer_first", ""),  # the scratch of a tick is the jump's own
        ("micro_steps: 3", ""),  # nothing waits: nobody asks for the first micro-step
        ("micro_steps: 3\nfault_mode: q", FAULT),
        ("fault_mode: q", FAULT),
    ],
)
def test_all_that_a_small_chart_asks_is_proven(keys: str, on_range: str, tmp_path: Path) -> None:
    text = CHART.format(keys=keys, on_range=on_range)
    made = automaton(text)
    found = check_contracts(made, program_of(made), tmp_path)
    assert found.is_asked
    assert found.findings == ()
    proven, _, asked, *_ = found.about.split()
    assert int(proven) == int(asked) > 100
    assert "lemmas alone" not in found.about


def test_the_scratch_of_a_jump_is_given_to_it_in_the_copy_that_is_proven() -> None:
    made = automaton(CHART.format(keys="order: outer_first", on_range=""))
    text = emit_c_files(program_of(made), by_magnitude=False)["small.c"]
    assert function_of(text, "jump").parameters == "small_Self *self"
    lifted = move_scratch_to_parameter(text, "jump")
    assert function_of(lifted, "jump").parameters == "small_Self *self, Work *work"
    assert "        Work scratch;\n\n        jump(self, &scratch);\n" in lifted
    assert move_scratch_to_parameter(lifted, "jump") == lifted


COUNTING = """\
language: 1
automaton: counting
period: 1 ms
numbers: float64
inputs: {u: {type: bool}}
discrete: {k: {type: int, initial: 0, range: [0, 5]}}
initial: a
modes:
  a: {transitions: {b: {when: u, reset: {k: k + 1}}}}
  b: {transitions: {a: {when: not u}}}
outputs: [mode, k]
"""


@pytest.mark.usefixtures("impatient")
def test_a_whole_number_stays_in_its_range_and_no_sum_of_it_is_too_large(tmp_path: Path) -> None:
    made = automaton(COUNTING)
    found = check_contracts(made, program_of(made), tmp_path)
    assert found.findings == ()
    text = (tmp_path / "counting.c").read_text()
    assert text.count("requires 0 <= self->discrete.k <= 5;") == 1  # read in `jump_a` alone
    assert text.count("ensures 0 <= self->discrete.k <= 5;") == 1
