"""Rules of docs/semantics.md: each folder beside this file is one, its outcome derived by hand."""

from __future__ import annotations

import operator
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

import modewright as mw

HERE = Path(__file__).resolve().parent
EVENT_TOLERANCE = 1e-9  # s
RELATIONS: dict[str, Callable[[float, float], bool]] = {
    ">": operator.gt,
    ">=": operator.ge,
    "<": operator.lt,
    "<=": operator.le,
}


@cache
def _expected(folder: Path) -> Mapping[str, Any]:
    """Return what is expected of a rule; nobody changes it."""
    text = (folder / "expected.yaml").read_text("utf-8")
    expected: dict[str, Any] = yaml.load(text, yaml.CSafeLoader)
    return expected


def _parameters(key: str, reason_key: str) -> list[Any]:
    """Return the folders whose expectation has one of the keys, marked where it has a reason."""
    found = []
    for path in sorted(HERE.glob("*/expected.yaml")):
        expected = _expected(path.parent)
        reason = expected.get(reason_key)
        marks = [pytest.mark.xfail(strict=True, reason=reason)] if reason else []
        if key in expected:
            found.append(pytest.param(path.parent, id=path.parent.name, marks=marks))
    return found


@pytest.mark.parametrize("folder", _parameters("about", "xfail"))
def test_rule(folder: Path) -> None:
    """Check one rule against the outcome that its text demands."""
    expected = _expected(folder)
    if "problems" in expected:
        for name, wanted in expected["problems"].items():
            _check_problems(folder, name, wanted)
    if "events" in expected:
        _check_run(folder, expected)


@pytest.mark.parametrize("folder", _parameters("events", "xfail_lockstep"))
def test_rule_in_lockstep(folder: Path) -> None:
    """Engine and C are equal bit by bit (rule 17), for every instance that has C."""
    expected = _expected(folder)
    trajectory, verdicts = mw.lockstep("rig", "run", root=folder, optimise="O0")
    compared = {verdict.name for verdict in verdicts if verdict.ticks}
    assert set(expected.get("lockstep", [])) <= compared
    assert all(verdict.is_equal for verdict in verdicts), verdicts
    assert compared or trajectory.stopped or all(verdict.note for verdict in verdicts)


def _check_problems(folder: Path, name: str, wanted: list[list[str]]) -> None:
    """Every wanted problem stands in its line, and no other line has one."""
    lines = (folder / "spec" / f"{name}.yaml").read_text("utf-8").splitlines()
    problems = [p for p in mw.check(name, root=folder) if p.severity == "error"]
    shown = [f"{p.span.line}: {p.label} {p.help}" for p in problems]
    numbers = set()
    for snippet, *texts in wanted:
        (number,) = [i for i, line in enumerate(lines, start=1) if snippet in line]
        numbers.add(number)
        here = " ".join(f"{p.label} {p.help}" for p in problems if p.span.line == number)
        assert here, f"no problem in line {number} `{snippet}`: {shown}"
        for text in texts:
            assert text in here, f"line {number} does not say `{text}`: {here}"
    assert {p.span.line for p in problems} == numbers, shown


def _check_run(folder: Path, expected: Mapping[str, Any]) -> None:
    trajectory = mw.simulate("rig", "run", root=folder)
    stopped = trajectory.stopped
    if "stopped" in expected:
        assert stopped is not None, "the run was not stopped"
        for text in expected["stopped"]:
            assert text in stopped, stopped
    else:
        assert stopped is None, stopped
    _check_events(trajectory, expected)
    _check_values(trajectory, expected)


def _check_events(trajectory: mw.Trajectory, expected: Mapping[str, Any]) -> None:
    """The events are these, in this order, and no others (unless `first_events`)."""
    wanted = [(w[0], w[1], float(w[2]), *w[3:]) for w in expected["events"]]
    found = list(trajectory.events)
    if expected.get("any_order"):
        wanted.sort(key=lambda w: w[0])
        found.sort(key=lambda e: e.instance)
    shown = "\n".join(str(e) for e in found[:20])
    if expected.get("first_events"):
        found = found[: len(wanted)]
    assert len(found) == len(wanted), f"{len(wanted)} events expected, found:\n{shown}"
    tolerance = expected.get("within", EVENT_TOLERANCE)
    for event, (instance, transition, time, *micro_step) in zip(found, wanted, strict=True):
        names = {event.transition, f"{event.source} -> {event.target}"}
        assert event.instance == instance and transition in names, shown
        assert abs(event.time - time) <= tolerance, f"{transition} at {time}:\n{shown}"
        assert not micro_step or event.micro_step == micro_step[0], shown


def _check_values(trajectory: mw.Trajectory, expected: Mapping[str, Any]) -> None:
    def value(signal: str, time: float) -> float:
        rows = np.flatnonzero(np.abs(trajectory.times - time) < 1e-9)
        assert rows.size, (
            f"no sample at {time} s: {trajectory.times[:3]} .. {trajectory.times[-3:]}"
        )
        return float(trajectory.signals[signal][rows[-1]])

    for signal, time, wanted, tolerance in expected.get("values", []):
        found = value(signal, time)
        assert abs(found - wanted) <= tolerance, f"{signal} at {time} s: {found}, not {wanted}"
    for signal, time, relation, bound in expected.get("bounds", []):
        found = value(signal, time)
        assert RELATIONS[relation](found, bound), f"{signal}: {found!r}, not {relation} {bound}"
    if "ends_by" in expected:
        assert trajectory.times[-1] <= expected["ends_by"], trajectory.times[-1]
