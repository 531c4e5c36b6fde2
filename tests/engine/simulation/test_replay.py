"""Replay: recordings through sampled automata, tick by tick."""

from __future__ import annotations

import csv
import subprocess
import sys
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from engine.interpreter.interpreter import Stepper
from engine.simulation.replay import Replay, used_columns
from tests.engine.replay_fixtures import (
    ARRIVAL,
    ESTIMATORS,
    PAPER,
    POSITION_ERROR,
    REAL_CROSSINGS,
    TORQUE_ERROR,
    TRACES,
    TWIN,
    TWIN_CROSSING,
    TWIN_SCRIPT,
    LoadedReplay,
    assert_one_clean_tip_out,
    first_negative_torque,
    load_replay,
    own_events,
    replay_trace,
    replay_twin,
    transitions_of_both,
)


@pytest.fixture(scope="module")
def twin() -> LoadedReplay:
    return load_replay(TWIN, "leaf_can", "estimator", "leaf")


@pytest.fixture(scope="module")
def golden() -> Replay:
    return replay_trace("tip_out_1kHz")


class TestTheReferenceTraces:
    @pytest.mark.parametrize("name", TRACES)
    def test_give_the_sequence_of_transitions_of_the_reference(self, name: str) -> None:
        ours, theirs = transitions_of_both(name)
        assert [event[1:] for event in ours] == [event[1:] for event in theirs]

    @pytest.mark.parametrize("name", TRACES)
    def test_give_each_transition_within_one_tick_of_the_reference(self, name: str) -> None:
        ours, theirs = transitions_of_both(name)
        assert all(abs(a[0] - b[0]) <= 1 for a, b in zip(ours, theirs, strict=True))

    @pytest.mark.parametrize("name", TRACES)
    def test_lose_contact_in_the_same_tick_as_the_reference(self, name: str) -> None:
        ours, theirs = transitions_of_both(name)
        assert [e for e in ours if e[2] == 0] == [e for e in theirs if e[2] == 0]

    @pytest.mark.parametrize("name", ["tip_out", "tip_in"])
    def test_give_contact_after_it_began_in_the_plant(self, name: str) -> None:
        with (PAPER / f"truth_{name}_events.csv").open() as file:
            plant = [1000 * float(row["t"]) for row in csv.DictReader(file) if row["from"] == "0"]
        ours, _ = transitions_of_both(f"{name}_1kHz")
        contacts = [tick for tick, before, _ in ours if before == 0 and tick > 478]
        late = [tick - time for tick, time in zip(contacts, plant, strict=True)]
        assert all(0 <= milliseconds < ARRIVAL for milliseconds in late), late

    @pytest.mark.parametrize("name", TRACES)
    def test_give_the_torque_and_the_gap_position_of_the_reference(self, name: str) -> None:
        torque, position = replay_trace(name).comparisons
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
        noisy = replay_trace("tip_out_1kHz_noisy")
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
        result = replay_twin(name)
        before_tip_in = tuple(e for e in result.trajectory.events if e.time < 12.5)
        assert_one_clean_tip_out(before_tip_in, TWIN_CROSSING)

    @pytest.mark.parametrize("name", ESTIMATORS)
    def test_returns_to_drive_contact_after_the_tip_in(self, name: str) -> None:
        result = replay_twin(name)
        later = [(e.source, e.target) for e in result.trajectory.events if e.time >= 12.5]
        assert later == [("coast", "gap"), ("gap", "drive")]
        assert result.trajectory.signals["mode"][-1] == 1

    def test_is_seen_by_the_estimator_within_two_frames_of_the_truth(
        self, twin: LoadedReplay, tmp_path: Path
    ) -> None:
        script = [sys.executable, str(TWIN_SCRIPT), str(tmp_path / "again.csv")]
        printed = subprocess.run(script, check=True, capture_output=True, text=True).stdout
        truth = [(float(t), int(mode)) for t, mode in csv.reader(printed.splitlines())]
        seen = own_events(twin.replay())
        assert [mode for _, _, mode in seen] == [mode for _, mode in truth]
        late = [tick / 1000 - time for (tick, _, _), (time, _) in zip(seen, truth, strict=True)]
        assert all(0 <= seconds <= 0.02 for seconds in late), late

    def test_a_channel_without_a_new_value_in_a_tick_has_innovation_zero_there(
        self, twin: LoadedReplay
    ) -> None:
        seen: dict[str, list[tuple[bool, float]]] = {"y_em": [], "y_w": []}

        def look(stepper: Stepper) -> None:
            for name, pairs in seen.items():
                pairs.append((stepper.get(f"is_new.{name}"), stepper.get(f"innovation.{name}")))

        twin.replay(look)
        for name, frames in {"y_em": 1500, "y_w": 750}.items():
            assert sum(is_new for is_new, _ in seen[name]) == frames
            assert all(value == 0 for is_new, value in seen[name] if not is_new)
            assert sum(value != 0 for is_new, value in seen[name] if is_new) > 0.9 * frames

    def test_innovation_is_counted_at_new_values_in_contact_only(self, twin: LoadedReplay) -> None:
        values: list[float] = []
        modes = [1]

        def look(stepper: Stepper) -> None:
            if len(modes) > 1 and modes[-1] != 0 and stepper.get("is_new.y_w"):
                values.append(stepper.get("innovation.y_w"))
            modes.append(stepper.get("memory.mode"))

        result = twin.replay(look)
        rms = float(np.sqrt(np.mean(np.square(values))))
        assert result.innovation_rms["y_w"] == pytest.approx(rms, rel=1e-12)

    def test_inputs_are_held_between_samples(self, twin: LoadedReplay) -> None:
        trajectory = twin.replay().trajectory
        for name, source in {"in.T_em": "em_torque_Nm", "in.y_w": "wheels"}.items():
            channel = twin.recording.channels[source]
            stamps = np.array([float(time) for time in channel.times])
            at = np.searchsorted(stamps, trajectory.times + 1e-9, side="right") - 1
            assert np.array_equal(trajectory.signals[name], np.array(channel.values)[at])

    def test_the_first_tick_is_where_every_input_has_had_a_value(self, twin: LoadedReplay) -> None:
        assert twin.recording.channels["em_torque_Nm"].times[0] == Fraction(10, 1000)
        assert twin.recording.channels["wheels"].times[0] == Fraction(13, 1000)
        trajectory = twin.replay().trajectory
        assert trajectory.times[0] == 0.013
        assert trajectory.times[-1] == 15.0

    def test_the_blank_cell_of_the_last_row_is_left_out(self, twin: LoadedReplay) -> None:
        simple = load_replay(TWIN, "leaf_can", "estimator_simple", "leaf")
        command = simple.recording.channels["em_torque_cmd_Nm"]
        assert command.times[-1] == Fraction(1499, 100)
        assert simple.recording.end == 15

    def test_a_column_that_the_automaton_has_no_input_for_is_left_out(
        self, twin: LoadedReplay
    ) -> None:
        used, left_out = used_columns(twin.automaton, twin.mapping)
        assert used == ["em_torque_Nm", "em_speed_rpm", "wheels"]
        assert left_out == ["em_torque_cmd_Nm"]

    def test_replayed_again_gives_the_same(self, twin: LoadedReplay) -> None:
        assert twin.replay().trajectory.csv() == twin.replay().trajectory.csv()


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
    result = load_replay(path, "leaf_can", name, "leaf").replay()
    assert_one_clean_tip_out(result.trajectory.events, crossing)
