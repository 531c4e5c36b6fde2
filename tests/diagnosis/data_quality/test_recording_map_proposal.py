"""A proposed map: the columns of a recording find the signals of a spec by units, names, values."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from engine.recordings.recording import read_recording
from language.loading.load import load_automaton
from language.loading.recording_map_columns import type_columns
from language.loading.recording_map_reader import read_map
from language.model.system import ColumnMapping, RecordingMap
from language.overlays.expand_document import Project, read_document
from language.text.diagnostic import Source, SpecError
from language.text.project_files import parse_document
from modewright.api.recordings import propose_map
from modewright.cli.app import app
from modewright.cli.common.exit_codes import run_with_exit_code

SPEC = """\
language: 1
automaton: rig
recording_map: rig_columns
step: 1 ms
parameters:
  r: {value: 0.25 m}
  G: {value: 12 N/V}
  J: {value: 2 kg*m^2, range: [1, 3]}
inputs:
  T_em: {unit: N*m, range: [-400, 400]}
  T_amb: {unit: degC, default: 20 degC}
states:
  w_em: {unit: rad/s, initial: 100 rad/s, range: [-50, 1000]}
  w_w: {unit: rad/s, initial: 0 rad/s}
flow:
  w_em: J * der(w_em) = T_em
  w_w: J * der(w_w) = T_em
outputs: [w_em, w_w]
"""


def propose(folder: Path, text: str, spec: str = SPEC, name: str = "run.csv") -> RecordingMap:
    """Return the map that is proposed for a recording and a spec."""
    (folder / "spec").mkdir(exist_ok=True)
    (folder / "spec" / "rig.yaml").write_text(spec, "utf-8")
    (folder / name).write_text(text, "utf-8")
    written = propose_map(folder / name, "rig", root=folder)
    document = parse_document(Source("map.yaml", tuple(written.splitlines())), written)
    mapping = read_map(document, Project(folder))
    automaton = load_automaton("rig", Project(folder)) if "recording_map" not in spec else None
    mapping = type_columns(automaton, mapping) if automaton else mapping
    assert read_recording(folder / name, mapping, list(mapping.columns)).channels
    return mapping


def table(**columns: NDArray[np.float64]) -> str:
    """Return a text table with a time column `t_s` of 10 ms and these columns."""
    rows = zip(*columns.values(), strict=True)
    lines = [f"{0.01 * k:.2f},{','.join(map(str, row))}" for k, row in enumerate(rows)]
    return "\n".join([",".join(["t_s", *columns]), *lines]) + "\n"


N = 40
RAMP = np.linspace(0.0, 1.0, N)
WAVE = np.sin(9 * RAMP)


def signals(mapping: RecordingMap) -> dict[str, str]:
    """Return the names of the columns by signal."""
    return {c.to or c.compare or "": "+".join(c.columns) for c in mapping.columns.values()}


def column(mapping: RecordingMap, signal: str) -> ColumnMapping:
    (found,) = (c for c in mapping.columns.values() if signal in (c.to, c.compare))
    return found


def test_units_names_and_parameters_assign_the_columns(tmp_path: Path) -> None:
    mapping = propose(
        tmp_path,
        table(
            batt_V=380 + WAVE, motor_torque_cmd_Nm=90 * RAMP, motor_torque_Nm=80 * RAMP,
            motor_speed_rpm=900 + 500 * RAMP, wheel_speed_kmh=30 * RAMP,
        ),
    )  # fmt: skip
    assert mapping.name == "rig_columns"
    assert (mapping.time, mapping.time_unit.text) == ("t_s", "s")
    assert signals(mapping) == {
        "T_em": "motor_torque_Nm", "w_em": "motor_speed_rpm", "w_w": "wheel_speed_kmh",
    }  # fmt: skip
    assert column(mapping, "w_em").unit.text == "rpm"
    wheel = column(mapping, "w_w")
    assert wheel.unit.text == "km/h" and float(wheel.scale[0]) == 4.0


@pytest.mark.parametrize(
    ("torque", "speed"),
    [
        ("EngTorqueNm", "EngSpeed [1/min]"), ("Motor Torque (Nm)", "Motor Speed (rpm)"),
        ("tau_mot", "w_mot"),
        ("mot_trq", "mot_spd"), ("drehmoment_em", "drehzahl_em"), ("T_em", "w_em"),
    ],
)  # fmt: skip
def test_habits_of_naming_are_understood(tmp_path: Path, torque: str, speed: str) -> None:
    text = table(**{"x9": WAVE, speed: 900 + 50 * WAVE, torque: 80 * RAMP})
    assert signals(propose(tmp_path, text)) == {"T_em": torque, "w_em": speed}


@pytest.mark.parametrize(
    "name",
    ["em_speed_max", "em_speed_AliveCounter", "em_speed_status", "QU_em_speed", "em_speed_limit"],
)
def test_a_limit_or_a_counter_is_not_the_quantity(tmp_path: Path, name: str) -> None:
    text = table(**{name: 900 + 50 * WAVE, "motor_rate": 900 + 60 * WAVE, "em_torque_Nm": RAMP})
    assert signals(propose(tmp_path, text))["w_em"] == "motor_rate"


FRAMES = """\
VERSION ""
NS_ :
BS_:
BU_: ECU
BO_ 256 Motor: 4 ECU
 SG_ em_torque : 0|16@1- (0.25,0) [0|0] "Nm" ECU
 SG_ em_speed : 16|16@1- (1,0) [0|0] "rpm" ECU
