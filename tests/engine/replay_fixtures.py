"""Replaying: estimators, recordings and maps loaded together, and events to compare."""

from __future__ import annotations

import csv
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from engine.interpreter.interpreter import Stepper
from engine.recordings.recording import Recording, read_recording
from engine.results.sampled_run import Event
from engine.simulation.replay import Replay, replay, used_columns
from language.ir.program import Program
from language.loading.load import automaton_of, program_of
from language.loading.recording_map_reader import read_map
from language.model.automaton import Automaton
from language.model.system import RecordingMap
from language.overlays.expand_document import Project, apply_variant, read_document
from language.text.diagnostic import Problems

ROOT = Path(__file__).parents[2]
PAPER = ROOT / "tests/data/paper"
TWIN = ROOT / "modewright/api/demo_data_files/recordings/leaf_tip_out/drive_twin.csv"
TWIN_SCRIPT = ROOT / "tests/data/synthetic_nissan_leaf/make_synthetic_recording.py"
ESTIMATORS = ("estimator", "estimator_simple")

Moment = tuple[int, int, int]
"""A transition: its tick [ms], mode before, mode after."""

TRACES = tuple(
    f"{name}_1kHz{noise}" for name in ("tip_out", "tip_in", "step") for noise in ("", "_noisy")
)
TORQUE_ERROR = 1.2
"""Root mean square [N*m] against the half-shaft torque of the reference, of up to 580 N*m: it
stems from the ticks in which one of the two is still in the gap, one tick of 10 at most."""
POSITION_ERROR = 1e-5
"""The same of theta_b [rad], of up to 0.0256 rad."""
ARRIVAL = 3.0
"""Contact is told at most so late [ms]: loss is seen up to 2 ms late, the wait takes a tick."""

NEAR = 0.15
"""The estimators leave drive contact that close [s] to the zero crossing of the torque report,
which lags the command by 30 to 60 ms and is quantised."""
QUIET = 5.0
"""So long [s] before that, nothing happens."""
TWIN_CROSSING = 8.25
"""First row of the twin with a negative torque report [s]."""
REAL_CROSSINGS = {"drive_eco.csv": 20.151, "drive_2.csv": 7.55}


@dataclass(frozen=True)
class LoadedReplay:
    """An automaton, its program, and a recording read for it."""

    automaton: Automaton
    program: Program
    mapping: RecordingMap
    recording: Recording

    def replay(self, ticked: Callable[[Stepper], None] | None = None) -> Replay:
        return replay(self.automaton, self.program, self.recording, self.mapping, on_tick=ticked)


def load_replay(
    path: Path, map_name: str, name: str, variant: str | None = None, project: Project | None = None
) -> LoadedReplay:
    project = project or Project(ROOT)
    document = read_document(project.path_of(name))
    if variant:
        over = read_document(project.path_of(variant))
        document = apply_variant(document, over, project, Problems())
    automaton = automaton_of(document, project)
    mapping = read_map(read_document(project.path_of(map_name)), project)
    used, _ = used_columns(automaton, mapping)
    recording = read_recording(path, mapping, used)
    return LoadedReplay(automaton, program_of(automaton), mapping, recording)


def reference_events(name: str) -> list[Moment]:
    """Return the transitions of the reference."""
    with (PAPER / f"est_paper_{name}_events.csv").open() as file:
        rows = list(csv.DictReader(file))
    return [(round(1000 * float(row["t"])), int(row["from"]), int(row["to"])) for row in rows]


def own_events(result: Replay) -> list[Moment]:
    numbers = {name: number for number, name in result.trajectory.modes["mode"].items()}
    return [
        (round(1000 * event.time), numbers[event.source], numbers[event.target])
        for event in result.trajectory.events
    ]


def first_negative_torque(path: Path) -> float:
    """Return where the torque report first is below zero after a pull [s]."""
    with path.open() as file:
        rows = [(float(row["t_s"]), float(row["em_torque_Nm"])) for row in csv.DictReader(file)]
    return next(time for time, torque in rows if torque < 0)


def assert_one_clean_tip_out(events: tuple[Event, ...], crossing: float) -> None:
    """Quiet before; drive contact is left once, near the crossing; coast contact follows."""
    left = [event for event in events if event.source == "drive"]
    assert [abs(event.time - crossing) <= NEAR for event in left] == [True]
    assert left[0].target == "gap"
    (after,) = (event for event in events if left[0].time < event.time <= crossing + 2.0)
    assert (after.source, after.target) == ("gap", "coast")
    assert not [event for event in events if crossing - QUIET < event.time < left[0].time]


@cache
def replay_trace(name: str) -> Replay:
    return load_replay(PAPER / f"est_paper_{name}.csv.gz", "reference_trace", "estimator").replay()


@cache
def replay_twin(name: str) -> Replay:
    return load_replay(TWIN, "leaf_can", name, "leaf").replay()


def transitions_of_both(name: str) -> tuple[list[Moment], list[Moment]]:
    """Return our transitions in a reference trace, and those of the reference."""
    return own_events(replay_trace(name)), reference_events(name)
