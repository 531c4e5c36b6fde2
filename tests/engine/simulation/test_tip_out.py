"""The driveline of the paper against reference traces that our code did not make."""

from __future__ import annotations

import csv
import gzip
from pathlib import Path

import numpy as np
import pytest

import modewright as mw

PAPER = Path(__file__).parents[2] / "data" / "paper"
ALWAYS = ("w_em", "w_w", "theta_d", "theta_b")
DISCONTINUOUS = ("T_hs", "w_b")
"""They jump at a re-contact: samples within 2 us of an event are left out."""
MANOEUVRES = {
    "tip_out": (30, -20, "0.0740754719736 rad", "drive_contact"),
    "tip_in": (-20, 30, None, "coast_contact"),
    "step": (-20, -80, None, "coast_contact"),
}


def truth(name: str) -> list[dict[str, str]]:
    with gzip.open(PAPER / f"truth_{name}.csv.gz", "rt") as file:
        return list(csv.DictReader(file))


def scenario(name: str, folder: Path) -> str:
    """Write the manoeuvre as a scenario that starts where the reference trace starts."""
    first = truth(name)[0]
    before, after, _, _ = MANOEUVRES[name]
    spec = folder / "spec"
    spec.mkdir()
    starts = ", ".join(
        f"plant.{state}: {first[state]} {unit}"
        for state, unit in (
            ("w_em", "rad/s"),
            ("w_w", "rad/s"),
            ("theta_d", "rad"),
            ("theta_b", "rad"),
        )
    )
    (spec / "manoeuvre.yaml").write_text(
        f"language: 1\nscenario: manoeuvre\nof: ev_driveline_ideal\nhorizon: 2.5 s\n"
        f"initial: {{{starts}}}\n"
        f"inputs: {{T_req: {{start: {before} N*m, steps: {{0.4785 s: {after} N*m}}}}}}\n"
        "record: {every: 0.5 ms}\n"
    )
    if MANOEUVRES[name][3] == "coast_contact":
        (spec / "coasting.yaml").write_text(
            "language: 1\nvariant: coasting\nextends: driveline\ninitial: coast_contact\n"
        )
        (spec / "system.yaml").write_text(
            "language: 1\nvariant: coasting_system\nextends: ev_driveline_ideal\n"
            "instances: {plant: {of: coasting}}\n"
        )
        return "coasting_system"
    return "ev_driveline_ideal"


@pytest.mark.parametrize("name", MANOEUVRES)
def test_the_plant_follows_the_reference_trace(name: str, tmp_path: Path) -> None:
    system = scenario(name, tmp_path)
    trajectory = mw.simulate(system, "manoeuvre", root=tmp_path)
    with (PAPER / f"truth_{name}_events.csv").open() as file:
        expected = list(csv.DictReader(file))
    events = trajectory.events_of("plant")
    numbers = {"drive_contact": "1", "no_contact": "0", "coast_contact": "-1"}
    modes = [(numbers[e.source], numbers[e.target]) for e in events]
    assert modes == [(row["from"], row["to"]) for row in expected]
    times = np.array([event.time for event in events])
    assert np.all(np.abs(times - [float(row["t"]) for row in expected]) < 1e-6)
    rows = truth(name)
    near = np.zeros(len(rows), dtype=bool)
    for time in times:
        near |= np.abs(trajectory.times - time) < 2e-6
    for signal in (*ALWAYS, *DISCONTINUOUS):
        reference = np.array([float(row[signal]) for row in rows])
        kept = ~near if signal in DISCONTINUOUS else np.ones(len(rows), dtype=bool)
        difference = np.abs(trajectory.signals[f"plant.{signal}"] - reference)[kept]
        assert difference.max() <= 1e-6 * np.abs(reference).max(), signal
    mode = np.array([int(row["mode"]) for row in rows])
    assert np.array_equal(trajectory.signals["plant.mode"][~near], mode[~near])
