"""What an importer does wrong is refused with a message, changes nothing, and crashes nothing."""

from __future__ import annotations

import math
from ctypes import c_double, c_uint
from functools import partial
from typing import Any

import pytest

from codegen.exchange.fmi.variable import Version
from tests.codegen.exchange.fmi.conftest import Ready
from tests.codegen.exchange.fmi.error_assertions import PERIOD, REAL, assert_refused
from tests.codegen.exchange.fmi.importer import Importer


@pytest.mark.parametrize(
    ("size", "words"),
    [
        (0.0015, ("0.0015 s is no whole multiple", "period of 0.001")),
        (0.0005, ("0.0005",)),
        (PERIOD * (1.0 + 2e-9), ("no whole multiple",)),
        (0.0, ("a step of 0 s",)),
        (-PERIOD, ("a step of -0.001",)),
        (math.nan, ("a step of nan s",)),
        (math.inf, ("a step of inf s",)),
        (1e300, ("a step of 1",)),
        (2.0, ("ends after the stop at 1 s",)),
    ],
)
def test_a_step_that_is_not_some_periods_is_refused(
    size: float, words: tuple[str, ...], stepping: Importer
) -> None:
    before = stepping.get(["time", "state.w_em"])
    assert_refused(stepping, lambda: stepping.step(0.0, size), *words)
    assert stepping.get(["time", "state.w_em"]) == before
    stepping.step(0.0, PERIOD * (1.0 + 0.5e-9))
    assert stepping.get(["time"]) == {"time": PERIOD}


@pytest.mark.parametrize("point", [PERIOD, -PERIOD, math.nan, math.inf])
def test_a_step_from_another_time_is_refused(point: float, stepping: Importer) -> None:
    assert_refused(stepping, lambda: stepping.step(point, PERIOD), "the instance is at 0 s")


def test_sums_of_steps_may_drift_far_from_the_start(importer: Importer) -> None:
    start = 123456.7
    importer.start({}, start=start)
    point = start
    for _ in range(200):
        importer.step(point, (point + PERIOD) - point)
        point += PERIOD
    assert importer.get(["time"])["time"] == pytest.approx(start + 0.2, abs=1e-9)


def test_calls_in_a_wrong_phase_are_refused(importer: Importer) -> None:
    assert_refused(importer, lambda: importer.step(0.0, PERIOD), "DoStep", "has not been entered")
    assert_refused(importer, lambda: importer.get(["T_hs"]), "`T_hs` has no value before")
    assert_refused(importer, importer.slave.exitInitializationMode, "has not been entered")
    assert_refused(importer, importer.slave.terminate, "has not been entered")
    importer.enter()
    assert_refused(importer, lambda: importer.step(0.0, PERIOD), "has not been left")
    assert_refused(importer, importer.enter, "has not been left")
    importer.slave.exitInitializationMode()
    assert_refused(importer, importer.slave.exitInitializationMode, "initialization is over")
    importer.slave.terminate()
    assert_refused(importer, lambda: importer.step(0.0, PERIOD), "was terminated")
    assert_refused(importer, lambda: importer.set({"y_em": 1.0}), "was terminated")
    assert_refused(importer, importer.slave.terminate, "was terminated")
    assert importer.get(["mode"]) == {"mode": 1}


def test_a_reset_gives_back_the_start_values(stepping: Importer) -> None:
    stepping.set({"J_em": 0.06, "T_em": 30.0})
    stepping.step(0.0, PERIOD)
    stepping.slave.reset()
    assert stepping.get(["J_em", "T_em"]) == {"J_em": 0.05, "T_em": 0.0}
    stepping.start({})
    assert stepping.get(["time"]) == {"time": 0.0}


@pytest.mark.parametrize("span", [(math.nan, None), (math.inf, None), (0.0, -1.0), (0.0, math.nan)])
def test_a_span_that_is_none_is_refused(
    span: tuple[float, float | None], importer: Importer
) -> None:
    assert_refused(importer, lambda: importer.enter(*span), "it starts at")


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_a_number_that_is_not_finite_is_refused_by_name(value: float, stepping: Importer) -> None:
    assert_refused(stepping, lambda: stepping.set({"y_em": value}), "`y_em` is ", "it may be from")
    assert stepping.get(["y_em"]) == {"y_em": 81.0}


def test_a_parameter_outside_of_its_range_is_refused(stepping: Importer) -> None:
    assert_refused(stepping, lambda: stepping.set({"J_em": 0.3}), "`J_em` is 0.29", "to 0.2")


def test_a_refused_call_sets_nothing(stepping: Importer) -> None:
    assert_refused(stepping, lambda: stepping.set({"y_w": 11.0, "T_em": math.nan}), "`T_em`")
    assert stepping.get(["y_w", "T_em"]) == {"y_w": 10.0, "T_em": 0.0}


@pytest.mark.parametrize("name", ["time", "T_hs", "state.w_em"])
def test_what_is_shown_is_not_set(name: str, stepping: Importer) -> None:
    assert_refused(
        stepping, lambda: stepping.set({name: 1.0}), f"`{name}` is neither input nor parameter"
    )


def test_a_number_that_a_float32_cannot_hold_and_an_unknown_word_are_refused(
    version: Version, ready: Ready
) -> None:
    importer = Importer(ready("supervisor", version))
    importer.start({})
    for key in (3, -1, 2**31 - 1):
        assert_refused(importer, partial(importer.set, {"key": key}), "`key` is", "from 0 to 2")
    huge = 1e39 if version == 2 else math.inf
    assert_refused(importer, lambda: importer.set({"U_dc": huge}), "`U_dc` is")
    assert_refused(importer, lambda: importer.set({"T_creep": 50.001}), "`T_creep`", "from 0 to 50")
    importer.set({"T_creep": 50.0, "key": 2})
    assert importer.get(["T_creep", "key"]) == {"T_creep": 50.0, "key": 2}


@pytest.mark.parametrize("what", ["Get", "Set"])
def test_references_that_make_no_sense_are_refused(
    what: str, version: Version, stepping: Importer
) -> None:
    values = (c_double * 2)()
    name = f"{what}{REAL[version]}"

    def called(kind: str, references: list[int] | None, room: Any, count: int, size: int) -> None:
        given = None if references is None else (c_uint * len(references))(*references)
        stepping.call(kind, given, count, room, *([size] if version == 3 else []))

    assert_refused(stepping, lambda: called(name, [1, 99999], values, 2, 2), "reference 99999")
    assert_refused(stepping, lambda: called(name, [1, 2**32 - 1], values, 2, 2), "4294967295")
    assert_refused(stepping, lambda: called(name, None, values, 1, 1), "null pointer")
    assert_refused(stepping, lambda: called(name, [1], None, 1, 1), "null pointer")
    flag = stepping.variables["is_new.y_em"].valueReference
    assert_refused(
        stepping, lambda: called(name, [flag], values, 1, 1), "`is_new.y_em` is of another type"
    )
    if version == 3:
        assert_refused(
            stepping, lambda: called(name, [1, 2], values, 2, 1), "2 references, 1 values"
        )
        assert_refused(stepping, lambda: called(name, [1], values, 1, 2), "1 references, 2 values")
    called(name, None, None, 0, 0)
