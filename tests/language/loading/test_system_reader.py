"""System: instances, what they are connected to, and in which order they run."""

from __future__ import annotations

import itertools
from fractions import Fraction
from pathlib import Path

import pytest
from hypothesis import given, settings, strategies as st

from language.loading.system_reader import read_system
from language.model.system import System
from language.text.diagnostic import SpecError
from language.text.document import ScalarNode
from tests.language.spec_builders import document, problem_lines, project_of, raised_problems

PLANT = """language: 1
automaton: plant
parameters: {k: {value: 2 1/s}, derived_one: {derived: 3 * k, unit: 1/s}}
inputs: {u: {unit: m/s}, turn: {unit: rad/s, default: 0 rad/s}}
states: {x: {unit: m, initial: 0 m}, phi: {unit: rad, initial: 0 rad}}
equations: {far: x > 1 m}
flow: {x: der(x) = u - k * x, phi: der(phi) = turn}
modes: {only: {}}
outputs: [x, phi, far, mode]
"""
FILTER = """language: 1
automaton: filter
period: 10 ms
numbers: float64
parameters: {k: {value: 0.5}, own: {value: 3 m}}
inputs: {in_x: {unit: m}, ratio: {default: 1}, run: {type: bool, default: true}}
states: {x: {unit: m, initial: in_x}}
equations: {fine: run}
modes: {only: {update: {x: x + k * ratio * (in_x - x)}}}
outputs: [x, fine]
"""
SYSTEM = """language: 1
system: rig
inputs: {{speed: {{unit: km/h}}, angle: {{unit: rad}}, knob: {{unit: m, default: 5 mm}}}}
instances: {{{instances}}}
connections: {{{connections}}}
outputs: {{{outputs}}}
"""
PAIR = "p: {of: plant}, f: {of: filter}"
JOINED = "p.u: speed, f.in_x: p.x"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("rig")
    project_of(path, plant=PLANT, filter=FILTER)
    return path


def read_rig(
    folder: Path,
    connections: str = JOINED,
    instances: str = PAIR,
    outputs: str = "",
    overrides: dict[str, ScalarNode] | None = None,
) -> System:
    text = SYSTEM.format(instances=instances, connections=connections, outputs=outputs)
    return read_system(document(text), project_of(folder), overrides)


def system_problem_lines(
    folder: Path, connections: str = JOINED, instances: str = PAIR, outputs: str = ""
) -> list[str]:
    found = problem_lines(lambda: read_rig(folder, connections, instances, outputs))
    return [line.partition(" ")[2] for line in found]


# Connections.


def test_a_connection_joins_an_input_with_an_input_an_output_or_a_value(folder: Path) -> None:
    made = read_rig(folder, "p.u: 36 km/h, f.in_x: p.x, f.ratio: -2")
    found = {".".join(target): made.connections[target].source for target in made.connections}
    assert found == {"p.u": 10, "f.in_x": "p.x", "f.ratio": -2}
    assert read_rig(folder, "p.u: speed, f.in_x: knob").connections["f", "in_x"].source == "knob"


@pytest.mark.parametrize("value", ["3 mm", "0.003", "'0.003 m'"])
def test_a_bare_value_is_in_the_unit_of_the_input(folder: Path, value: str) -> None:
    made = read_rig(folder, f"p.u: speed, f.in_x: {value}")
    assert made.connections["f", "in_x"].source == Fraction(3, 1000)


