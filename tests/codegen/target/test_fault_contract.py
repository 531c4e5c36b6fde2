"""The contracts of a chart with a fault mode under Frama-C's WP, and mistakes that break them."""

from __future__ import annotations

import dataclasses
import re
import shutil
from collections.abc import Mapping
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
from language.loading.load import program_of
from language.lowering import fault_mode as fault
from language.lowering.fault_mode import add_fault_transitions
from language.model.automaton import Automaton, Mode
from language.model.statechart import Chart
from language.programs.name_bindings import chart_context_of
from tests.language.spec_builders import automaton

pytestmark = pytest.mark.skipif(
    not all(map(shutil.which, DEBIAN_PACKAGES)), reason="a tool is missing: make system-packages"
)
NAME = "guarded"
GUARDED = """\
language: 1
automaton: guarded
period: 1 ms
numbers: float64
order: outer_first
micro_steps: 3
fault_mode: safe
inputs: {u: {unit: m, range: [-9, 9], on_range: fault}}
initial: busy
modes:
  busy:
    initial: a
    transitions: {rest: {when: u < -5 m}}
    modes:
      a: {transitions: {b: {when: u > 1 m}}}
      b:
        regions:
          l: {initial: x, modes: {x: {transitions: {w: {when: u > 2 m, wait: 2 ms}}}, w: {}}}
        transitions: {a: {when: u < 0 m}}
  rest: {transitions: {busy: {when: u > 0 m, history: deep}}}
  safe:
    initial: s
    modes:
      s:
        regions:
          r: {initial: x, modes: {x: {transitions: {w: {when: u > 4 m, wait: 2 ms}}}, w: {}}}
      t: {}
    transitions: {busy: {when: u < -3 m}}
outputs: [mode, faults]
"""
ASKED = """\
        if (work->fault_happened) {
            work->request_chart = guarded_FIRED_busy_b_fault_mode;
        } else {
            choose_busy(self, work);
            if (work->request_chart == 0U) {
                choose_busy_b(self, work);
            }
        }
"""
LATER = """\
        choose_busy(self, work);
        if (work->request_chart == 0U) {
            choose_busy_b(self, work);
        }
"""
MISTAKES = {
    "an outer mode goes before the fault": ("select_transitions_1", ASKED, LATER),
    "a mode takes the way of another": (
        "select_transitions_1",
        ASKED,
        ASKED.replace("busy_b_fault_mode", "busy_a_fault_mode"),
    ),
    "a mode that a fault leaves goes on inside": (
        "select_transitions_2",
        "    if (work->fault_happened) {\n        /* nothing to do */\n    } else {",
        "    if (false) {\n        /* nothing to do */\n    } else {",
    ),
    "a mode of its own goes before the fault": (
        "choose_busy_b",
        "if (work->fault_happened) {",
        "if (work->fault_happened && self->latched.u >= 0.0) {",
    ),
    "the fault mode is entered without a fault": (
        "choose_rest",
        "if (work->fault_happened) {",
        "if (work->fault_happened || self->latched.u < -8.0) {",
    ),
    "another mode is entered": (
        "commit_7",
        "    case guarded_FIRED_rest_fault_mode:\n"
        "        self->mode_busy_b_l = guarded_busy_b_l_inactive;\n"
        "        self->mode_safe_s_r = guarded_safe_s_r_inactive;\n"
        "        self->mode = guarded_MODE_safe_s;",
        "    case guarded_FIRED_rest_fault_mode:\n"
        "        self->mode_busy_b_l = guarded_busy_b_l_inactive;\n"
        "        self->mode_safe_s_r = guarded_safe_s_r_inactive;\n"
        "        self->mode = guarded_MODE_safe_t;",
    ),
    "a micro-step is done past the bound": (
        "micro_step_3",
        "        if (work->is_over) {",
        "        if (!work->is_over) {",
    ),
    "the bound is another": (
        "micro_step_3",
        "work->is_over = work->steps == 3;",
        "work->is_over = work->steps == 4;",
    ),
    "a tick goes on when nothing is taken": (
        "micro_step",
        "    } else {\n        work->is_busy = false;\n    }\n    work->is_first",
        "    } else {\n        work->is_busy = true;\n    }\n    work->is_first",
    ),
    "a tick ends with something left to do": ("jump", "turn < 5;", "turn < 3;"),
    "a tick counts on from the one before": ("jump", "    work->steps = 0;\n", ""),
}