BO_ 512 Wheels: 4 ECU
 SG_ wheel_l : 0|16@1- (0.01,0) [0|0] "km/h" ECU
 SG_ wheel_r : 16|16@1- (0.01,0) [0|0] "km/h" ECU
"""


def frame_table(unit: float, buses: tuple[int, ...] = (0,)) -> str:
    """Return a table of frames with whole stamps in a unit [s], two messages every 10 ms.

    The message of the motor is on bus 0 only.
    """
    rows = ["Time,ID,Bus,Length,Data"]
    for k in range(N):
        for bus in buses:
            messages = ((256, 4 * k, 900 + k), (512, 100 * k, 100 * k + 1))
            for key, a, b in messages[bus:]:
                data = struct.pack("<hh", a, b).hex(" ")
                rows.append(f"{round((5 + 0.01 * k) / unit)},0x{key:X},{bus},4,{data}")
    return "\n".join(rows) + "\n"


def propose_from_frames(folder: Path, text: str) -> RecordingMap:
    (folder / "spec").mkdir()
    (folder / "spec" / "rig.yaml").write_text(SPEC, "utf-8")
    (folder / "car.dbc").write_text(FRAMES, "utf-8")
    (folder / "frames.csv").write_text(text, "utf-8")
    written = propose_map(folder / "frames.csv", "rig", [str(folder / "car.dbc")], root=folder)
    document = parse_document(Source("map.yaml", tuple(written.splitlines())), written)
    mapping = read_map(document, Project(folder))
    assert read_recording(folder / "frames.csv", mapping, list(mapping.columns)).channels
    return mapping


@pytest.mark.parametrize(("unit", "name"), [(1e-3, "ms"), (1e-6, "us"), (1e-9, "ns")])
def test_the_unit_of_whole_stamps_follows_from_the_rate_of_frames(
    tmp_path: Path, unit: float, name: str
) -> None:
    mapping = propose_from_frames(tmp_path, frame_table(unit))
    assert (mapping.time, mapping.time_unit.text) == ("Time", name)
    assert signals(mapping) == {
        "T_em": "em_torque", "w_em": "em_speed", "w_w": "wheel_l+wheel_r",
    }  # fmt: skip


def test_a_rate_that_no_bus_has_gives_no_unit(tmp_path: Path) -> None:
    with pytest.raises(SpecError, match="the unit of the time `Time` is not known"):
        propose_from_frames(tmp_path, frame_table(3.0))


def test_sensors_on_two_buses_are_no_mean(tmp_path: Path) -> None:
    mapping = propose_from_frames(tmp_path, frame_table(1e-3, (0, 1)))
    wheel = column(mapping, "w_w")
    assert {name.split(".")[0] for name in wheel.columns} in ({"CAN0"}, {"CAN1"})
    assert len(wheel.columns) == 2


def test_without_a_unit_the_range_of_the_signal_tells_it(tmp_path: Path) -> None:
    text = table(mot_trq=80 * RAMP, mot_spd=900 + 6000 * RAMP)
    assert column(propose(tmp_path, text), "w_em").unit.text == "rpm"
    text = table(mot_trq=80 * RAMP, mot_spd=100 + 600 * RAMP)
    assert column(propose(tmp_path, text), "w_em").unit.text == "rad/s"


def test_sensors_of_two_sides_with_their_own_time_become_a_mean(tmp_path: Path) -> None:
    lines = ["t_s,em_torque_Nm,em_rpm,wheel_l_kmh,wheel_r_kmh,t_wheel_s"]
    for k in range(N):
        wheels = f"{20 + k},{20.1 + k},{0.01 * k:.3f}" if k % 2 else ",,"
        lines.append(f"{0.01 * k:.2f},{k},{900 + k},{wheels}")
    wheel = column(propose(tmp_path, "\n".join(lines) + "\n"), "w_w")
    assert wheel.columns == ("wheel_l_kmh", "wheel_r_kmh")
    assert (wheel.time, wheel.blank) == ("t_wheel_s", "skip")


def test_sensors_of_two_sides_that_differ_are_no_mean(tmp_path: Path) -> None:
    text = table(
        em_torque_Nm=RAMP, em_rpm=900 + WAVE, wheel_l_kmh=20 * RAMP, wheel_r_kmh=20 - 20 * RAMP
    )
    assert len(column(propose(tmp_path, text), "w_w").columns) == 1


def test_an_unknown_factor_is_left_to_a_person(tmp_path: Path) -> None:
    mapping = propose(tmp_path, table(iq_A=RAMP, em_rpm=900 + WAVE))
    current = column(mapping, "T_em")
    assert current.columns == ("iq_A",) and current.unit.text == "A"
    text = propose_map(tmp_path / "run.csv", "rig", root=tmp_path)
    assert "  # check the unit and the scale of this line\n" in text
    assert "input `T_amb` [degC] has no column: its default value is used" in text


def test_a_held_signal_has_few_levels(tmp_path: Path) -> None:
    coarse = np.round(20 * WAVE)
    assert column(propose(tmp_path, table(em_torque_Nm=coarse, em_rpm=WAVE)), "T_em").hold is None
    rng = np.random.default_rng(1)
    fine = rng.normal(size=N) * np.geomspace(1e-6, 1, N)
    assert column(propose(tmp_path, table(em_torque_Nm=fine, em_rpm=WAVE)), "T_em").hold == "linear"


def test_words_are_assigned_to_truth_values_and_enumerations(tmp_path: Path) -> None:
    spec = """\
