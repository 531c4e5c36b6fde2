"""Recorded: the naive specs of real machines, and how far each misses what was recorded."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import modewright as mw
from diagnosis.data_quality.output_comparison import FreeRun, simulate_free_run
from engine.recordings.recording import read_recording, split_by_windows
from language.loading.load import automaton_of, command_line_value
from language.loading.recording_map_reader import read_map
from language.model.automaton import Automaton
from language.model.system import RecordingMap
from language.overlays.expand_document import Project, read_document

PROJECT = Project(Path())
RPM = math.pi / 30
SPECS = (
    "blind_driveline", "leaf_motor_side", "leaf_vehicle", "emps", "brfd_damper", "bmw_i3",
)  # fmt: skip


def naive(name: str, values: dict[str, str]) -> tuple[Automaton, RecordingMap]:
    given = {key: command_line_value(text, name=key) for key, text in values.items()}
    automaton = automaton_of(read_document(PROJECT.path_of(name)), PROJECT, given)
    assert automaton.recording_map
    document = read_document(PROJECT.path_of(automaton.recording_map.text))
    return automaton, read_map(document, PROJECT)


def runs(name: str, path: Path, values: dict[str, str] | None = None) -> list[FreeRun]:
    automaton, mapping = naive(name, values or {})
    recording = read_recording(path, mapping, list(mapping.columns))
    found = [simulate_free_run(automaton, piece, mapping) for piece in split_by_windows(recording)]
    assert all(run.trajectory.stopped is None for run in found)
    return found


def rms(run: FreeRun, column: str) -> float:
    compared = run.comparisons[column]
    return float(np.sqrt(np.mean((compared.measured - compared.simulated) ** 2)))


def nrmse(run: FreeRun, column: str) -> float:
    return rms(run, column) / float(np.std(run.comparisons[column].measured))


@pytest.mark.parametrize("name", SPECS)
def test_its_map_feeds_every_input_and_compares_an_output(name: str) -> None:
    automaton, mapping = naive(name, {})
    columns = mapping.columns.values()
    assert {c.to for c in columns if c.to} == set(automaton.inputs)
    assert {c.compare for c in columns if c.compare} <= set(automaton.outputs)
    assert any(c.compare for c in columns)


def test_the_nominal_driveline_reads_the_columns_of_a_blind_case(tmp_path: Path) -> None:
    """At rest it rolls off under a constant torque as one inertia behind an elastic shaft does."""
    path = tmp_path / "case.csv"
    rows = [f"{k / 100},20,0,0,0" for k in range(301)]
    path.write_text("\n".join(["t_s,T_em_Nm,T_br_Nm,w_em_radps,w_w_radps", *rows]), "utf-8")
    (run,) = runs("blind_driveline", path)
    speed = run.comparisons["w_w_radps"].simulated
    assert speed[0] == 0.0
    steady = (9.0 * 20.0 - 45.0) / (135.0 + 81.0 * 0.05)
    assert speed[-1] == pytest.approx(3.0 * steady, rel=0.03)


@pytest.mark.recordings
@pytest.mark.parametrize("file", ["drive_eco.csv", "drive_2.csv"])
def test_without_a_gap_the_motor_of_the_leaf_is_missed_by_some_rpm(
    recordings: Path, file: str
) -> None:
    found = runs("leaf_motor_side", recordings / "nissan_leaf" / file)
    missed = [rms(run, "em_speed_rpm") / RPM for run in found]
    assert 5.0 < max(missed) < 35.0


@pytest.mark.recordings
def test_without_its_brake_the_leaf_is_missed_by_a_thousand_rpm(recordings: Path) -> None:
    (run,) = runs("leaf_vehicle", recordings / "nissan_leaf" / "drive_2.csv")
    assert rms(run, "em_speed_rpm") / RPM > 1000.0


@pytest.mark.recordings
def test_with_viscous_friction_alone_the_force_of_emps_is_missed_by_a_fifth(
    recordings: Path,
) -> None:
    (run,) = runs("emps", recordings / "emps" / "emps.csv.gz")
    assert 0.17 < nrmse(run, "vir") < 0.21


@pytest.mark.recordings
@pytest.mark.parametrize(
    ("file", "values"),
    [
        ("sine_0.5Hz_36lb_0.5in_1024Hz.csv.gz", {}),
        (
            "sine_0.5Hz_80lb_1in_1024Hz.csv.gz",
            {"F_up": "10.3 kN", "F_lo": "10.5 kN", "c_v": "33 kN*s/m"},
        ),
    ],
)
def test_without_its_gap_the_damper_is_missed_by_a_fifth(
    recordings: Path, file: str, values: dict[str, str]
) -> None:
    (run,) = runs("brfd_damper", recordings / "brfd_damper" / file, values)
    assert 0.18 < nrmse(run, "F_kN") < 0.26


@pytest.mark.recordings
def test_on_a_flat_road_the_i3_is_missed_by_some_km_per_h(recordings: Path) -> None:
    found = runs("bmw_i3", recordings / "bmw_i3" / "trip_a11.csv.gz")
    missed = [rms(run, "velocity_kmh") * 3.6 for run in found]
    assert len(found) == 24
    assert 4.0 < np.median(missed) < 9.0


@pytest.mark.recordings
@pytest.mark.parametrize(
    ("name", "files", "step", "rate"),
    [
        ("leaf_motor_side", ["nissan_leaf/drive_eco.csv", "nissan_leaf/drive_2.csv"], 0.5, 100),
        ("emps", ["emps/emps.csv.gz"], 0.0, 1000),
        ("brfd_damper", ["brfd_damper/sine_0.5Hz_36lb_0.5in_1024Hz.csv.gz"], 0.0, 1024),
        ("bmw_i3", ["bmw_i3/trip_a11.csv.gz"], 0.01, 10),
    ],
)
def test_real_recordings_are_taken_for_what_they_are(
    recordings: Path, name: str, files: list[str], step: float, rate: float
) -> None:
    found = mw.check_recordings([recordings / file for file in files], spec=name).check
    assert found.is_usable, found.findings
    torque = found.channels[-1 if name in ("emps", "brfd_damper") else 0]
    assert torque.quantum / torque.factor == pytest.approx(step, abs=1e-9)
    assert torque.rate == pytest.approx(rate, rel=1e-3)
