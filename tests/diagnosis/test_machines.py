"""Machines: a diagnosis names what naive models of real ones leave out."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.diagnosis.machines import Figure, emps, leaf


@pytest.mark.recordings
def test_friction_and_offset_of_the_servo_axis_are_named_with_their_published_values(
    recordings: Path,
) -> None:
    found = emps(recordings)
    assert found["effects"] == ["coulomb_friction", "sensor_offset"]
    off = found["off"]
    assert max(off["M"], off["F_v"], off["T_c"]) < 0.03
    assert off["offset"] < 0.06
    before, after = found["held_out_nrmse"]
    assert before > 0.17
    assert after < 0.06
    assert found["confirmed"]


@pytest.mark.recordings
def test_either_drive_of_the_leaf_shows_the_same_gap(recordings: Path) -> None:
    drives: list[Figure] = [
        leaf(recordings, "drive_eco", "drive_2"),
        leaf(recordings, "drive_2", "drive_eco"),
    ]
    for found in drives:
        assert found["first"] == "backlash@elements.half_shaft"
        assert found["effects"] == ["backlash"]
        assert found["confirmed"]
        assert found["falls_by"] > 0.3
    gaps = [found["half_gap"] for found in drives]
    assert max(gaps) < 1.35 * min(gaps)
    stiffness = [found["k_hs"] for found in drives]
    assert max(stiffness) < 1.2 * min(stiffness)
