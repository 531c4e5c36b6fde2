"""Table 1 of Guercioni et al. 2018: how late the estimators see that contact is lost."""

from __future__ import annotations

import pytest

import modewright as mw
from tests.language.spec_builders import ROOT

PUBLISHED = {"at_100Hz": 14e-3, "at_1kHz": 2e-3, "at_10kHz": 0.8e-3}
"""Delays [s] as printed."""
PRINTED_TO = 0.1e-3
"""Last digit printed [s]."""


@pytest.fixture(scope="module")
def run() -> mw.Trajectory:
    return mw.simulate("table_1", "nominal", root=ROOT / "tests/data/specs/table_1")


@pytest.mark.parametrize("rate", PUBLISHED)
def test_contact_lost_is_seen_as_late_as_published(run: mw.Trajectory, rate: str) -> None:
    lost = run.events_of("plant")[0]
    seen = run.events_of(rate)[0]
    assert (lost.target, seen.target) == ("no_contact", "gap")
    assert abs(seen.time - lost.time - PUBLISHED[rate]) <= PRINTED_TO


def test_at_100_hz_it_is_seen_5_ms_before_the_next_contact(run: mw.Trajectory) -> None:
    """The paper: "just 5 ms prior to the re-engagement"."""
    contact = run.events_of("plant")[1]
    seen = run.events_of("at_100Hz")[0]
    assert contact.target == "coast_contact"
    assert abs(contact.time - seen.time - 5e-3) <= PRINTED_TO
