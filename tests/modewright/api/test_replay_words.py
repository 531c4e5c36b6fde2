"""Signals that are no quantities: truth values, whole numbers, enumerations and modes."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from language.text.diagnostic import SpecError
from modewright.api.simulation import Replayed, replay, simulate
from tests.engine.recording_files import render_problems

AUTOMATON = """language: 1
automaton: gears
period: 10 ms
numbers: float64
inputs:
  count: {type: int, range: [0, 10], default: 1}
  gear: {type: enum, values: [park, drive], default: park}
  key: {type: bool, default: true}
equations: {many: count > 2}
initial: waiting
modes:
  waiting: {number: 4, transitions: {start: {to: going, when: key and gear == drive}}}
  going: {number: 7}
outputs: [mode, many]
"""
SCENARIO = """language: 1
scenario: driven
of: gears
horizon: recording
recording: {file: run.csv, map: words}
"""
ReplayText = Callable[..., Replayed]


@pytest.fixture
def replay_text(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> ReplayText:
    """Return a function that replays a text with columns for all or the named signals."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "spec").mkdir()
    (tmp_path / "spec" / "gears.yaml").write_text(AUTOMATON, "utf-8")
    (tmp_path / "spec" / "driven.yaml").write_text(SCENARIO, "utf-8")

    def replaying(text: str, more: str = "", compiled: bool = False) -> Replayed:
        names = text.splitlines()[0].split(",")[1:]
        columns = [
            f"  {n}: {{{'compare' if n in ('mode', 'many') else 'to'}: {n}, unit: 1}}\n"
            for n in names
        ]
        head = "language: 1\nmap: words\ntime: {column: t, unit: s}\ncolumns:\n"
        (tmp_path / "spec" / "words.yaml").write_text(head + "".join(columns) + more, "utf-8")
        (tmp_path / "run.csv").write_text(text, "utf-8")
        return replay("gears", "run.csv", "words", root=str(tmp_path), compiled=compiled)

    return replaying


@pytest.fixture
def told(replay_text: ReplayText) -> Callable[[str], str]:
    """Return a function that returns the problems of a text."""

    def telling(text: str) -> str:
        with pytest.raises(SpecError) as caught:
            replay_text(text)
        return render_problems(caught.value.problems)

    return telling


class TestWords:
    @pytest.mark.parametrize("yes", ["TRUE", "true", "True", "1", "on", "YES"])
    def test_of_truth_values(self, replay_text: ReplayText, yes: str) -> None:
        result = replay_text(f"t,key\n0,FALSE\n0.01,{yes}\n").result
        assert result.trajectory.signals["in.key"].tolist() == [False, True]

    @pytest.mark.parametrize("name", ["drive", "Drive", "DRIVE", "1"])
    def test_of_an_enumeration(self, replay_text: ReplayText, name: str) -> None:
        result = replay_text(f"t,gear\n0,park\n0.01,{name}\n").result
        assert result.trajectory.signals["in.gear"].tolist() == [0, 1]

    def test_of_modes_and_truth_values_are_compared(self, replay_text: ReplayText) -> None:
        text = "t,gear,mode,many\n0,park,waiting,FALSE\n0.01,drive,going,false\n"
        first, second = replay_text(text).result.comparisons
        assert (first.output, first.largest) == ("mode", 0.0)
        assert (second.output, second.largest) == ("many", 0.0)

    def test_supply_a_scenario_too(self, replay_text: ReplayText, tmp_path: Path) -> None:
        replay_text("t,gear,key\n0,park,TRUE\n0.01,drive,TRUE\n0.02,drive,TRUE\n")
        trajectory = simulate("gears", "driven", root=str(tmp_path))
        assert [event.target for event in trajectory.events] == ["going"]

    def test_that_are_unknown_are_told_with_the_known_ones(
        self, told: Callable[[str], str]
    ) -> None:
        assert "its values are park, drive" in told("t,gear\n0,park\n0.01,reverse\n")
        assert "`x` in column `key` is no truth value" in told("t,key\n0,TRUE\n0.01,x\n")
        assert "`TRUE` in column `count` is not a finite" in told("t,count\n0,1\n0.01,TRUE\n")


class TestWholeNumbers:
    @pytest.mark.long
    def test_are_replayed_in_lock_step(self, replay_text: ReplayText) -> None:
        text = "t,count,gear,key\n0,0,0,0\n0.01,3,1,1\n0.02,12,5,1\n"
        verdict = replay_text(text, compiled=True).verdict
        assert verdict is not None
        assert verdict.is_equal

    def test_keep_their_type(self, replay_text: ReplayText) -> None:
        result = replay_text("t,count,gear,key\n0,0,0,0\n0.01,3.0,1,1\n0.02,12,5,1\n").result
        signals = result.trajectory.signals
        assert signals["in.count"].dtype.kind == signals["in.gear"].dtype.kind == "i"
        assert signals["many"].tolist() == [False, True, True]
        assert set(result.trajectory.faults) == {"gears: range_count", "gears: range_gear"}

    def test_may_be_constants_of_the_map(self, replay_text: ReplayText) -> None:
        result = replay_text("t,gear\n0,park\n0.01,drive\n", "constants: {count: 3}\n").result
        assert result.trajectory.signals["many"].tolist() == [True, True]

    def test_are_not_rounded_silently(self, told: Callable[[str], str]) -> None:
        assert "`count` is 0.5: no whole number" in told("t,count\n0,0\n0.01,0.5\n")
        assert "`gear` is 0.5: no whole number" in told("t,gear\n0,0\n0.01,0.5\n")
        assert "`key` is 2: no truth value" in told("t,key\n0,0\n0.01,2\n")
