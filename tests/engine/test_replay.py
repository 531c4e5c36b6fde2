"""Replay: recordings through sampled automata, tick by tick."""

from __future__ import annotations

import csv
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from engine.interpreter import Stepper
from engine.recording import Recording, read_recording
from engine.replay import Replay, replay, used_columns
from engine.trajectory import Event
from language.load import automaton_of, program_of
from language.map import read_map
from language.model import Automaton, RecordingMap
from language.problem import Problems, SpecError, render_all
from language.program import Program
from language.project import Project, layered, read_document

ROOT = Path(__file__).parents[2]
PAPER = ROOT / "tests/data/paper"
TWIN = ROOT / "tests/data/leaf_twin/drive_twin.csv"
TWIN_SCRIPT = ROOT / "tests/make_leaf_twin.py"
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
class Loaded:
    """An automaton, its program, and a recording read for it."""

    automaton: Automaton
    program: Program
    mapping: RecordingMap
    recording: Recording

    def replayed(self, ticked: Callable[[Stepper], None] | None = None) -> Replay:
        return replay(self.automaton, self.program, self.recording, self.mapping, ticked=ticked)


def loaded(
    path: Path, map_name: str, name: str, variant: str | None = None, project: Project | None = None
) -> Loaded:
    project = project or Project(ROOT)
    document = read_document(project.path_of(name))
    if variant:
        over = read_document(project.path_of(variant))
        document = layered(document, over, project, Problems())
    automaton = automaton_of(document, project)
    mapping = read_map(read_document(project.path_of(map_name)), project)
    used, _ = used_columns(automaton, mapping)
    recording = read_recording(path, mapping, used)
    return Loaded(automaton, program_of(automaton), mapping, recording)


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
def replayed_trace(name: str) -> Replay:
    return loaded(PAPER / f"est_paper_{name}.csv.gz", "reference_trace", "estimator").replayed()


@cache
def replayed_twin(name: str) -> Replay:
    return loaded(TWIN, "leaf_can", name, "leaf").replayed()


def both(name: str) -> tuple[list[Moment], list[Moment]]:
    """Return our transitions in a reference trace, and those of the reference."""
    return own_events(replayed_trace(name)), reference_events(name)


@pytest.fixture(scope="module")
def twin() -> Loaded:
    return loaded(TWIN, "leaf_can", "estimator", "leaf")


@pytest.fixture(scope="module")
def golden() -> Replay:
    return replayed_trace("tip_out_1kHz")


class TestTheReferenceTraces:
    @pytest.mark.parametrize("name", TRACES)
    def test_give_the_sequence_of_transitions_of_the_reference(self, name: str) -> None:
        ours, theirs = both(name)
        assert [event[1:] for event in ours] == [event[1:] for event in theirs]

    @pytest.mark.parametrize("name", TRACES)
    def test_give_each_transition_within_one_tick_of_the_reference(self, name: str) -> None:
        ours, theirs = both(name)
        assert all(abs(a[0] - b[0]) <= 1 for a, b in zip(ours, theirs, strict=True))

    @pytest.mark.parametrize("name", TRACES)
    def test_lose_contact_in_the_same_tick_as_the_reference(self, name: str) -> None:
        ours, theirs = both(name)
        assert [e for e in ours if e[2] == 0] == [e for e in theirs if e[2] == 0]

    @pytest.mark.parametrize("name", ["tip_out", "tip_in"])
    def test_give_contact_after_it_began_in_the_plant(self, name: str) -> None:
        with (PAPER / f"truth_{name}_events.csv").open() as file:
            plant = [1000 * float(row["t"]) for row in csv.DictReader(file) if row["from"] == "0"]
        ours, _ = both(f"{name}_1kHz")
        contacts = [tick for tick, before, _ in ours if before == 0 and tick > 478]
        late = [tick - time for tick, time in zip(contacts, plant, strict=True)]
        assert all(0 <= milliseconds < ARRIVAL for milliseconds in late), late

    @pytest.mark.parametrize("name", TRACES)
    def test_give_the_torque_and_the_gap_position_of_the_reference(self, name: str) -> None:
        torque, position = replayed_trace(name).comparisons
        assert (torque.output, torque.unit) == ("T_hs", "N*m")
        assert torque.rms < TORQUE_ERROR
        assert (position.output, position.unit) == ("theta_b", "rad")
        assert position.rms < POSITION_ERROR

    def test_golden_the_estimated_torque_is_first_below_zero_at_507_ms(
        self, golden: Replay
    ) -> None:
        torque, times = golden.trajectory.signals["T_hs"], golden.trajectory.times
        assert times[1 + int(np.argmax(torque[1:] <= 0))] == 0.507

    def test_golden_with_a_wait_of_0_7_ms_the_mode_changes_at_508_ms(self, golden: Replay) -> None:
        first = golden.trajectory.events[0]
        assert (first.time, first.source, first.target) == (0.508, "drive", "gap")
        mode, times = golden.trajectory.signals["mode"], golden.trajectory.times
        assert mode[times == 0.507] == 1
        assert mode[times == 0.508] == 0

    def test_are_ticked_through_from_the_first_row_to_the_last(self, golden: Replay) -> None:
        assert golden.trajectory.times.tolist() == [tick / 1000 for tick in range(2501)]

    def test_without_noise_an_innovation_is_that_of_the_hand_over_alone(
        self, golden: Replay
    ) -> None:
        noisy = replayed_trace("tip_out_1kHz_noisy")
        assert golden.innovation_rms["y_w"] < 0.005
        assert noisy.innovation_rms["y_w"] == pytest.approx(0.05, rel=0.1)


