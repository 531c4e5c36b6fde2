"""System, values: what is set of an instance, in the file and by `--set`."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import pytest

from language.loading.system_reader import read_system
from language.model.system import System
from language.overlays.expand_document import read_document
from tests.language.loading.test_system_reader import (
    FILTER,
    JOINED,
    PAIR,
    PLANT,
    read_rig,
    system_problem_lines,
)
from tests.language.spec_builders import SHIPPED, project_of, raised_problems, scalar


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("values")
    project_of(path, plant=PLANT, filter=FILTER)
    return path


def test_an_instance_has_values_of_its_own(folder: Path) -> None:
    made = read_rig(folder, JOINED, "p: {of: plant, values: {k: 7 1/s}}, f: {of: filter}")
    assert made.instances["p"].automaton.parameters["k"].value == 7
    assert made.instances["f"].automaton.parameters["k"].value == Fraction(1, 2)


@pytest.mark.parametrize(
    ("instance", "label"),
    [
        ("f: {of: filter, values: {kk: 1}}", "there is no parameter `kk`"),
        ("f: {of: filter, values: {k: 1 m}}", None),
        ("f: {of: filter, offset: 3}", "`offset` is a time of at least 0 s"),
        ("f: {of: filter, offset: -1 ms}", "`offset` is a time of at least 0 s"),
        ("f: {of: filtr}", "there is no spec named `filtr`"),
        ("f: {}", "`of` is missing"),
        ("f: {of: rig_itself}", "there is no spec named `rig_itself`"),
        ("f: {of: filter, value: {k: 1}}", "`value` is not a key of `instances.f`"),
    ],
)
def test_an_instance_that_is_wrong_is_refused(
    folder: Path, instance: str, label: str | None
) -> None:
    found = system_problem_lines(folder, JOINED, f"p: {{of: plant}}, {instance}")
    assert found
    assert label is None or label in found


def test_a_derived_parameter_is_not_set(folder: Path) -> None:
    found = system_problem_lines(
        folder, JOINED, "p: {of: plant, values: {derived_one: 1 1/s}}, f: {of: filter}"
    )
    assert found == ["`derived_one` is derived: its value follows from others"]


CHARGER = """language: 1
automaton: charger
period: 10 ms
numbers: float64
parameters:
  retries: {value: 3, type: int, range: [0, 9]}
  key: {value: parked, type: enum, values: [parked, ready]}
  hot: {value: false, type: bool}
discrete: {count: {type: int, initial: 0, range: [0, 9]}}
initial: waiting
modes:
  waiting: {transitions: {over: {when: count >= retries or key == ready or hot}}}
  over: {}
outputs: [mode]
"""


def charger(folder: Path, values: str = "", **given: str) -> System:
    rig = f"language: 1\nsystem: rig\ninstances: {{chg: {{of: charger, values: {{{values}}}}}}}\n"
    project = project_of(folder, charger=CHARGER, rig=rig)
    overrides = {f"chg.{name}": scalar(text, "--set") for name, text in given.items()}
    return read_system(read_document(project.path_of("rig")), project, overrides)


def test_what_is_no_real_has_values_of_its_own(tmp_path: Path) -> None:
    """They have no unit, so none is taken over."""
    inside = charger(tmp_path, "retries: 2, key: ready, hot: true")
    outside = charger(tmp_path, retries="2", key="ready", hot="true")
    for made in (inside, outside):
        parameters = made.instances["chg"].automaton.parameters
        assert [parameters[name].value for name in ("retries", "key", "hot")] == [2, 1, 1]
    told = raised_problems(lambda: charger(tmp_path, retries="2 V"))
    assert [(one.span.source.name, one.label) for one in told] == [
        (
            "--set",
            "`parameters.retries.value` is a whole number from -2147483647 to 2147483647",
        )
    ]


def test_an_offset_is_a_time(folder: Path) -> None:
    made = read_rig(folder, JOINED, "p: {of: plant}, f: {of: filter, offset: 2.5 ms}")
    assert made.instances["f"].offset == Fraction(25, 10**4)
    assert read_rig(folder).instances["f"].offset == 0


def overridden(folder: Path, instances: str = PAIR, **texts: str) -> System:
    values = {name.replace("__", "."): scalar(text) for name, text in texts.items()}
    return read_rig(folder, JOINED, instances, "", values)


def k_of(made: System, instance: str) -> object:
    return made.instances[instance].automaton.parameters["k"].value


def test_a_value_is_set_by_parameter_in_every_instance_that_has_it(folder: Path) -> None:
    made = overridden(folder, own="8 m")
    assert made.instances["f"].automaton.parameters["own"].value == 8


def test_a_value_is_set_by_instance_and_parameter_in_that_one(folder: Path) -> None:
    made = overridden(folder, p__k="9 1/s")
    assert (k_of(made, "p"), k_of(made, "f")) == (9, Fraction(1, 2))
    made = overridden(folder, f__k="9")
    assert (k_of(made, "p"), k_of(made, "f")) == (2, 9)


def test_a_value_set_goes_before_the_value_of_the_file(folder: Path) -> None:
    instances = "p: {of: plant, values: {k: 7 1/s}}, f: {of: filter}"
    assert k_of(overridden(folder, instances, p__k="9 1/s"), "p") == 9


@pytest.mark.parametrize("first", [("f__k", "own"), ("own", "f__k")])
def test_several_values_are_set_together(folder: Path, first: tuple[str, str]) -> None:
    texts = {"f__k": "9", "own": "8 m"}
    made = overridden(folder, **{name: texts[name] for name in first})
    assert k_of(made, "f") == 9
    assert made.instances["f"].automaton.parameters["own"].value == 8


def test_the_value_of_one_instance_goes_before_that_of_all(folder: Path) -> None:
    made = overridden(folder, f__own="9 m", own="8 m")
    assert made.instances["f"].automaton.parameters["own"].value == 9


@pytest.mark.parametrize("name", ["kk", "p__own", "q__k", "p__kk"])
def test_a_value_for_what_no_instance_has_is_refused(folder: Path, name: str) -> None:
    problems = raised_problems(lambda: overridden(folder, **{name: "9"}))
    shown = name.replace("__", ".")
    assert problems[0].label in (
        f"no instance has a parameter `{shown}`",
        f"there is no parameter `{shown.rpartition('.')[2]}`",
    )


@pytest.mark.parametrize("text", ["9 s", "", "x + 1", "fast"])
def test_a_value_that_does_not_fit_is_refused_where_it_is_given(folder: Path, text: str) -> None:
    (problem, *_) = raised_problems(lambda: overridden(folder, p__k=text))
    assert problem.span.source.name == "here"


def test_a_bare_value_is_in_the_unit_of_the_parameter(folder: Path) -> None:
    assert k_of(overridden(folder, p__k="9"), "p") == 9


def test_a_model_takes_the_value_of_its_observer() -> None:
    shipped = read_document(SHIPPED.path_of("ev_driveline_ideal"))
    made = read_system(
        shipped, SHIPPED, {"m": scalar("1800 kg"), "est.k_hs": scalar("5000 N*m/rad")}
    )
    plant, est = (made.instances[name].automaton for name in ("plant", "est"))
    assert plant.parameters["m"].value == est.parameters["m"].value == 1800
    assert est.model is not None
    assert est.model.parameters["k_hs"].value == 5000
    assert plant.parameters["k_hs"].value == 4800