@pytest.mark.parametrize(
    ("connection", "label"),
    [
        ("f.in_x: speed", "`speed` is in `m/s`, the input is in `m`"),
        ("f.in_x: p.phi", "`p.phi` is in `rad`, the input is in `m`"),
        ("f.ratio: angle", "`angle` is in `rad`, the input is in `1`"),
        ("f.ratio: p.phi", "`p.phi` is in `rad`, the input is in `1`"),
        ("f.in_x: 3 s", "`s` does not fit the unit `m`"),
        ("f.run: speed", "`speed` is in `m/s`, the input is true or false"),
        ("f.in_x: p.y", "`p.y` is not an input of the system or an output of an instance"),
        ("f.in_x: p.k", "`p.k` is not an input of the system or an output of an instance"),
        ("f.in_y: p.x", "`f.in_y` is not an input of an instance"),
        ("g.in_x: p.x", "`g.in_x` is not an input of an instance"),
        ("in_x: p.x", "`in_x` is not an input of an instance"),
        ("f.in_x: [p.x]", "`f.in_x` is a single value"),
        ("f.in_x: p.x + 1 s", "`+` joins `m` and `s`"),
    ],
)
def test_what_cannot_be_joined_is_refused(folder: Path, connection: str, label: str) -> None:
    rest = "p.u: speed" if connection.startswith("f.in_x") else JOINED
    assert label in system_problem_lines(folder, f"{rest}, {connection}")


def test_the_nearest_name_is_proposed(folder: Path) -> None:
    (first, second) = raised_problems(
        lambda: read_rig(folder, "p.u: sped, f.inx: p.x, f.in_x: p.x")
    )
    assert (first.help, second.help) == ("did you mean `speed`?", "did you mean `f.in_x`?")


def test_an_input_that_nothing_is_connected_to_needs_a_default(folder: Path) -> None:
    (problem,) = raised_problems(lambda: read_rig(folder, "p.u: speed"))
    assert problem.label == "input `f.in_x` is not connected"
    assert problem.help == "connect it, or give it a `default` in the automaton"
    assert system_problem_lines(folder, "f.in_x: p.x") == ["input `p.u` is not connected"]


@pytest.mark.parametrize("output", ["p.far", "p.mode", "f.fine"])
def test_a_truth_value_or_a_mode_is_no_number(folder: Path, output: str) -> None:
    instances = f"{PAIR}, g: {{of: filter}}"
    assert system_problem_lines(folder, f"{JOINED}, g.in_x: p.x, g.ratio: {output}", instances)


@pytest.mark.parametrize("source", ["p.far", "true"])
def test_a_truth_input_takes_a_truth_value(folder: Path, source: str) -> None:
    assert system_problem_lines(folder, f"{JOINED}, f.run: {source}") == []


def test_outputs_are_outputs_of_instances(folder: Path) -> None:
    assert read_rig(folder, JOINED, PAIR, "a: p.x, b: f.x").outputs == {"a": "p.x", "b": "f.x"}
    assert system_problem_lines(folder, JOINED, PAIR, "a: p.u") == [
        "`p.u` is not an output of an instance"
    ]


def test_inputs_of_a_system_have_units_and_defaults(folder: Path) -> None:
    inputs = read_rig(folder).inputs
    assert inputs["speed"].unit.factor == Fraction(1000, 3600)
    assert (inputs["speed"].default, inputs["knob"].default) == (None, Fraction(5, 1000))


# Order.

CHAIN = "p.u: speed, a.in_x: b.x, b.in_x: c.x, c.in_x: p.x"
THREE = "a: {of: filter}, b: {of: filter}, p: {of: plant}, c: {of: filter}"


def test_instances_run_after_those_that_they_read(folder: Path) -> None:
    assert read_rig(folder, CHAIN, THREE).order == ("p", "c", "b", "a")


def test_what_is_free_runs_in_the_order_of_the_file(folder: Path) -> None:
    free = "p.u: speed, a.in_x: p.x, b.in_x: p.x, c.in_x: p.x"
    assert read_rig(folder, free, THREE).order == ("p", "a", "b", "c")