class TestTheTwin:
    def test_is_what_its_script_writes(self, tmp_path: Path) -> None:
        again = tmp_path / "again.csv"
        subprocess.run([sys.executable, str(TWIN_SCRIPT), str(again)], check=True)
        assert again.read_bytes() == TWIN.read_bytes()

    def test_crosses_zero_torque_where_it_is_said_to(self) -> None:
        assert first_negative_torque(TWIN) == TWIN_CROSSING

    @pytest.mark.parametrize("name", ESTIMATORS)
    def test_leaves_drive_contact_once_and_reaches_coast_contact(self, name: str) -> None:
        result = replayed_twin(name)
        before_tip_in = tuple(e for e in result.trajectory.events if e.time < 12.5)
        assert_one_clean_tip_out(before_tip_in, TWIN_CROSSING)

    @pytest.mark.parametrize("name", ESTIMATORS)
    def test_returns_to_drive_contact_after_the_tip_in(self, name: str) -> None:
        result = replayed_twin(name)
        later = [(e.source, e.target) for e in result.trajectory.events if e.time >= 12.5]
        assert later == [("coast", "gap"), ("gap", "drive")]
        assert result.trajectory.signals["mode"][-1] == 1

    def test_is_seen_by_the_estimator_within_two_frames_of_the_truth(
        self, twin: Loaded, tmp_path: Path
    ) -> None:
        script = [sys.executable, str(TWIN_SCRIPT), str(tmp_path / "again.csv")]
        printed = subprocess.run(script, check=True, capture_output=True, text=True).stdout
        truth = [(float(t), int(mode)) for t, mode in csv.reader(printed.splitlines())]
        seen = own_events(twin.replayed())
        assert [mode for _, _, mode in seen] == [mode for _, mode in truth]
        late = [tick / 1000 - time for (tick, _, _), (time, _) in zip(seen, truth, strict=True)]
        assert all(0 <= seconds <= 0.02 for seconds in late), late

    def test_a_channel_without_a_new_value_in_a_tick_has_innovation_zero_there(
        self, twin: Loaded
    ) -> None:
        seen: dict[str, list[tuple[bool, float]]] = {"y_em": [], "y_w": []}

        def look(stepper: Stepper) -> None:
            for name, pairs in seen.items():
                pairs.append((stepper.get(f"is_new.{name}"), stepper.get(f"innovation.{name}")))

        twin.replayed(look)
        for name, frames in {"y_em": 1500, "y_w": 750}.items():
            assert sum(is_new for is_new, _ in seen[name]) == frames
            assert all(value == 0 for is_new, value in seen[name] if not is_new)
            assert sum(value != 0 for is_new, value in seen[name] if is_new) > 0.9 * frames

    def test_innovation_is_counted_at_new_values_in_contact_only(self, twin: Loaded) -> None:
        values: list[float] = []
        modes = [1]

        def look(stepper: Stepper) -> None:
            if len(modes) > 1 and modes[-1] != 0 and stepper.get("is_new.y_w"):
                values.append(stepper.get("innovation.y_w"))
            modes.append(stepper.get("memory.mode"))

        result = twin.replayed(look)
        rms = float(np.sqrt(np.mean(np.square(values))))
        assert result.innovation_rms["y_w"] == pytest.approx(rms, rel=1e-12)

    def test_inputs_are_held_between_samples(self, twin: Loaded) -> None:
        trajectory = twin.replayed().trajectory
        for name, source in {"in.T_em": "em_torque_Nm", "in.y_w": "wheels"}.items():
            channel = twin.recording.channels[source]
            stamps = np.array([float(time) for time in channel.times])
            at = np.searchsorted(stamps, trajectory.times + 1e-9, side="right") - 1
            assert np.array_equal(trajectory.signals[name], np.array(channel.values)[at])

    def test_the_first_tick_is_where_every_input_has_had_a_value(self, twin: Loaded) -> None:
        assert twin.recording.channels["em_torque_Nm"].times[0] == Fraction(10, 1000)
        assert twin.recording.channels["wheels"].times[0] == Fraction(13, 1000)
        trajectory = twin.replayed().trajectory
        assert trajectory.times[0] == 0.013
        assert trajectory.times[-1] == 15.0

    def test_the_blank_cell_of_the_last_row_is_left_out(self, twin: Loaded) -> None:
        simple = loaded(TWIN, "leaf_can", "estimator_simple", "leaf")
        command = simple.recording.channels["em_torque_cmd_Nm"]
        assert command.times[-1] == Fraction(1499, 100)
        assert simple.recording.end == 15

    def test_a_column_that_the_automaton_has_no_input_for_is_left_out(self, twin: Loaded) -> None:
        used, left_out = used_columns(twin.automaton, twin.mapping)
        assert used == ["em_torque_Nm", "em_speed_rpm", "wheels"]
        assert left_out == ["em_torque_cmd_Nm"]

    def test_replayed_again_gives_the_same(self, twin: Loaded) -> None:
        assert twin.replayed().trajectory.csv() == twin.replayed().trajectory.csv()


