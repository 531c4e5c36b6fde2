"""The contracts of a chart under Frama-C's WP, and mistakes that break them."""

from __future__ import annotations

import dataclasses
import re
import shutil
from pathlib import Path

import pytest

from codegen.emit.c_module import emit_c_files
from codegen.passes.pass_list import run_c_passes
from codegen.proofs.acsl.chart_contract import (
    ChartContract,
    prove_chart_contracts,
    write_chart_contracts,
)
from codegen.toolchain.external_tools import DEBIAN_PACKAGES
from language.charts.chart_context import ChartContext
from language.ir.ops import Switch
from language.loading.load import load_automaton, program_of
from language.overlays.expand_document import Project
from language.programs.name_bindings import chart_context_of
from modewright.api.simulation import program
from tests.language.spec_builders import automaton

pytestmark = pytest.mark.skipif(
    not all(map(shutil.which, DEBIAN_PACKAGES)), reason="a tool is missing: make system-packages"
)
NAME = "supervisor"
FAULT = "work->request_chart = supervisor_FIRED_operation_fault;"
TRIPPED = "work->request_chart = supervisor_FIRED_operation_tripped;"
MISTAKES = {
    "priorities are exchanged": ("choose_operation", FAULT, TRIPPED),
    "a guard lacks a condition": (
        "choose_operation_standby",
        "(self->latched.key == supervisor_key_ignition) && in->hv_ok",
        "self->latched.key == supervisor_key_ignition",
    ),
    "a wait ends a tick early": (
        "choose_operation_precharge",
        "self->timer.operation_precharge_ready > 5U",
        "self->timer.operation_precharge_ready > 4U",
    ),
    "a wait never begins anew": (
        "count_operation",
        "    } else {\n        self->timer.operation_fault = 0U;\n    }\n}",
        "    } else {\n        /* nothing to do */\n    }\n}",
    ),
    "an inner mode goes before the outer one": (
        "select_transitions_1",
        "        choose_operation(self, work);\n        if (work->request_chart == 0U) {\n"
        "            choose_operation_standby(self, in, work);\n        }",
        "        choose_operation_standby(self, in, work);\n"
        "        if (work->request_chart == 0U) {\n"
        "            choose_operation(self, work);\n        }",
    ),
    "of two requests both are taken": (
        "resolve_request_operation_drive_torque",
        "            work->selected_chart = 0U;\n        }\n"
        "        work->selected_operation_drive_torque",
        "            /* nothing to do */\n        }\n        work->selected_operation_drive_torque",
    ),
    "a history is not kept": (
        "leave_operation",
        "        self->left_operation_drive = 1;\n        work->exit_operation_drive = true;\n"
        "        self->opposite_1 = false;\n        break;",
        "        work->exit_operation_drive = true;\n"
        "        self->opposite_1 = false;\n        break;",
    ),
    "a target is another mode": (
        "commit_17",
        "self->mode_main = supervisor_main_shut;",
        "self->mode_main = supervisor_main_open;",
    ),
    "something else is written": (
        "commit_18",
        "self->mode_pre = supervisor_pre_shut;",
        "self->mode_pre = supervisor_pre_shut;\n        self->mode_main = supervisor_main_open;",
    ),
}

CALLING = """\
language: 1
automaton: calling
period: 1 ms
numbers: float64
inputs: {x: {unit: rad, range: [-1, 1]}}
initial: busy
modes:
  busy:
    initial: slow
    modes:
      slow: {transitions: {fast: {when: sin(x) > 0.5}}}
      fast: {}
outputs: [mode]
"""


def made() -> ChartContract:
    return ChartContract(charting(), run_c_passes(program(NAME), by_magnitude=False))


def charting() -> ChartContext:
    found = chart_context_of(load_automaton(NAME, Project(Path())), program(NAME).transitions)
    assert found
    return found


@pytest.mark.usefixtures("impatient")
def test_what_a_micro_step_may_do_is_proven_of_a_chart(tmp_path: Path) -> None:
    """Of the functions that are broken below; of all of them it is a figure of `make verify`."""
    functions = sorted({function for function, _, _ in MISTAKES.values()})
    write_chart_contracts(made(), emit_c_files(program(NAME), by_magnitude=False), tmp_path)
    found = prove_chart_contracts(NAME, functions, tmp_path)
    assert found.open == ()
    assert found.proven == found.asked > 100


@pytest.mark.usefixtures("impatient")
@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_in_the_c_of_a_chart_is_found(mistake: str, tmp_path: Path) -> None:
    function, right, wrong = MISTAKES[mistake]
    files = emit_c_files(program(NAME), by_magnitude=False)
    text, file = files[f"{NAME}.c"], f"{NAME}.c"
    start = text.index(f" {re.sub(r'_[0-9]+$', '', function)}(")
    place = text.index(right, start)
    broken = text[:place] + wrong + text[place + len(right) :]
    write_chart_contracts(made(), {**files, file: broken}, tmp_path)
    found = prove_chart_contracts(NAME, [function], tmp_path)
    assert any(function in goal for goal in found.open), found


@pytest.mark.usefixtures("impatient")
def test_a_chart_that_was_lowered_to_another_order_is_found(tmp_path: Path) -> None:
    """The chart says inner modes first, its C goes by outer ones first."""
    own = charting()
    chart = dataclasses.replace(own.chart, order="inner_first")
    other = dataclasses.replace(own, chart=chart)
    files = emit_c_files(program(NAME), by_magnitude=False)
    write_chart_contracts(dataclasses.replace(made(), charting=other), files, tmp_path)
    found = prove_chart_contracts(NAME, ["select_transitions_1"], tmp_path)
    assert any("select_transitions_1" in goal for goal in found.open), found


@pytest.mark.usefixtures("impatient")
def test_a_chart_that_was_lowered_to_another_target_is_found(tmp_path: Path) -> None:
    """C and Program agree on it, so it is the chart that says that it is wrong."""
    own = made()
    commit = own.made.blocks["commit"]
    entered = [
        op for op in commit if isinstance(op, Switch) and op.selector == "work.selected_main"
    ]
    (first, to_shut), (second, to_open) = entered[-1].cases
    wrong = dataclasses.replace(entered[-1], cases=((first, to_open), (second, to_shut)))
    blocks = {
        **own.made.blocks,
        "commit": tuple(wrong if op is entered[-1] else op for op in commit),
    }
    files = emit_c_files(program(NAME), by_magnitude=False)
    shut, opened = (f"self->mode_main = supervisor_main_{mode};" for mode in ("shut", "open"))
    text = files[f"{NAME}.c"]
    place = text.index(shut) - 200
    tail = text[place:].replace(shut, "@", 1).replace(opened, shut, 1).replace("@", opened, 1)
    lowered = dataclasses.replace(own.made, blocks=blocks)
    write_chart_contracts(
        ChartContract(own.charting, lowered), {**files, f"{NAME}.c": text[:place] + tail}, tmp_path
    )
    assert prove_chart_contracts(NAME, ["commit_17"], tmp_path).open == ()
    found = prove_chart_contracts(NAME, ["commit"], tmp_path)
    assert any("commit_ensures" in goal for goal in found.open), found


def test_what_a_chart_asks_and_acsl_does_not_say_is_named() -> None:
    """A guard that calls a function has a lemma from the Program alone, and is no silent gap."""
    whole = automaton(CALLING)
    found = chart_context_of(whole, program_of(whole).transitions)
    assert found
    own = ChartContract(found, run_c_passes(program_of(whole), by_magnitude=False))
    assert "choose_busy_slow" in own.unsaid
    assert made().unsaid == ()
