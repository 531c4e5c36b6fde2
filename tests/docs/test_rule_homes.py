"""Homes of rules: what lowers a rule is in the module that the page names, and in no other one."""

from __future__ import annotations

import ast
import re
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path

import pytest

from language.programs.sensor_program import sensor_program
from tests.docs.test_rule_citations import ROOT, SEMANTICS, leaf_rules

LOWERING = (
    "language/charts",
    "language/integration",
    "language/lowering",
    "language/observers",
    "language/passes",
    "language/programs",
    "language/smt",
    "engine",
    "codegen",
    "lockstep",
)
"""The folders that give models a meaning; readers, checks and overlays treat them as text."""
EXECUTED = ("exit", "reset", "entry")
"""The attributes of modes and transitions that hold actions of a transition."""
TAKERS = {
    "language/charts/micro_step.py": "a chart",
    "language/programs/engine_blocks.py": "the start of a continuous automaton",
    "language/programs/continuous_micro_step.py": "a continuous automaton, and a run in a tick",
    "language/programs/sampled_program.py": "the start of a sampled automaton",
    "language/programs/sampled_transitions.py": "a sampled automaton, its regions, a rewind",
}
"""The modules that take transitions, or enter initial modes."""


@cache
def _modules() -> dict[str, ast.Module]:
    """Return the syntax trees of the modules in `LOWERING` by path."""
    return {
        str(path.relative_to(ROOT)): ast.parse(path.read_text("utf-8"))
        for folder in LOWERING
        for path in sorted((ROOT / folder).rglob("*.py"))
    }


def _calls(tree: ast.Module, name: str) -> Iterator[ast.Call]:
    """Yield the calls of a function by its plain name."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == name:
            yield node


def _imports(tree: ast.Module, name: str) -> bool:
    """Tell whether a module imports a name."""
    nodes = (node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom))
    return any(alias.name == name for node in nodes for alias in node.names)


def _orders_by_priority(tree: ast.Module) -> bool:
    """Tell whether a module goes through the transitions of a mode in the order of priority."""
    return _imports(tree, "transitions_by_priority")


def _counts_a_wait(tree: ast.Module) -> bool:
    """Tell whether a module builds a counter up to the limit of a wait."""
    arguments = (argument for call in _calls(tree, "Count") for argument in call.args)
    return any(isinstance(node, ast.Attribute) and node.attr == "timer_limit" for node in arguments)


def _lowers_a_stage(tree: ast.Module) -> bool:
    """Tell whether a module reads or stores the assignments of an exit, a reset or an entry.

    Updates and truth tables name their stage.
    """
    return any(
        len(call.args) < arguments and not any(word.arg == "stage_name" for word in call.keywords)
        for name, arguments in (("read_stage", 4), ("commit_stage", 3))
        for call in _calls(tree, name)
    )


def _reads_actions(tree: ast.Module) -> bool:
    """Tell whether a module reads the actions of modes and transitions, to order them itself.

    The flags of a chart (`exit_flags`, `entry_flags`) test whether a mode has an action.
    """
    called = {node.func for node in ast.walk(tree) if isinstance(node, ast.Call)}
    flags = [
        node
        for node in ast.walk(tree)
        if isinstance(node, ast.FunctionDef) and node.name in ("exit_flags", "entry_flags")
    ]
    tested = {node for flag in flags for node in ast.walk(flag)}
    return any(
        isinstance(node, ast.Attribute) and node.attr in EXECUTED
        for node in {*ast.walk(tree)} - called - tested
    )


CRITERIA: dict[str, Callable[[ast.Module], bool]] = {
    "3a": _orders_by_priority,
    "4b": _counts_a_wait,
    "5": _lowers_a_stage,
    "6": _reads_actions,
}
"""What only the home of a rule does, by rule."""


READERS = {"3a": {"codegen/proofs/acsl/chart_selection_contract.py"}}
"""The modules that state in a contract what the home of a rule computes, by rule."""


@pytest.mark.parametrize("name", CRITERIA)
def test_a_rule_is_lowered_in_its_home_alone(name: str) -> None:
    (rule,) = [rule for rule in leaf_rules() if (rule.page, rule.name) == (SEMANTICS, name)]
    lowered = {path for path, tree in _modules().items() if CRITERIA[name](tree)}
    assert lowered - READERS.get(name, set()) == set(rule.paths("Implemented in"))


def test_the_numerics_of_sensors_are_in_no_driver() -> None:
    """The engine runs the blocks of the home of rule 19c, the driver in C prints them."""
    driver = (ROOT / "codegen/templates/simulator/run_driver.c.jinja").read_text("utf-8")
    printed = re.findall(r"{{ sensor_formulas\.(\w+) }}", driver)
    assert printed == list(sensor_program().blocks) == ["decay", "lag", "quantise"]
    assert not re.search(r"\b(ha_exp|exp|floor)\(", driver)
    engine = ast.parse((ROOT / "engine/simulation/sensors.py").read_text("utf-8"))
    names = {node.module for node in ast.walk(engine) if isinstance(node, ast.ImportFrom)}
    assert "language.programs.sensor_program" in names
    assert "language.numerics.evaluate" not in names
    assert not any(
        alias.name == "math"
        for n in ast.walk(engine)
        if isinstance(n, ast.Import)
        for alias in n.names
    )


def test_what_takes_transitions_calls_the_one_lowering() -> None:
    calling = {path for path, tree in _modules().items() if any(_calls(tree, "lower_transition"))}
    assert calling == TAKERS.keys()


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("3a", "from language.model.region_queries import transitions_by_priority"),
        ("4b", "op = Count(info.timer, enabled, info.timer_limit, key)"),
        ("5", "ops = (*read_stage(a, formulas, known), *commit_stage(a, formulas))"),
        ("6", "ops = [lower(mode.exit), lower(transition.reset), lower(target.entry)]"),
    ],
)
def test_a_second_home_is_found(name: str, text: str) -> None:
    assert CRITERIA[name](ast.parse(text))


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("4b", "op = Count(HISTORY_LENGTH.name, Value(True), size)"),
        ("5", 'ops = (*read_stage(a, u, known, "next"), *commit_stage(a, u, "next"))'),
        ("6", "name = solved.entry(letter, row, column)"),
    ],
)
def test_what_is_no_second_home_is_not_found(name: str, text: str) -> None:
    assert not CRITERIA[name](ast.parse(text))


def test_all_folders_are_read() -> None:
    assert all(any(Path(path).is_relative_to(f) for path in _modules()) for f in LOWERING)
