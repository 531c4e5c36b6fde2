"""Stopping: a run that cannot go on keeps what was computed, and says why it stopped."""

from __future__ import annotations

from pathlib import Path

import pytest
from typer.testing import CliRunner

import modewright as mw
from modewright.cli.app import app
from modewright.cli.common.exit_codes import PROBLEMS
from tests.engine.finite_escape import RUNAWAY
from tests.language.spec_builders import project_of

BALL = """language: 1
automaton: ball
step: 1 ms
states: {z: {unit: m, initial: 0.5 m}, v: {unit: m/s, initial: 0 m/s}}
flow: {z: der(z) = v, v: der(v) = -10 m/s^2}
initial: flight
modes:
  flight:
    number: 0
    transitions: {bounce: {to: flight, when: z <= 0 m and v < 0 m/s, reset: {z: 0 m, v: -0.5 * v}}}
outputs: [z, v]
"""
RUN = "language: 1\nscenario: {name}\nof: {of}\nhorizon: 2 s\nrecord: {{every: 0.4 ms}}\n"
INPUT = "language: 1\nscenario: odd\nof: {of}\nhorizon: 2 s\ninputs: {{u: 1 / (time - 1 s)}}\n"
CART = """language: 1
automaton: cart
inputs: {u: {unit: 1/s}}
states: {x: {initial: 0}}
flow: {x: der(x) = u}
initial: only
modes: {only: {number: 0}}
outputs: [x]
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    project_of(
        tmp_path,
        runaway=RUNAWAY,
        ball=BALL,
        cart=CART,
        grows=RUN.format(name="grows", of="runaway"),
        bounces=RUN.format(name="bounces", of="ball"),
        odd=INPUT.format(of="cart"),
    )
    return tmp_path


def test_a_state_that_grows_without_bound_stops_the_run(folder: Path) -> None:
    """x = 1 / (0.1 - t) until it is no number."""
    found = mw.simulate("runaway", "grows", root=folder)
    assert found.stopped and "`runaway` in mode `only`: state `x` is" in found.stopped
    assert 0.0995 < found.times[-1] < 0.11
    row = int(0.05 / 0.4e-3)
    assert found.signals["runaway.x"][row] == pytest.approx(1 / (0.1 - found.times[row]), rel=1e-8)


def test_zeno_stops_the_run_with_its_guard_and_keeps_events_and_rows(folder: Path) -> None:
    """It falls for sqrt(0.1) s, then each flight is half as long: it ends at 3 sqrt(0.1) s."""
    found = mw.simulate("ball", "bounces", root=folder)
    end = 3 * 0.1**0.5
    assert found.stopped and "ball modes.flight.transitions.bounce" in found.stopped
    assert found.events[0].time == pytest.approx(0.1**0.5, abs=1e-12)
    assert len(found.events) > 40 and found.events[-1].time == pytest.approx(end, abs=1e-3)
    assert found.times[-1] == pytest.approx(end, abs=2e-3)


def test_an_input_that_is_no_number_is_refused_where_it_enters(folder: Path) -> None:
    found = mw.simulate("cart", "odd", root=folder)
    assert found.stopped and "`cart` in mode `only`" in found.stopped
    assert 0.99 <= found.times[-1] <= 1.0


def test_the_files_of_a_stopped_run_are_written(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(folder)
    result = CliRunner().invoke(app, ["simulate", "ball", "-s", "bounces", "--out", "run.csv"])
    assert result.exit_code == PROBLEMS
    assert "the run stopped: t = 0.9" in result.output
    rows = (folder / "run.csv").read_text().splitlines()
    assert rows[0] == "t [s],ball.z [m],ball.v [m/s]" and len(rows) > 2300
