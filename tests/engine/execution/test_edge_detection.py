"""Edges in guards of a continuous automaton, by two ways of integration."""

from __future__ import annotations

from pathlib import Path

import pytest

import modewright as mw

RULE = "edges_of_a_continuous_automaton_are_events_of_their_argument"
FOLDER = Path(__file__).parents[2] / "semantics" / "rules" / RULE


def test_edges_are_seen_by_a_library_as_by_the_program() -> None:
    ours = mw.simulate("rig", "run", root=FOLDER).events
    theirs = mw.simulate("rig", "run", root=FOLDER, method="DOP853").events
    assert [(e.region, e.transition) for e in theirs] == [(e.region, e.transition) for e in ours]
    assert [e.time for e in theirs] == pytest.approx([e.time for e in ours], abs=1e-8)
    assert len(ours) == 10