language: 1
automaton: rig
period: 10 ms
numbers: float64
inputs: {key: {type: bool}, gear: {type: enum, values: [park, drive]}}
initial: a
modes:
  a: {transitions: {b: {when: key and gear == drive}}}
  b: {}
outputs: [mode]
"""
    text = "t_s,lever,ignition\n0,Park,OFF\n0.01,drive,ON\n"
    assert signals(propose(tmp_path, text, spec)) == {"key": "ignition", "gear": "lever"}


def test_a_recording_without_a_signal_is_refused(tmp_path: Path) -> None:
    spec = SPEC.replace("unit: degC, default: 20 degC", "unit: bar, default: 1 bar")
    with pytest.raises(SpecError, match="no column fits an input or output of `rig`"):
        propose(tmp_path, table(batt_temp_degC=RAMP), spec)


def test_odd_names_are_quoted(tmp_path: Path) -> None:
    text = table(**{'em "torque": #1 [Nm]'.replace('"', ""): RAMP, "yes": WAVE})
    mapping = propose(tmp_path, text)
    assert column(mapping, "T_em").columns == ("em torque: #1 [Nm]",)


def test_the_command_prints_or_writes_a_new_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    propose(tmp_path, table(em_torque_Nm=RAMP, em_rpm=900 + WAVE))
    monkeypatch.chdir(tmp_path)

    def call(*more: str) -> int:
        arguments = ["recording", "map", "run.csv", "--spec", "rig", *more]
        return run_with_exit_code(lambda: app(arguments, standalone_mode=False))

    assert call() == 0
    printed = capsys.readouterr().out
    assert call("--out", "spec/map.yaml") == 0
    assert (tmp_path / "spec" / "map.yaml").read_text("utf-8") == printed
    assert call("--out", "spec/map.yaml") == 1
    assert "corrections of a person" in capsys.readouterr().err
    assert call("--name", "1st") == 2
    capsys.readouterr()


RECORDED = {
    "emps/emps.csv.gz": ("emps", "emps_columns"),
    "brfd_damper/sine_0.5Hz_36lb_0.5in_1024Hz.csv.gz": ("brfd_damper", "brfd_columns"),
    "bmw_i3/trip_a11.csv.gz": ("bmw_i3", "bmw_columns"),
    "nissan_leaf/drive_eco.csv": ("leaf_motor_side", "leaf_motor_columns"),
    "nissan_leaf/drive_2.csv": ("leaf_vehicle", "leaf_vehicle_columns"),
    "silverbox/ms3.csv.gz": ("silverbox", ""),
    "pendulum/pend1.csv.gz": ("pendulum", ""),
    "kuka_axis/traj_A.csv.gz": ("kuka1", ""),
    "odrive/slow2_nocomp_0.csv.gz": ("odrive", ""),
}
"""Recordings of machines: the spec, and the map that a person wrote; without one it is beside the
recording."""
MAX_CORRECTIONS = 2


@pytest.mark.recordings
@pytest.mark.parametrize("file", RECORDED)
def test_a_proposed_map_of_a_real_recording_needs_two_corrections_at_most(
    recordings: Path, file: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    spec, map_name = RECORDED[file]
    path = recordings / file
    if not path.exists():
        pytest.skip(f"{file} is not among the recordings")
    monkeypatch.setenv("MODEWRIGHT_ALLOW_OUTSIDE", "1")
    if map_name:
        expected_file = Project(Path()).path_of(map_name)
    else:
        spec = str(path.parent / f"{spec}.yaml")
        (expected_file,) = path.parent.glob("map_*.yaml")
    expected = read_map(read_document(expected_file), Project(Path()))
    text = propose_map(path, spec)
    document = parse_document(Source("map.yaml", tuple(text.splitlines())), text)
    assert count_corrections(expected, read_map(document, Project(Path()))) <= MAX_CORRECTIONS


def count_corrections(expected: RecordingMap, proposed: RecordingMap) -> int:
    """Return the number of keys and lines that a person changes, adds or removes.

    Windows are a choice of a person and do not count. A unit with its scale counts by its product.
    """
    lines = {(c.to, c.compare): c for c in proposed.columns.values()}
    count = int((expected.time, expected.time_unit) != (proposed.time, proposed.time_unit))
    for wanted in expected.columns.values():
        line = lines.pop((wanted.to, wanted.compare), None)
        if line is None:
            count += 1
            continue
        count += set(line.columns) != set(wanted.columns)
        if line.unit.factor * line.scale[0] != wanted.unit.factor * wanted.scale[0]:
            count += (line.unit != wanted.unit) + (line.scale != wanted.scale)
        keys = ("sign", "delay", "time", "hold")
        count += sum(getattr(line, key) != getattr(wanted, key) for key in keys)
    return count + len(lines)
