"""Passes: what each changes, as `explain --pass` and `--stop-after` print it."""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import get_args

import pytest

from codegen.passes.pass_list import C_PASSES, run_c_passes
from language.ir.printer import format_program
from language.loading.load import lower_automaton, program_of
from language.passes.pass_list import LANGUAGE_PASSES
from language.passes.program_pass import ProgramPass
from modewright.api.pass_output import (
    PROGRAM_PASSES,
    PassName,
    compare_specs,
    explain_spec,
    program_after,
)
from modewright.cli.app import app
from modewright.cli.commands.explain import PASSES, STAGES
from tests.language.spec_builders import ROOT, load_shipped

GOLDEN = Path(__file__).parent / "golden"
HEATER = "tests/codegen/emit/golden/heater.yaml"
SPECS = {"range-checks": HEATER, "inlining": HEATER}
"""The spec whose text shows a pass, if it is not `bmw_i3`."""


@pytest.mark.parametrize("name", PROGRAM_PASSES)
def test_what_a_pass_changes_is_golden(name: str, update: bool) -> None:
    text = explain_spec(SPECS.get(name, "bmw_i3"), name, {}, ROOT)  # type: ignore[arg-type]
    golden = GOLDEN / f"{name}.diff"
    if update:
        golden.write_text(text, "utf-8")
    assert text == golden.read_text("utf-8")
    assert len(text.splitlines()) > 3, "the example shows a change"


def test_the_command_names_all_passes_in_their_order() -> None:
    assert (*STAGES, *PASSES) == get_args(PassName)
    assert tuple(PROGRAM_PASSES) == PASSES


@pytest.mark.parametrize("step", [*LANGUAGE_PASSES, *C_PASSES], ids=lambda step: step.name)
def test_a_module_of_a_pass_has_its_rule(step: ProgramPass) -> None:
    names = step.run.__code__.co_names if step.run.__name__ == "<lambda>" else ()
    function = (
        getattr(importlib.import_module("codegen.passes.pass_list"), names[0], step.run)
        if names
        else step.run
    )
    rule = importlib.import_module(function.__module__).__doc__ or ""
    assert "before" in rule and "after" in rule


def test_the_program_after_a_pass_is_printed() -> None:
    made = load_shipped("bmw_i3")
    lowered, program = lower_automaton(made), program_of(made)
    assert program_after("bmw_i3", "lowered", {}, ROOT) == format_program(lowered)
    assert program_after("bmw_i3", "unused-parameters", {}, ROOT) == format_program(program)
    assert explain_spec("bmw_i3", "program", {}, ROOT) == format_program(program)
    last = program_after("bmw_i3", "inlining", {}, ROOT)
    assert last == format_program(run_c_passes(program)), "nothing is marked in this Program"


def test_the_difference_of_a_pass_leads_from_one_program_to_the_next() -> None:
    before = program_after("bmw_i3", "parameters", {}, ROOT).splitlines()
    after = program_after("bmw_i3", "inputs", {}, ROOT).splitlines()
    lines = explain_spec("bmw_i3", "inputs", {}, ROOT).splitlines()[3:]
    gone = [line[1:] for line in lines if line.startswith("-")]
    new = [line[1:] for line in lines if line.startswith("+")]
    assert gone and set(gone) <= set(before) and set(new) <= set(after)
    assert len(before) - len(gone) == len(after) - len(new)


def test_a_pass_that_changes_nothing_says_so() -> None:
    text = explain_spec("contactor", "fast-path", {}, ROOT)
    assert text.splitlines()[1:] == ["it changes nothing here"]


def test_two_specs_are_compared_after_a_pass() -> None:
    assert compare_specs("hko", "hko", "inlining", {}, ROOT) == ""
    text = compare_specs("estimator", "hko", "inlining", {}, ROOT)
    assert "+program hko" in text and "(not-inlined)" in text


def test_the_command_stops_after_a_pass(capsys: pytest.CaptureFixture[str]) -> None:
    app(["explain", "contactor", "--stop-after", "inputs"], standalone_mode=False)
    assert capsys.readouterr().out.startswith("program contactor\nnumbers float32\n")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--stop-after", "nope"), "one of lowered, parameters"),
        (("--stop-after", "inputs", "--pass", "model"), "leave out --pass"),
        (("--pass", "nope"), "one of document, model"),
        (("--stop-after", "inputs", "--json"), "the document only"),
    ],
)
def test_a_wrong_pass_is_refused(arguments: tuple[str, ...], message: str) -> None:
    with pytest.raises(Exception, match=message):
        app(["explain", "contactor", *arguments], standalone_mode=False)
