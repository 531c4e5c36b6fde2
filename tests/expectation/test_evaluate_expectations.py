"""Every form of an expectation: one that is met, and a neighbour that is not, with its message."""

from __future__ import annotations

from pathlib import Path

from tests.expectation.latch_project import outcomes

MET = """\
{that: mode == low, at: 6 ms}
{that: mode == high, at: 7 ms}
{that: mode == high, at: 7 ms, within: 0 ms}
{that: mode == high, at: 31 ms, within: 1 ms}
{that: mode == high, before: 7 ms}
{that: mode == high, before: 32 ms, from: 21 ms}
{that: mode == high, after: level > 1 V, within: 2 ms}
{that: doubled > 5 V, after: low -> high, within: 23 ms}
{that: doubled >= 6 V and entered == 2, at: end}
{always: mode == low, until: 6.9 ms}
{always: in(low), from: 20 ms, until: 31.9 ms}
{always: mode != low, from: 32 ms}
{always: in(high), after: high, within: 8 ms}
{never: level > 2 V, until: 29.9 ms}
{never: mode == low, after: high, within: 8 ms}
{never: level > 3 V}
{event: low -> high, at: 7 ms}
{event: high, at: 31 ms, within: 1 ms}
{event: low, before: 20 ms}
{event: low, after: level < 0 V, within: 0 ms}
{event: high, count: 2}
{event: high, count: 1, from: 7.1 ms}
{event: high -> low}
{modes: [low, high, low, high]}
{modes: [high, low], from: 10 ms, until: 31 ms}
{that: count(mode) == 3, at: end}
{that: count(mode) == 2, at: 31 ms}
{that: count(level > 1 V) == 2, at: end}
{always: first(mode == high) < 7.1 ms, from: 7 ms}
{that: "rms(level, 30 ms) < 3.1 V and rms(level, 30 ms) > 2.9 V", at: end}
{that: rms(level) > 2.2 V, at: end}
"""
FAILED = {
    "{that: mode == low, at: 7 ms}": "is false at 0.007 s",
    "{that: mode == high, at: 6 ms, within: 0.9 ms}":
        "turned true at 0.007 s, expected at 0.006 s within 0.0009 s",
    "{that: mode == high, before: 6.9 ms}": "was not true by 0.0069 s",
    "{that: mode == high, after: level > 1 V, within: 1.9 ms}":
        "was not true within 0.0019 s after `level > 1 V` at 0.005 s",
    "{that: in(high), after: level > 5 V, within: 1 ms}": "`level > 5 V` never happened",
    "{that: doubled > 5 V, after: low -> high, within: 22 ms}":
        "was not true within 0.022 s after `low -> high` at 0.007 s",
    "{always: mode == low, until: 7 ms}": "is false at 0.007 s",
    "{always: in(high), after: high, within: 10 ms}": "the run ended at 0.04 s, before 0.042 s",
    "{always: mode == low, from: 10 ms, until: 12 ms}": "is false at 0.01 s",
    "{never: level > 2 V}": "is true at 0.03 s",
    "{never: mode == low, after: high, within: 13 ms}": "is true at 0.02 s",
    "{never: doubled > 0 V, from: 8.2 ms, until: 8.8 ms}":
        "no row lies from 0.0082 s to 0.0088 s: a smaller `every`",
    "{event: low -> high, at: 6 ms}": "happened at 0.007 s, expected at 0.006 s",
    "{event: low, before: 19.9 ms}": "did not happen by 0.0199 s",
    "{event: high, after: level > 1 V, within: 1.9 ms}":
        "did not happen within 0.0019 s after `level > 1 V` at 0.005 s",
    "{event: high, count: 3}": "happened 2 times, not 3",
    "{event: low, from: 21 ms}": "happened not once",
    "{modes: [low, high, low]}": "entered `high` at 0.032 s, after all that was expected",
    "{modes: [low, low]}": "was `high` from 0.007 s on, not `low`",
    "{modes: [low, high, low, high, low]}": "did not enter `low` after `high`",
    "{that: count(mode) == 3, at: 31 ms}": "is false at 0.031 s",
    "{that: rms(level) > 2.21 V, at: end}": "is false at 0.04 s",
}  # fmt: skip


def test_each_expectation_is_met(tmp_path: Path) -> None:
    lines = MET.splitlines()
    found = outcomes(tmp_path, *(f"e{k}: {line}" for k, line in enumerate(lines)))
    failed = [(lines[k], each.message) for k, each in enumerate(found) if not each.passed]
    assert not failed
    assert len(found) == len(lines)


def test_its_neighbour_fails_and_says_where(tmp_path: Path) -> None:
    found = outcomes(tmp_path, *(f"e{k}: {line}" for k, line in enumerate(FAILED)))
    assert {line: each.message for line, each in zip(FAILED, found, strict=True)} == FAILED
    assert not any(each.passed for each in found)


def test_a_failure_tells_time_modes_and_values(tmp_path: Path) -> None:
    (found,) = outcomes(tmp_path, "torque: {always: level < 3 V or entered > 1}")
    assert (found.time, found.modes) == (0.03, {"latch": "low"})
    assert found.values == {"level": 3.0, "latch.entered": 1}
