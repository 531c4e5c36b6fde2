"""Series: how a recording is laid on a grid, and which are thinned."""

from __future__ import annotations

import dataclasses
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from diagnosis.data.sampled_recording import (
    Hold,
    SampledRecording,
    decimate,
    has_feedthrough,
    interpolate,
    open_holds,
)
from diagnosis.model.candidate import compile_candidate
from diagnosis.pipeline.diagnosis_case import Case, read_series
from engine.recordings.recording_window import paths_overlap
from language.loading.load import automaton_of
from language.loading.recording_map_reader import read_map
from language.model.automaton import Automaton
from language.overlays.expand_document import Project, expand_document, read_document
from language.text.diagnostic import SpecError

PROJECT = Project(Path())


def case_of(spec: str) -> tuple[Case, Automaton]:
    document = read_document(PROJECT.path_of(spec))
    automaton = automaton_of(document, PROJECT)
    assert automaton.recording_map
    mapping = read_map(read_document(PROJECT.path_of(automaton.recording_map.text)), PROJECT)
    return Case(expand_document(document, PROJECT), PROJECT, mapping, ()), automaton


def leaf_like(path: Path) -> Path:
    """Motor speed rises by 1 rpm in 10 ms; wheel frames every 20 ms, 4 ms behind, 0.1 km/h up.

    The map takes the motor's speed to be from 10 ms later than its stamp.
    """
    rows = ["t_s,em_torque_Nm,em_speed_rpm,wheel_a_kmh,wheel_b_kmh,t_wheel_s"]
    for k in range(100):
        wheel = f"{0.1 * k:.1f},{0.1 * k:.1f},{0.01 * k + 0.004:.3f}" if k % 2 else ",,"
        rows.append(f"{0.01 * k:.2f},{k % 7},{k},{wheel}")
    path.write_text("\n".join(rows), "utf-8")
    return path


def test_a_grid_begins_with_a_compared_value_and_linear_inputs_run_between_stamps(
    tmp_path: Path,
) -> None:
    case, automaton = case_of("leaf_motor_side")
    (one,) = read_series(leaf_like(tmp_path / "drive.csv"), case, automaton, ("w_em",))
    assert one.start == Fraction(2, 100)
    rpm = one.measured[:, 0] * 30.0 / np.pi
    assert rpm == pytest.approx(np.arange(1.0, 1.0 + one.count))
    assert one.inputs[:, 0] == pytest.approx(np.arange(2, 2 + one.count) % 7)
    wheel = 0.1 * (np.arange(2, 2 + one.count) - 0.4)
    assert one.inputs[:, 1] * 3.6 == pytest.approx(wheel)


def test_a_part_of_a_file_is_cut_out_of_it(tmp_path: Path) -> None:
    case, automaton = case_of("leaf_motor_side")
    path = leaf_like(tmp_path / "drive.csv")
    whole, late = (
        read_series(file, case, automaton, ("w_em",))[0]
        for file in (path, path.with_name("drive.csv@0.5..0.8"))
    )
    assert (float(late.start), late.count) == (0.52, 28)
    assert late.name == "drive.csv@0.5..0.8"
    assert np.array_equal(late.measured, whole.measured[50:78])
    with pytest.raises(SpecError):
        read_series(path.with_name("drive.csv@5..8"), case, automaton, ("w_em",))


def test_parts_of_one_file_are_apart_unless_they_have_a_time_in_common() -> None:
    file = Path("run.csv")
    assert not paths_overlap(Path("run.csv@0..2"), Path("run.csv@2..4"))
    assert paths_overlap(Path("run.csv@0..2.5"), Path("run.csv@2..4"))
    assert paths_overlap(file, Path("run.csv@2..4"))
    assert not paths_overlap(file, Path("other.csv"))


def test_only_outputs_that_show_an_input_at_once_keep_a_recording_from_being_thinned() -> None:
    assert has_feedthrough(case_of("emps")[1], ("F_m",))
    assert has_feedthrough(case_of("brfd_damper")[1], ("F",))
    assert not has_feedthrough(case_of("blind_driveline")[1], ("w_em", "w_s"))
    assert not has_feedthrough(case_of("leaf_motor_side")[1], ("w_em",))


def test_what_is_shown_follows_from_the_input_of_its_own_sample() -> None:
    case, _ = case_of("emps")
    one = compile_candidate(case.document, PROJECT, (), (), ("F_m",), Fraction(1, 1000))
    ramp = 1e-3 * np.arange(50.0).reshape(-1, 1) ** 2
    nothing = np.zeros((1, 3, 1))
    blank, substeps = np.full((50, 1), np.nan), one.compiled.substeps
    page = np.array(list(one.predictor.page.values()))
    found = one.predictor.predict(
        page, ramp, blank, nothing[:0], nothing, substeps, linear_inputs=np.array([1])
    )
    q, v, _ = found.states.T
    force = 35.1507 * (160.18 * 243.45 * (ramp[:, 0] - q) - 243.45 * v)
    assert found.outputs[:, 0] == pytest.approx(force, rel=1e-12)
    assert np.all(np.abs(force[10:]) > 100.0)


def with_holds(*inputs: list[float]) -> SampledRecording:
    """A held input, a linear one and one whose hold is open."""
    columns = np.array(inputs).T
    holds: tuple[Hold, ...] = ("previous", "linear", None)
    return SampledRecording(
        "a", Fraction(1, 100), Fraction(0), columns, np.zeros((len(columns), 1)), holds=holds
    )


def test_each_input_is_averaged_and_interpolated_by_its_own_hold() -> None:
    ramp = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0]
    one = with_holds(ramp, ramp, ramp)
    thin = decimate(one, longest=Fraction(3, 100))
    assert thin.inputs[1].tolist() == [4.0, 3.0, 4.0]
    assert thin.linear_inputs.tolist() == [0, 1, 0]
    thin = decimate(one, is_first_order_hold=True, longest=Fraction(3, 100))
    assert thin.inputs[1].tolist() == [4.0, 3.0, 3.0]
    assert thin.linear_inputs.tolist() == [0, 1, 1]
    slower = interpolate(one, Fraction(15, 1000))
    assert slower.inputs[1].tolist() == [1.0, 1.5, 1.5]
    assert open_holds((one,)) == (True, False)


def test_the_map_says_the_hold_and_an_input_with_two_values_is_held(tmp_path: Path) -> None:
    file = tmp_path / "run.csv"
    rows = [f"{k / 100},{k % 2},{k * k},{k}" for k in range(60)]
    file.write_text("\n".join(["t,a,b,c", *rows]))
    case, automaton = case_of("blind_driveline")
    inputs = "a: {to: T_em, unit: N*m%s}, b: {to: T_br, unit: N*m%s}"
    head = "language: 1\nmap: columns\ntime: {column: t, unit: s}\ncolumns: "
    found = []
    for holds in (("", ""), (", hold: linear", ", hold: previous")):
        path = tmp_path / "columns.yaml"
        path.write_text(f"{head}{{{inputs % holds}, c: {{compare: w_em, unit: rad/s}}}}\n")
        mapping = read_map(read_document(path), PROJECT)
        (one,) = read_series(file, dataclasses.replace(case, mapping=mapping), automaton, ("w_em",))
        found.append(one.holds)
    assert found == [("previous", None), ("linear", "previous")]
