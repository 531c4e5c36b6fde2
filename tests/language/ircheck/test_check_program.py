"""The checker of Programs: lowered ones are valid after every pass, corrupted ones are found."""

from __future__ import annotations

import dataclasses
import subprocess
import sys
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest

from language.ir.number_type import NUMBER_TYPES
from language.ir.ops import (
    Assign,
    Binary,
    Block,
    Branch,
    Call,
    Compare,
    Count,
    Expr,
    FaultBit,
    Item,
    Loop,
    Op,
    Ref,
    RunBlock,
    Select,
    Store,
    Switch,
    Unary,
    Value,
)
from language.ir.program import Program, Variable
from language.ir.rewrite_ops import map_operations
from language.ircheck.check_program import InvalidProgram, check_program, require_valid
from language.ircheck.violation import Rule
from language.loading.load import automaton_of, lower_automaton, program_of
from language.overlays.expand_document import expand_document, read_document
from tests.language.ircheck.program_stages import random_program, stages
from tests.language.spec_builders import ROOT, SHIPPED, automaton, load_shipped

AUTOMATA = [
    path.relative_to(ROOT).as_posix()
    for path in sorted((ROOT / "spec").rglob("*.yaml"))
    if expand_document(read_document(path), SHIPPED).kind == "automaton"
]


def require_valid_stages(program: Program) -> None:
    for stage in stages(program):
        require_valid(stage.program, stage.name, stage.properties)


# What is lowered is valid.


@pytest.mark.parametrize("name", AUTOMATA)
def test_a_shipped_spec_is_valid_after_every_pass(name: str) -> None:
    require_valid_stages(lower_automaton(load_shipped(name)))


@pytest.mark.parametrize("number", NUMBER_TYPES)
def test_random_specs_are_valid_after_every_pass(number: Any, tmp_path: Path) -> None:
    for seed in range(12):
        require_valid_stages(random_program(seed, number, tmp_path / str(seed)))


@pytest.mark.long
@pytest.mark.parametrize("first", range(12, 240, 12))
def test_more_random_specs_are_valid_after_every_pass(first: int, tmp_path: Path) -> None:
    for seed in range(first, first + 12):
        number = NUMBER_TYPES[seed % len(NUMBER_TYPES)]
        require_valid_stages(random_program(seed, number, tmp_path / str(seed)))


def test_a_program_with_inputs_that_vary_inside_a_step_is_valid() -> None:
    made = load_shipped("bmw_i3")
    for program in (lower_automaton(made, made.inputs), program_of(made, made.inputs)):
        assert check_program(program) == ()


REGION_WITHOUT_TRANSITIONS = """language: 1
automaton: idle
about: a region that never changes its mode
states: {x: {unit: m, initial: 0 m}}
flow: {x: der(x) = 1 m/s}
modes: {only: {transitions: {other: {when: x > 1 m}}}, other: {}}
regions: {side: {initial: alone, modes: {alone: {}}}}
initial: only
step: 10 ms
outputs: [x]
"""


def test_a_region_without_transitions_is_valid_after_every_pass() -> None:
    require_valid_stages(lower_automaton(automaton(REGION_WITHOUT_TRANSITIONS)))


# What is corrupted is found.


def machine() -> Program:
    """Return a small sampled Program with every operation."""
    return program_of(load_shipped("supervisor"))


def change_first(
    program: Program, matches: Callable[[Op], bool], replaced: Callable[[Any], Block]
) -> Program:
    """Return a Program with the first operation that matches replaced by others."""
    is_done = False

    def change(op: Op) -> Block:
        nonlocal is_done
        if is_done or not matches(op):
            return (op,)
        is_done = True
        return replaced(op)

    blocks = {name: map_operations(block, change) for name, block in program.blocks.items()}
    assert is_done, "nothing matches"
    return dataclasses.replace(program, blocks=blocks)


def with_ops(program: Program, *ops: Op, block: str = "step") -> Program:
    """Return a Program with operations at the end of a block."""
    blocks = {**program.blocks, block: (*program.blocks[block], *ops)}
    return dataclasses.replace(program, blocks=blocks)


def with_variables(program: Program, *variables: Variable) -> Program:
    """Return a Program with more variables."""
    return dataclasses.replace(program, variables=(*program.variables, *variables))


def of_type(program: Program, kind: str) -> str:
    """Return a scalar variable of a type that operations may write."""
    groups = ("memory.", "timer.", "work.", "discrete.", "state.")
    return next(
        v.name
        for v in program.variables
        if v.type == kind and not v.size and v.name.startswith(groups)
    )