@given(file=st.permutations("abcd"), chain=st.permutations("abcd"))
@settings(max_examples=15)
def test_any_chain_runs_from_its_start(folder: Path, file: list[str], chain: list[str]) -> None:
    instances = ", ".join(f"{name}: {{of: filter}}" for name in file)
    pairs = itertools.pairwise(chain)
    ends = [f"{later}.in_x: {earlier}.x" for earlier, later in pairs]
    made = read_rig(folder, ", ".join([f"{chain[0]}.in_x: knob", *ends]), instances)
    assert list(made.order) == chain


def test_a_circle_through_a_continuous_automaton_is_none(folder: Path) -> None:
    back = "p.turn: f.x, p.u: speed, f.in_x: p.x"
    spun = back.replace("p.turn: f.x", "p.u: f.v").replace(", p.u: speed", "")
    faster = FILTER.replace("filter", "driver").replace("outputs: [x", "outputs: [v, x")
    faster = faster.replace("{fine: run}", "{fine: run, v: x / 1 s}")
    project_of(folder, driver=faster)
    made = read_rig(folder, spun, "p: {of: plant}, f: {of: driver}")
    assert made.order == ("p", "f")


@pytest.mark.parametrize(
    ("connections", "chain"),
    [
        ("p.u: speed, a.in_x: a.x, b.in_x: p.x, c.in_x: p.x", "`a` -> `a`"),
        ("p.u: speed, a.in_x: b.x, b.in_x: a.x, c.in_x: p.x", "`a` -> `b` -> `a`"),
        ("p.u: speed, a.in_x: b.x, b.in_x: c.x, c.in_x: a.x", "`a` -> `c` -> `b` -> `a`"),
    ],
)
def test_a_circle_of_sampled_automata_is_refused(
    folder: Path, connections: str, chain: str
) -> None:
    (label,) = system_problem_lines(folder, connections, THREE)
    assert label == f"instances read each other at the same instant: {chain}"


def test_two_continuous_automata_are_not_joined(folder: Path) -> None:
    faster = PLANT.replace("plant", "mover").replace("[x, phi", "[w, x, phi")
    project_of(folder, mover=faster.replace("{far:", "{w: k * x, far:"))
    instances = "p: {of: plant}, q: {of: mover}"
    assert system_problem_lines(folder, "p.u: q.w, q.u: speed", instances) == [
        "`q` and `p` are both continuous"
    ]


def test_an_input_of_a_system_has_no_range(folder: Path) -> None:
    text = SYSTEM.format(instances=PAIR, connections=JOINED, outputs="")
    text = text.replace("speed: {unit: km/h}", "speed: {unit: km/h, range: [0, 99]}")
    (problem,) = raised_problems(lambda: read_system(document(text), project_of(folder)))
    assert problem.label == "`range` is not a key of `inputs.speed`"
    assert problem.help == "the range belongs to the input of the automaton that reads it"


@pytest.mark.parametrize(
    ("connections", "expected"),
    [
        ("p.u: q.x * 1 1/s, q.u: p.x * 1 1/s", ["`q` and `p` are both continuous"]),
        (
            "p.u: (q.x - p.x) * 1 1/s, q.u: (p.x - q.x) * 1 1/s",
            ["`q` and `p` are both continuous"],
        ),
        ("p.u: q.x * 1 1/s, p.turn: q.x * 1 rad/m/s, q.u: 0", ["`q` and `p` are both continuous"]),
        (
            "p.u: 'delay(p.x, 1 ms) * -1 1/s', q.u: 0",
            ["`p` is continuous and reads its own output `p.x`"],
        ),
        (
            "p.u: p.x * -1 1/s, q.u: q.x * 1 1/s + p.x * 1 1/s",
            ["`p` is continuous and reads its own output `p.x`", "`p` and `q` are both continuous"],
        ),
    ],
)
def test_a_pair_of_continuous_automata_is_reported_once(
    folder: Path, connections: str, expected: list[str]
) -> None:
    instances = "p: {of: plant}, q: {of: plant}"
    with pytest.raises(SpecError) as raised:
        read_rig(folder, connections, instances)
    assert [problem.label for problem in raised.value.problems] == expected
