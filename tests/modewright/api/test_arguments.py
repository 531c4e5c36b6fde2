"""Arguments of the public functions: natural forms are accepted, errors name the argument."""

from __future__ import annotations

import inspect
import itertools
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import modewright as mw
from language.text.diagnostic import SpecError
from modewright.api import effects, pass_output, spec_coverage, spec_tests, traceability
from modewright.api.new_project import write_skeleton

OTHER_FUNCTIONS = (
    effects.draw_signature,
    effects.find_effect,
    effects.list_effects,
    pass_output.compare_specs,
    pass_output.explain_spec,
    pass_output.spec_differences_json,
    pass_output.spec_json,
    spec_coverage.project_coverage_diagram,
    spec_tests.load_tests,
    traceability.trace_keys,
)
"""Functions behind commands that `modewright` itself does not offer."""
UNCHECKED_PARAMETERS = {"credentials", "executor", "problems", "progress", "tell", "warn"}
"""Functions and objects of the library: they are no names, paths, numbers or choices."""
VALID = {"stage": "model", "values": {}}
"""Arguments that are needed and are no name."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    root = tmp_path_factory.mktemp("arguments") / "project"
    write_skeleton("warm_room", root)
    return root


@pytest.fixture(scope="module")
def run(folder: Path) -> mw.Trajectory:
    return mw.simulate("warm_room", "cold_day", root=folder, compiled=False)


@pytest.fixture(autouse=True)
def in_project(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(folder)


def simulated(**values: Any) -> mw.Trajectory:
    named = {f"thermostat.{name}": value for name, value in values.items()}
    return mw.simulate("warm_room", "cold_day", named, compiled=False)


@pytest.mark.parametrize("value", [3, 3.0, np.float64(3.0), np.int64(3), np.float32(3.0)])
def test_a_number_is_a_value_in_the_declared_unit(value: object) -> None:
    assert simulated(P_max=value).csv() == simulated(P_max="3 kW").csv()


def test_a_small_number_is_written_as_the_language_wants_it() -> None:
    assert simulated(P_max=1e-7).csv() == simulated(P_max="1.0e-7 kW").csv()


def test_a_number_outside_of_the_range_is_a_problem_of_the_spec() -> None:
    with pytest.raises(SpecError, match="the value of `P_max` is outside its range"):
        simulated(P_max=-1)


@pytest.mark.parametrize(
    ("value", "error"),
    [
        (float("nan"), ValueError), (np.float64("inf"), ValueError), (None, TypeError),
        (True, TypeError), (np.bool_(True), TypeError), (b"3 kW", TypeError),
        ([1, 2], TypeError), (np.array([1.0, 2.0]), TypeError),
    ],
)  # fmt: skip
def test_other_values_are_refused_with_the_parameter(value: object, error: type[Exception]) -> None:
    with pytest.raises(error, match=r"the value of `thermostat\.P_max` is a"):
        simulated(P_max=value)


def test_paths_are_accepted_wherever_names_are(run: mw.Trajectory, folder: Path) -> None:
    spec = Path("spec")
    found = mw.simulate(spec / "system.yaml", spec / "cold_day.yaml", compiled=False)
    assert found.csv() == run.csv()
    assert mw.check(spec / "room.yaml") == mw.check("room", root=str(folder)) == []
    assert mw.graph(spec / "thermostat.yaml", root=".").name == "thermostat"
    assert mw.generate(spec / "thermostat.yaml", root=".") == mw.generate("thermostat")


def test_a_single_text_is_one_item(run: mw.Trajectory, tmp_path: Path) -> None:
    assert [one.passed for one in mw.run_tests("stays_warm", compiled=False)] == [True]
    assert mw.trace("thermostat") == mw.trace(["thermostat"])
    assert run.plot("room.*").data("svg") == run.plot(["room.*"]).data("svg")
    assert len(mw.compare(run, run, signals="room.T").signals) == 1
    recording = tmp_path / "x.csv"
    recording.write_text("t_s,v_rpm\n" + "".join(f"{k / 10},{k}\n" for k in range(50)))
    (checked,) = mw.check_recordings(str(recording)).recordings
    assert checked.name == "x.csv"
    with pytest.raises(SpecError, match="there is no spec named `nope`"):
        mw.trace("nope")


@pytest.mark.parametrize(
    ("call", "named"),
    [
        (lambda run: mw.lockstep("warm_room", "cold_day", numbers="float16"), "float64, float32"),  # type: ignore[arg-type]
        (lambda run: mw.lockstep("warm_room", "cold_day", optimise="O9"), "O0, O1, O2, O3, Os"),
        (lambda run: mw.lockstep("warm_room", "cold_day", target="arm"), "host, cortex-m4f"),
        (lambda run: mw.metrics("thermostat", numbers="half"), "float64, float32"),  # type: ignore[arg-type]
        (lambda run: mw.fuzz("thermostat", numbers="half"), "float64, float32"),  # type: ignore[arg-type]
        (lambda run: mw.fmu("thermostat", version="3"), "`version` is one of 2, 3, not '3'"),  # type: ignore[arg-type]
        (lambda run: list(mw.prove("thermostat", checks="nope")), "misra"),
        (lambda run: mw.import_calibration("x.dcm", "thermostat", form="xls"), "dcm, cdfx, csv"),
        (lambda run: mw.export_calibration("thermostat").text("xls"), "dcm, cdfx, csv"),
        (lambda run: run.plot().save("x.bmp"), r"`path` is x.bmp: a picture ends with \.png"),
        (lambda run: run.plot().save("x.gif"), r"`path` is x.gif: a picture ends with \.png"),
        (lambda run: run.plot().save("x"), r"`path` is x: a picture ends with \.png, \.svg, \.pdf"),
        (lambda run: run.plot().data("gif"), r"`form` is one of png, svg, pdf, not 'gif'"),
        (lambda run: mw.read("run.csv.json"), r"side file of a run: name the run, run\.csv"),
        (lambda run: mw.check("room", root="nope"), "`root` is an existing folder, not nope"),
        (lambda run: mw.check("room", root="x" * 5000), r"not x+\.\.\.: there is none"),
        (lambda run: mw.check("room", root="a\0b"), "`root` is a path, .*: it has a NUL character"),
        (lambda run: mw.check("room", root="README.md"), "not README.md: this is no folder"),
        (lambda run: run.events_of("nope"), "room, thermostat"),
        (lambda run: run.events_of("thermostatt"), "did you mean `thermostat`"),
        (lambda run: run.plot("x.*"), r"no signal matches `x\.\*`: the signals are room\.T, "),
        (lambda run: mw.check_recordings([]), "`files` is empty"),
        (lambda run: mw.diagnose("room", []), "`train` is empty"),
        (lambda run: mw.diagnose("room", "x.csv", held_out=""), "`held_out` has an empty name"),
        (lambda run: mw.fit("room", []), "`train` is empty"),
        (lambda run: mw.fit("room", "x.csv", []), "`parameters` is empty"),
        (lambda run: mw.trace([]), "`specs` is empty"),
        (lambda run: next(mw.run_tests([])), "`references` is empty"),
        (lambda run: list(mw.prove("thermostat", checks=[])), "`checks` is empty"),
        (lambda run: run.plot(signals=[]), "`signals` is empty"),
        (lambda run: mw.plot(run, signals=[]), "`signals` is empty"),
        (lambda run: mw.compare(run, run, signals=[]), "`signals` is empty"),
        (lambda run: mw.compare(run, run, relative=-1), "`relative` is -1"),
        (lambda run: mw.compare(run, run, relative=float("nan")), "`relative` is a number"),
        (lambda run: mw.compare(run, run, slack=-1), "`slack` is -1"),
        (lambda run: mw.compare(run, run, tolerances={"*": -1}), "at least 0"),
        (lambda run: mw.compare(run, run, span=(2.0, 1.0)), "`span` is a start and a later end"),
        (lambda run: run.plot(span=(1.0,)), "`span` is a start and a later end"),
        (lambda run: mw.sweep("study", "out", workers=-1), "`workers` is at least 0"),
        (lambda run: pass_output.explain_spec("room", "nope", {}), "document, model"),  # type: ignore[arg-type]
    ],
)  # fmt: skip
def test_a_wrong_choice_names_the_choices(
    run: mw.Trajectory, call: Callable[[mw.Trajectory], object], named: str
) -> None:
    with pytest.raises(ValueError, match=named):
        call(run)


@pytest.mark.parametrize("title", [float("nan"), 5, b"x"])
def test_a_title_is_a_text(run: mw.Trajectory, title: object) -> None:
    with pytest.raises(TypeError, match="`title` is a text, not"):
        mw.plot(run, title=title)  # type: ignore[arg-type]


def test_a_scenario_of_another_system_is_named_with_its_system(folder: Path) -> None:
    with pytest.raises(SpecError) as caught:
        mw.simulate("warm_room", "tip_out", root=folder)
    (problem,) = caught.value.problems
    label = "`tip_out` is a scenario of `ev_driveline`, not of `warm_room`"
    assert (problem.kind, problem.label) == ("form", label)
    assert problem.help == (
        "with `warm_room`: `plant.w_w` is not a state of an instance of `warm_room`"
    )


def test_an_instance_without_events_has_none(run: mw.Trajectory) -> None:
    quiet = simulated(T_low="0 degC")
    assert quiet.events_of("thermostat") == ()
    assert run.events_of("thermostat") != ()


def parameters() -> Iterator[tuple[Callable[..., object], str]]:
    public = (getattr(mw, name) for name in mw.__all__)
    functions: list[Callable[..., object]] = [one for one in public if inspect.isfunction(one)]
    for function in (*functions, *OTHER_FUNCTIONS):
        for name, parameter in inspect.signature(function).parameters.items():
            is_flag = str(parameter.annotation).startswith("bool")
            if name not in UNCHECKED_PARAMETERS and not is_flag:
                yield function, name


@pytest.mark.parametrize(
    ("function", "name"), [*parameters()], ids=lambda value: getattr(value, "__name__", value)
)
def test_each_public_function_refuses_an_object_as_any_argument(
    function: Callable[..., object], name: str, run: mw.Trajectory
) -> None:
    """The argument is named, and it is checked before a file is read: no spec `nope` exists."""
    given: dict[str, Any] = {"trajectory": run, "run": run, "a": run, "b": run, **VALID}
    if function is mw.read:
        given["run"] = "nope:nope"
    needed = {
        parameter.name: given.get(parameter.name, "nope")
        for parameter in inspect.signature(function).parameters.values()
        if parameter.default is inspect.Parameter.empty
    }
    for wrong in (object(), b"nope"):
        with pytest.raises((TypeError, ValueError), match=rf"`{name}` is |is no method"):
            found = function(**{**needed, name: wrong})
            list(itertools.islice(found, 1)) if inspect.isgenerator(found) else None