def real_variable(program: Program) -> tuple[Program, Ref]:
    """Return a Program with a work variable of a real that is assigned and read."""
    made = with_variables(program, Variable("work.probe", "real"))
    made = with_ops(made, Assign("work.probe", Value(1.0)))
    return made, Ref("work.probe")


def array(program: Program, index: Expr) -> Program:
    """Return a Program that stores into an array of four elements at an index."""
    made = with_variables(program, Variable("work.list", "real", size=4))
    return with_ops(made, Store("work.list", index, Value(0.0)))


def without_assignment(program: Program) -> Program:
    """Return a Program in which a variable is read before it is assigned."""
    made = with_variables(program, Variable("work.probe", "real"), Variable("work.copy", "real"))
    return with_ops(
        made, Assign("work.copy", Ref("work.probe")), Assign("work.probe", Ref("work.copy"))
    )


def of_probe(make: Callable[[Ref], Op]) -> Callable[[Program], Program]:
    """Return a corruption that appends an operation on a real variable."""

    def corrupt(program: Program) -> Program:
        made, probe = real_variable(program)
        return with_ops(made, make(probe))

    return corrupt


def rename_mode(program: Program) -> Program:
    first, *others = program.transitions
    wrong = dataclasses.replace(first, target=99, chart_endpoints=("a", "b"))
    return dataclasses.replace(program, transitions=(wrong, *others))


def without_block(program: Program) -> Program:
    name = next(op.block for op in program.blocks["step"] if isinstance(op, RunBlock))
    blocks = {key: block for key, block in program.blocks.items() if key != name}
    return dataclasses.replace(program, blocks=blocks)


def without_variable(program: Program) -> Program:
    variables = tuple(v for v in program.variables if v.name != "memory.mode")
    return dataclasses.replace(program, variables=variables)


def declared_twice(program: Program) -> Program:
    return with_variables(program, program.variables[0])


def wrong_output(program: Program) -> Program:
    first, *others = program.outputs
    kind: Any = "truth" if first.type != "truth" else "real"
    outputs = (dataclasses.replace(first, type=kind), *others)
    return dataclasses.replace(program, outputs=outputs)


def count_too_far(program: Program) -> Program:
    return change_first(
        program,
        lambda op: isinstance(op, Count),
        lambda op: (dataclasses.replace(op, limit=2**40),),
    )


def wrong_case(program: Program) -> Program:
    def is_mode_switch(op: Op) -> bool:
        return isinstance(op, Switch) and op.selector == "memory.mode"

    return change_first(
        program, is_mode_switch, lambda op: (Switch(op.selector, (*op.cases, (77, ()))),)
    )


def unmarked(program: Program) -> Program:
    return with_ops(program, Assign("memory.mode", Ref("memory.mode", is_integer=False)))


def writing_in_pure_block(program: Program) -> Program:
    name = next(n for n in program.blocks if n.startswith(("choose_", "resolve_")))
    return with_ops(program, Assign("memory.mode", Value(0)), block=name)