def forgetful(automaton: Automaton, mode: Mode) -> Mode:
    """A way out of each mode but one."""
    return mode if mode.name == "rest" else WAY_OUT(automaton, mode)


def elsewhere(automaton: Automaton, chart: Chart) -> Chart:
    """Ways to another mode than the fault mode."""
    found = WAYS(automaton, chart)
    other = next(node.index for node in chart.nodes if node.path == "rest")
    changed = {
        key: dataclasses.replace(way, targets=(other,)) for key, way in found.transitions.items()
    }
    kept = {key: way for key, way in found.transitions.items() if not key.endswith("fault_mode")}
    return dataclasses.replace(found, transitions={**changed, **kept})


WAY_OUT, WAYS = fault._add_fault_transition, fault._add_chart_transitions
LOWERED: dict[str, tuple[str, object, str]] = {
    "a mode has no way to it": (
        "language.lowering.fault_mode._add_fault_transition",
        forgetful,
        "select_transitions_1",
    ),
    "its ways lead to another": (
        "language.lowering.fault_mode._add_chart_transitions",
        elsewhere,
        "select_transitions_1",
    ),
    "outer modes go before it": (
        "language.charts.transition_selection.FAULT_PRIORITY",
        99,
        "select_transitions_1",
    ),
    "what it leaves goes on": (
        "language.charts.transition_selection._is_left_by_fault",
        lambda charting, region: False,
        "select_transitions_2",
    ),
    "it stands still while a fault lasts": (
        "language.charts.transition_selection._is_left_by_fault",
        lambda charting, region: region.path != "chart",
        "select_transitions_3",
    ),
}
"""What is exchanged, for what, and the function whose contract does not hold then."""
WHOLE = ("select_transitions", "resolve_conflicts", "commit", "micro_step_1", "micro_step_2")


@pytest.mark.parametrize("order", ["outer_first", "inner_first"])
def test_that_the_fault_mode_is_entered_from_anywhere_is_proven(order: str, tmp_path: Path) -> None:
    """Of the functions that are broken below, and of those that run them."""
    functions = {function for function, _, _ in MISTAKES.values()}
    functions |= {function for _, _, function in LOWERED.values()}
    made, files = lowered(order)
    names = set(write_chart_contracts(made, files, tmp_path))
    whole = names & {*functions, *WHOLE}
    found = prove_chart_contracts(NAME, sorted(whole), tmp_path)
    assert found.open == ()
    assert found.proven == found.asked > 100
    assert made.unsaid == ()


@pytest.mark.usefixtures("impatient")
@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_in_the_c_of_a_fault_mode_is_found(mistake: str, tmp_path: Path) -> None:
    function, right, wrong = MISTAKES[mistake]
    made, files = lowered()
    text, file = files[f"{NAME}.c"], f"{NAME}.c"
    start = text.index(f" {re.sub(r'_[0-9]+$', '', function)}(")
    place = text.index(right, start)
    broken = text[:place] + wrong + text[place + len(right) :]
    write_chart_contracts(made, {**files, file: broken}, tmp_path)
    found = prove_chart_contracts(NAME, [function], tmp_path)
    assert any(function in goal for goal in found.open), found


@pytest.mark.usefixtures("impatient")
@pytest.mark.parametrize("mistake", LOWERED)
def test_a_chart_whose_fault_mode_was_lowered_wrong_is_found(
    mistake: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Program, C and the transitions of the chart agree on it: its tree of modes does not."""
    name, wrong, function = LOWERED[mistake]
    monkeypatch.setattr(name, wrong)
    made, files = lowered()
    write_chart_contracts(made, files, tmp_path)
    found = prove_chart_contracts(NAME, [function], tmp_path)
    assert any(function in goal for goal in found.open), found


def lowered(order: str = "outer_first") -> tuple[ChartContract, Mapping[str, str]]:
    """Return the contract of a chart that is lowered now, and its C."""
    whole = automaton(GUARDED.replace("outer_first", order))
    program = program_of(whole)
    charting = chart_context_of(add_fault_transitions(whole), program.transitions)
    assert charting
    made = ChartContract(charting, run_c_passes(program, by_magnitude=False))
    return made, emit_c_files(program, by_magnitude=False)
