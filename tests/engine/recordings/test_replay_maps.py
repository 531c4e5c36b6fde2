"""Maps in a replay: constants, comparisons, and what does not fit."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from language.overlays.expand_document import Project
from language.text.diagnostic import SpecError
from tests.engine.recording_files import render_problems
from tests.engine.replay_fixtures import LoadedReplay, load_replay

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
    def echoed(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> Callable[..., LoadedReplay]:
        """Return a function that replays CSV text through `echo` with the columns of a map."""
        monkeypatch.chdir(tmp_path)
        folder = tmp_path / "spec"
        folder.mkdir()

        def loading(columns: str, text: str) -> LoadedReplay:
            (folder / "echo.yaml").write_text(ECHO, "utf-8")
            (folder / "bench.yaml").write_text(HEAD + columns, "utf-8")
            path = tmp_path / "x.csv"
            path.write_text(text, "utf-8")
            return load_replay(path, "bench", "echo", project=Project(tmp_path))

        return loading

    def test_feeds_the_default_where_no_column_does(
        self, echoed: Callable[..., LoadedReplay]
    ) -> None:
        result = echoed("  a: {to: a, unit: A}\n", "t,a\n0,1\n0.01,2\n").replay()
        assert result.trajectory.signals["total"].tolist() == [8.0, 9.0]

    def test_may_feed_a_constant(self, echoed: Callable[..., LoadedReplay]) -> None:
        columns = "  a: {to: a, unit: A}\nconstants: {b: 500 mA}\n"
        result = echoed(columns, "t,a\n0,1\n0.01,2\n").replay()
        assert result.trajectory.signals["total"].tolist() == [1.5, 2.5]

    def test_takes_the_latest_value_up_to_and_at_the_tick(
        self, echoed: Callable[..., LoadedReplay]
    ) -> None:
        text = "t,a\n0,1\n0.001,2\n0.0099,3\n0.01,4\n0.011,5\n0.035,6\n0.04,7\n"
        result = echoed("  a: {to: a, unit: A}\n", text).replay()
        assert result.trajectory.signals["in.a"].tolist() == [1.0, 4.0, 5.0, 5.0, 7.0]

    def test_delays_a_column_by_exactly_its_delay(
        self, echoed: Callable[..., LoadedReplay]
    ) -> None:
        columns = "  a: {to: a, unit: A, delay: 10 ms}\n  b: {to: b, unit: A}\n"
        rows = "".join(f"{tick / 100},{tick},{tick}\n" for tick in range(5))
        trajectory = echoed(columns, "t,a,b\n" + rows).replay().trajectory
        assert trajectory.times.tolist() == [0.01, 0.02, 0.03, 0.04]
        assert trajectory.signals["in.a"].tolist() == [0.0, 1.0, 2.0, 3.0]
        assert trajectory.signals["in.b"].tolist() == [1.0, 2.0, 3.0, 4.0]

    def test_compares_an_output_at_the_ticks_with_a_new_value(
        self, echoed: Callable[..., LoadedReplay]
    ) -> None:
        columns = "  a: {to: a, unit: A}\n  y: {compare: total, unit: A, blank: skip}\n"
        result = echoed(columns, "t,a,y\n0,1,8\n0.01,2,\n0.02,3,13\n").replay()
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
                "spec/bench.yaml:5:3: error: column `a` is in `V`\n"
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
        self, echoed: Callable[..., LoadedReplay], columns: str, told: str
    ) -> None:
        with pytest.raises(SpecError) as caught:
            echoed(columns, "t,a,b,c\n0,1,1,1\n")
        assert render_problems(caught.value.problems) == told

    def test_that_leaves_no_tick_is_told(self, echoed: Callable[..., LoadedReplay]) -> None:
        ready = echoed("  a: {to: a, unit: A, delay: 1 s}\n", "t,a\n0,1\n0.5,2\n")
        with pytest.raises(SpecError, match="ticks") as caught:
            ready.replay()
        (problem,) = caught.value.problems
        assert str(problem.span).endswith("x.csv:1:1")
        assert problem.help == "`a` (time `t`) begins at 1 s, the recording ends at 0.5 s"

    def test_whose_time_leaps_is_told_at_the_recording(
        self, echoed: Callable[..., LoadedReplay]
    ) -> None:
        ready = echoed("  a: {to: a, unit: A}\n", "t,a\n0,1\n0.5,2\n1e9,3\n")
        with pytest.raises(SpecError, match="ticks") as caught:
            ready.replay()
        (problem,) = caught.value.problems
        assert str(problem.span).endswith("x.csv:1:1")
        assert problem.help.endswith("of its time stamps is from 0.5 s to 1e+09 s")

    def test_that_compares_another_dimension_is_told(
        self, echoed: Callable[..., LoadedReplay]
    ) -> None:
        columns = "  a: {to: a, unit: A}\n  b: {compare: total, unit: rpm}\n"
        with pytest.raises(SpecError):
            echoed(columns, "t,a,b\n0,1,1\n")

    def test_with_a_constant_that_does_not_fit_is_told(
        self, echoed: Callable[..., LoadedReplay]
    ) -> None:
        with pytest.raises(SpecError, match="constant `b` is in"):
            echoed("  a: {to: a, unit: A}\nconstants: {b: 5 V}\n", "t,a\n0,1\n")