MUTANTS: Mapping[str, tuple[Callable[[Program], Program], Rule, str]] = {
    "a block that is missing": (without_block, "reference", "there is no block `"),
    "a variable that is missing": (without_variable, "reference", "`memory.mode` is not declared"),
    "a variable declared twice": (declared_twice, "declaration", "is declared 2 times"),
    "a transition to no mode": (rename_mode, "reference", "has no mode 99"),
    "an output of another type": (wrong_output, "type", "it is "),
    "a read before every assignment": (
        without_assignment,
        "assignment",
        "`work.probe` is read, but no path assigns it before",
    ),
    "a sum of real and whole": (
        of_probe(lambda probe: Assign(probe.name, Binary("+", probe, Value(1)))),
        "type",
        "`+` of real and whole",
    ),
    "a quotient of whole numbers": (
        lambda program: with_ops(program, Assign("memory.mode", Binary("/", Value(4), Value(2)))),
        "type",
        "`/` of whole numbers",
    ),
    "a condition that is a number": (
        of_probe(lambda probe: Branch(probe, (Assign(probe.name, Value(0.0)),))),
        "type",
        "the condition is real, not truth",
    ),
    "an order of truth values": (
        of_probe(
            lambda probe: Branch(
                Compare("<", Value(True), Value(False)), (Assign(probe.name, Value(0.0)),)
            )
        ),
        "type",
        "`<` of truth values",
    ),
    "a choice of two types": (
        of_probe(lambda p: Assign(p.name, Select(Value(True), p, Value(False)))),
        "type",
        "a choice of real and truth",
    ),
    "a sign of a truth value": (
        of_probe(lambda p: Assign(p.name, Unary("-", Value(True)))),
        "type",
        "`-` of a truth",
    ),
    "a call with too few arguments": (
        of_probe(lambda p: Assign(p.name, Call("min", (p,)))),
        "type",
        "`min` has 1 arguments, not 2",
    ),
    "an unknown function": (
        of_probe(lambda p: Assign(p.name, Call("sinus", (p,)))),
        "reference",
        "there is no function `sinus`",
    ),
    "an index behind the array": (lambda p: array(p, Value(4)), "range", "index 4 of `work.list`"),
    "an index of a loop behind the array": (
        lambda p: with_ops(
            with_variables(array(p, Value(0)), Variable("work.k", "whole")),
            Loop(
                5,
                "work.k",
                (Store("work.list", Ref("work.k", is_integer=True), Value(1.0)),),
            ),
        ),
        "range",
        "index 0 .. 4 of `work.list`, which has 4 elements",
    ),
    "an element of a scalar": (
        of_probe(lambda p: Assign(p.name, Item(p.name, Value(0)))),
        "type",
        "`work.probe` is no array",
    ),
    "a whole number of 33 bits": (
        lambda p: with_ops(p, Assign("memory.mode", Value(2**32))),
        "range",
        "has more than 32 bits",
    ),
    "a case that is no mode": (wrong_case, "range", "`memory.mode` is never 77"),
    "a count beyond the counter": (count_too_far, "range", "the limit 1099511627776"),
    "a fault that is not declared": (
        lambda p: with_ops(p, FaultBit("typo")),
        "reference",
        "there is no fault `typo`",
    ),
    "an input that is written": (
        lambda p: with_ops(p, Assign(p.inputs[0].name, Value(0.0))),
        "interface",
        "is an input",
    ),
    "a mark that differs from the declaration": (
        unmarked,
        "type",
        "`memory.mode` is whole, but marked as not whole",
    ),
    "a selection that changes the mode": (
        writing_in_pure_block,
        "interface",
        "it writes `memory.mode`, but may write only work",
    ),
    "a block that runs itself": (
        lambda p: with_ops(p, RunBlock("step")),
        "reference",
        "it runs itself",
    ),
    "a block that nothing runs": (
        lambda p: dataclasses.replace(p, blocks={**p.blocks, "orphan": ()}),
        "dead-store",
        "no entry of the Program runs it",
    ),
    "a variable that nothing uses": (
        lambda p: with_variables(p, Variable("work.idle", "real")),
        "dead-store",
        "`work.idle` is declared, but no block uses it",
    ),
}


@pytest.mark.parametrize("name", MUTANTS)
def test_a_corrupted_program_is_found(name: str) -> None:
    corrupt, rule, text = MUTANTS[name]
    valid = machine()
    assert check_program(valid) == ()
    found = check_program(corrupt(valid))
    assert any(one.rule == rule and text in str(one) for one in found), list(map(str, found))


def test_a_result_that_nothing_reads_is_found_after_its_pass() -> None:
    made, _ = real_variable(machine())
    assert check_program(made) == ()
    (found,) = check_program(made, ("no-unread-results",))[-1:]
    assert str(found) == (
        "[dead-store] block step, `work.probe := 1.0`: nothing reads `work.probe`"
    )


def test_a_float32_program_has_no_other_literals() -> None:
    made, probe = real_variable(program_of(load_shipped("contactor")))
    assert check_program(made) == ()
    made = with_ops(made, Assign(probe.name, Value(0.1)))
    assert "0.1 is no float32" in str(check_program(made)[0])


def test_an_invalid_program_names_the_pass_and_the_places() -> None:
    with pytest.raises(InvalidProgram, match="the Program after `fast-path` is invalid") as error:
        require_valid(without_variable(machine()), "fast-path")
    assert "[reference] block step" in str(error.value)


# The checker costs little, and nothing when it is not asked for.


def test_programs_are_made_without_the_checker() -> None:
    code = (
        "import sys; from language.loading.load import load_automaton, program_of;"
        "from language.overlays.expand_document import Project; from pathlib import Path;"
        "program_of(load_automaton('contactor', Project(Path('.'))));"
        "sys.exit('language.ircheck.check_program' in sys.modules)"
    )
    subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=True)


def test_a_check_takes_less_time_than_the_front_end() -> None:
    document = read_document(SHIPPED.path_of("supervisor"))
    begin = time.process_time()
    made = lower_automaton(automaton_of(document, SHIPPED))
    front = time.process_time() - begin
    begin = time.process_time()
    assert check_program(made) == ()
    assert time.process_time() - begin < front