@pytest.mark.recordings
@pytest.mark.parametrize("name", ESTIMATORS)
@pytest.mark.parametrize("file", REAL_CROSSINGS)
def test_a_real_leaf_leaves_drive_contact_once_and_reaches_coast_contact(
    recordings: Path, file: str, name: str
) -> None:
    path = next(
        (p for p in (recordings / "nissan_leaf" / file, recordings / file) if p.exists()), None
    )
    if path is None:
        pytest.skip(f"no recording {file} below {recordings}")
    crossing = first_negative_torque(path)
    assert crossing == REAL_CROSSINGS[file]
    result = loaded(path, "leaf_can", name, "leaf").replayed()
    assert_one_clean_tip_out(result.trajectory.events, crossing)


ECHO = """language: 1
automaton: echo
period: 10 ms
numbers: float64
inputs:
  a: {unit: A}
  b: {unit: A, default: 7 A}
equations: {total: a + b}
initial: only
modes: {only: {number: 0}}
outputs: [total, mode]
"""
HEAD = "language: 1\nmap: bench\ntime: {column: t, unit: s}\ncolumns:\n"


class TestAMap:
    @pytest.fixture
    def echoed(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., Loaded]:
        """Return a function that replays CSV text through `echo` with the columns of a map."""
        monkeypatch.chdir(tmp_path)
        folder = tmp_path / "spec"
        folder.mkdir()

        def loading(columns: str, text: str) -> Loaded:
            (folder / "echo.yaml").write_text(ECHO, "utf-8")
            (folder / "bench.yaml").write_text(HEAD + columns, "utf-8")
            path = tmp_path / "x.csv"
            path.write_text(text, "utf-8")
            return loaded(path, "bench", "echo", project=Project(tmp_path))

        return loading

    def test_feeds_the_default_where_no_column_does(self, echoed: Callable[..., Loaded]) -> None:
        result = echoed("  a: {to: a, unit: A}\n", "t,a\n0,1\n0.01,2\n").replayed()
        assert result.trajectory.signals["total"].tolist() == [8.0, 9.0]

    def test_may_feed_a_constant(self, echoed: Callable[..., Loaded]) -> None:
        columns = "  a: {to: a, unit: A}\nconstants: {b: 500 mA}\n"
        result = echoed(columns, "t,a\n0,1\n0.01,2\n").replayed()
        assert result.trajectory.signals["total"].tolist() == [1.5, 2.5]

    def test_takes_the_latest_value_up_to_and_at_the_tick(
        self, echoed: Callable[..., Loaded]
    ) -> None:
        text = "t,a\n0,1\n0.001,2\n0.0099,3\n0.01,4\n0.011,5\n0.035,6\n0.04,7\n"
        result = echoed("  a: {to: a, unit: A}\n", text).replayed()
        assert result.trajectory.signals["in.a"].tolist() == [1.0, 4.0, 5.0, 5.0, 7.0]

    def test_delays_a_column_by_exactly_its_delay(self, echoed: Callable[..., Loaded]) -> None:
        columns = "  a: {to: a, unit: A, delay: 10 ms}\n  b: {to: b, unit: A}\n"
        rows = "".join(f"{tick / 100},{tick},{tick}\n" for tick in range(5))
        trajectory = echoed(columns, "t,a,b\n" + rows).replayed().trajectory
        assert trajectory.times.tolist() == [0.01, 0.02, 0.03, 0.04]
        assert trajectory.signals["in.a"].tolist() == [0.0, 1.0, 2.0, 3.0]
        assert trajectory.signals["in.b"].tolist() == [1.0, 2.0, 3.0, 4.0]

    def test_compares_an_output_at_the_ticks_with_a_new_value(
        self, echoed: Callable[..., Loaded]
    ) -> None:
        columns = "  a: {to: a, unit: A}\n  y: {compare: total, unit: A, blank: skip}\n"
        result = echoed(columns, "t,a,y\n0,1,8\n0.01,2,\n0.02,3,13\n").replayed()
        (comparison,) = result.comparisons
        assert comparison.largest == 3.0
        assert comparison.rms == pytest.approx(3 / np.sqrt(2), rel=1e-15)

    @pytest.mark.parametrize(
        ("columns", "told"),
        [
            (
                "  b: {to: b, unit: A}\n",
                "spec/bench.yaml:2:6: error: "
                "map `bench` gives no value for input `a` of `echo`\n"
                "  map: bench\n"
                "       ^^^^^",
            ),
            (
                "  a: {to: a, unit: V}\n",
                "spec/bench.yaml:5:3: error: column `a` is in `m^2*kg/s^3/A`\n"
                "    a: {to: a, unit: V}\n"
                "    ^\n"
                "help: input `a` is in `A`",
            ),
            (
                "  a: {to: a, unit: A}\n  c: {to: a, unit: A}\n",
                "spec/bench.yaml:6:3: error: input `a` is fed twice\n"
                "    c: {to: a, unit: A}\n"
                "    ^",
            ),
            (
                "  a: {to: a, unit: A}\n  c: {compare: totl, unit: A}\n",
                "spec/bench.yaml:6:3: error: `totl` is not an output of `echo`\n"
                "    c: {compare: totl, unit: A}\n"
                "    ^\n"
                "help: did you mean `total`?",
            ),
        ],
        ids=["input without value", "dimension", "fed twice", "unknown output"],
    )
    def test_that_does_not_fit_is_told_with_its_place(
        self, echoed: Callable[..., Loaded], columns: str, told: str
    ) -> None:
        with pytest.raises(SpecError) as caught:
            echoed(columns, "t,a,b,c\n0,1,1,1\n")
        assert render_all(caught.value.problems) == told

    def test_that_leaves_no_tick_is_told(self, echoed: Callable[..., Loaded]) -> None:
        ready = echoed("  a: {to: a, unit: A, delay: 1 s}\n", "t,a\n0,1\n0.5,2\n")
        with pytest.raises(SpecError, match="ticks"):
            ready.replayed()

    def test_that_compares_another_dimension_is_told(self, echoed: Callable[..., Loaded]) -> None:
        columns = "  a: {to: a, unit: A}\n  b: {compare: total, unit: rpm}\n"
        with pytest.raises(SpecError):
            echoed(columns, "t,a,b\n0,1,1\n")

    def test_with_a_constant_that_does_not_fit_is_told(self, echoed: Callable[..., Loaded]) -> None:
        with pytest.raises(SpecError, match="constant `b` is in"):
            echoed("  a: {to: a, unit: A}\nconstants: {b: 5 V}\n", "t,a\n0,1\n")
