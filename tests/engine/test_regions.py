"""The gap of the driveline as a parallel region: the same drive as with the gap in the chart."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import modewright as mw
from modewright.api import load

PLANT = Path(__file__).parent.parent.parent / "spec" / "ev_driveline" / "plant.yaml"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Write the driveline with its modes moved into a region `gap`, and the ideal system."""
    text = PLANT.read_text().replace("automaton: driveline", "automaton: driveline_beside")
    head, modes = text.split("initial: drive_contact\n")
    modes, outputs = modes.split("outputs:")
    inside = "".join(f"    {line}\n" for line in modes.splitlines())
    region = f"regions:\n  gap:\n    initial: drive_contact\n{inside}"
    spec = tmp_path / "spec"
    spec.mkdir()
    (spec / "plant.yaml").write_text(f"{head}{region}outputs:{outputs}")
    for name in ("driveline", "driveline_beside"):
        (spec / f"{name}_system.yaml").write_text(
            f"language: 1\nsystem: {name}_system\ninputs: {{T_req: {{unit: N*m}}}}\n"
            f"instances: {{plant: {{of: {name}}}}}\nconnections: {{plant.T_em: T_req}}\n"
        )
        (spec / f"{name}_tip_out.yaml").write_text(
            f"language: 1\nscenario: {name}_tip_out\nof: {name}_system\nhorizon: 2.5 s\n"
            "initial: {plant.theta_d: 0.0740754719736 rad}\n"
            "inputs: {T_req: {start: 30 N*m, steps: {0.4785 s: -20 N*m}}}\n"
        )
    return tmp_path


def test_a_gap_beside_the_chart_moves_as_the_gap_in_it(folder: Path) -> None:
    chart, beside = (
        mw.simulate(f"{name}_system", f"{name}_tip_out", root=folder)
        for name in ("driveline", "driveline_beside")
    )
    assert len(chart.events) == 10
    moves = [(event.time, event.source, event.target) for event in chart.events]
    assert [(event.time, event.source, event.target) for event in beside.events] == moves
    assert {event.region for event in beside.events} == {"gap"}
    for name in ("w_em", "w_w", "T_hs", "theta_d", "theta_b"):
        np.testing.assert_array_equal(
            chart.signals[f"plant.{name}"], beside.signals[f"plant.{name}"], err_msg=name
        )
    np.testing.assert_array_equal(beside.signals["plant.gap"], chart.signals["plant.mode"])


def test_an_automaton_without_modes_has_one(folder: Path) -> None:
    used = load("driveline_beside_system", "driveline_beside_tip_out", root=folder).system
    automaton = used.instances["plant"].automaton
    assert [mode.name for mode in automaton.modes.values()] == ["always"]
    assert [region.name for region in automaton.all_regions] == ["chart", "gap"]
