"""What an importer does wrong is refused with a message, changes nothing, and crashes nothing."""

from __future__ import annotations

import ctypes
import math
from collections.abc import Callable, Iterator
from ctypes import byref, c_bool, c_double, c_size_t, c_uint, c_void_p
from typing import Any

import pytest
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import fmi2CallbackFunctions, fmi2CoSimulation, fmi2ModelExchange

from codegen.fmi.standard import refusals
from codegen.fmi.variable import Version
from tests.fmi.conftest import Ready
from tests.fmi.importer import Importer

PERIOD = 0.001
REAL = {2: "Real", 3: "Float64"}


@pytest.fixture
def importer(version: Version, ready: Ready) -> Iterator[Importer]:
    """An instance of the estimator before initialization mode."""
    made = Importer(ready("estimator", version))
    yield made
    made.close()


@pytest.fixture
def stepping(importer: Importer) -> Importer:
    """The same after initialization mode."""
    importer.start({"y_em": 81.0, "y_w": 10.0}, stop=1.0)
    return importer


def refused(importer: Importer, call: Callable[[], object], *words: str) -> None:
    """Check that a call returns an error, tells why in one message, and leaves time alone."""
    before = len(importer.messages)
    with pytest.raises(FMICallException):
        call()
    (message,) = importer.messages[before:]
    assert all(word in message for word in words), message


def raw(importer: Importer, name: str) -> Any:
    """Return a function of the library, without what FMPy says of its arguments."""
    return getattr(ctypes.CDLL(importer.slave.dll._name), name)


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
    refused(stepping, lambda: stepping.step(0.0, size), *words)
    assert stepping.get(["time", "state.w_em"]) == before
    stepping.step(0.0, PERIOD * (1.0 + 0.5e-9))
    assert stepping.get(["time"]) == {"time": PERIOD}


@pytest.mark.parametrize("point", [PERIOD, -PERIOD, math.nan, math.inf])
def test_a_step_from_another_time_is_refused(point: float, stepping: Importer) -> None:
    refused(stepping, lambda: stepping.step(point, PERIOD), "the instance is at 0 s")


def test_sums_of_steps_may_drift_far_from_the_start(importer: Importer) -> None:
    start = 123456.7
    importer.start({}, start=start)
    point = start
    for _ in range(200):
        importer.step(point, (point + PERIOD) - point)
        point += PERIOD
    assert importer.get(["time"])["time"] == pytest.approx(start + 0.2, abs=1e-9)


def test_calls_in_a_wrong_phase_are_refused(importer: Importer) -> None:
    refused(importer, lambda: importer.step(0.0, PERIOD), "DoStep", "has not been entered")
    refused(importer, lambda: importer.get(["T_hs"]), "`T_hs` has no value before")
    refused(importer, importer.slave.exitInitializationMode, "has not been entered")
    refused(importer, importer.slave.terminate, "has not been entered")
    importer.enter()
    refused(importer, lambda: importer.step(0.0, PERIOD), "has not been left")
    refused(importer, importer.enter, "has not been left")
    importer.slave.exitInitializationMode()
    refused(importer, importer.slave.exitInitializationMode, "initialization is over")
    importer.slave.terminate()
    refused(importer, lambda: importer.step(0.0, PERIOD), "was terminated")
    refused(importer, lambda: importer.set({"y_em": 1.0}), "was terminated")
    refused(importer, importer.slave.terminate, "was terminated")
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
    refused(importer, lambda: importer.enter(*span), "it starts at")


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_a_number_that_is_not_finite_is_refused_by_name(value: float, stepping: Importer) -> None:
    refused(stepping, lambda: stepping.set({"y_em": value}), "`y_em` is ", "it may be from")
    assert stepping.get(["y_em"]) == {"y_em": 81.0}


def test_a_parameter_outside_of_its_range_is_refused(stepping: Importer) -> None:
    refused(stepping, lambda: stepping.set({"J_em": 0.3}), "`J_em` is 0.29", "to 0.2")


def test_a_refused_call_sets_nothing(stepping: Importer) -> None:
    refused(stepping, lambda: stepping.set({"y_w": 11.0, "T_em": math.nan}), "`T_em`")
    assert stepping.get(["y_w", "T_em"]) == {"y_w": 10.0, "T_em": 0.0}


@pytest.mark.parametrize("name", ["time", "T_hs", "state.w_em"])
def test_what_is_shown_is_not_set(name: str, stepping: Importer) -> None:
    refused(stepping, lambda: stepping.set({name: 1.0}), f"`{name}` is neither input nor parameter")


def test_a_number_that_a_float32_cannot_hold_and_an_unknown_word_are_refused(
    version: Version, ready: Ready
) -> None:
    importer = Importer(ready("supervisor", version))
    importer.start({})
    for key in (3, -1, 2**31 - 1):
        refused(importer, lambda key=key: importer.set({"key": key}), "`key` is", "from 0 to 2")  # type: ignore[misc]
    huge = 1e39 if version == 2 else math.inf
    refused(importer, lambda: importer.set({"U_dc": huge}), "`U_dc` is")
    refused(importer, lambda: importer.set({"T_creep": 50.001}), "`T_creep`", "from 0 to 50")
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

    refused(stepping, lambda: called(name, [1, 99999], values, 2, 2), "reference 99999")
    refused(stepping, lambda: called(name, [1, 2**32 - 1], values, 2, 2), "4294967295")
    refused(stepping, lambda: called(name, None, values, 1, 1), "null pointer")
    refused(stepping, lambda: called(name, [1], None, 1, 1), "null pointer")
    flag = stepping.variables["is_new.y_em"].valueReference
    refused(
        stepping, lambda: called(name, [flag], values, 1, 1), "`is_new.y_em` is of another type"
    )
    if version == 3:
        refused(stepping, lambda: called(name, [1, 2], values, 2, 1), "2 references, 1 values")
        refused(stepping, lambda: called(name, [1], values, 1, 2), "1 references, 2 values")
    called(name, None, None, 0, 0)


def test_states_of_others_are_refused(version: Version, ready: Ready, stepping: Importer) -> None:
    other = Importer(ready("contactor", version))
    refused(stepping, lambda: stepping.restore(other.saved()), "another FMU")
    refused(stepping, lambda: stepping.restore(c_void_p()), "there is no state")
    refused(stepping, lambda: stepping.serialised(c_void_p()), "there is no state")
    data = stepping.serialised(stepping.saved())
    for wrong in (
        data[:-1],
        data + b"\0",
        b"",
        other.serialised(other.saved()),
        b"x" + data[1:],
        data[:200] + bytes([data[200] ^ 1]) + data[201:],
    ):
        refused(stepping, lambda wrong=wrong: stepping.deserialised(wrong), "bytes")  # type: ignore[misc]
    name = "GetFMUstate" if version == 2 else "GetFMUState"
    refused(stepping, lambda: stepping.call(name, None), "no place")
    refused(stepping, lambda: stepping.call(name.replace("Get", "Free"), None), "no place")
    state = stepping.saved()
    stepping.call(name.replace("Get", "Free"), byref(state))
    assert state.value is None
    stepping.call(name.replace("Get", "Free"), byref(state))


def test_a_state_is_saved_again_in_its_place(version: Version, stepping: Importer) -> None:
    state = stepping.saved()
    place = state.value
    stepping.step(0.0, PERIOD)
    stepping.call("GetFMUstate" if version == 2 else "GetFMUState", byref(state))
    assert state.value == place
    stepping.slave.reset()
    stepping.restore(state)
    assert stepping.get(["time"]) == {"time": PERIOD}


def test_every_function_that_is_not_supported_returns_an_error_and_tells_why(
    version: Version, stepping: Importer
) -> None:
    listed = list(refusals(version))
    assert len(listed) == {2: 19, 3: 36}[version]
    for refusal in listed:
        function = raw(stepping, refusal.name)
        before = len(stepping.messages)
        arguments = [c_double(0.0) if "64 " in p and "*" not in p and "[" not in p else c_void_p()
                     for p in refusal.parameters[1:]]  # fmt: skip
        assert function(c_void_p(stepping.slave.component), *arguments) == 3, refusal.name
        (message,) = stepping.messages[before:]
        assert message == f"{refusal.name} is refused: {refusal.why}"
        assert function(c_void_p(), *arguments) == 3, refusal.name


def test_without_an_instance_every_call_is_an_error(version: Version, stepping: Importer) -> None:
    prefix = f"fmi{version}"
    state = "FMUstate" if version == 2 else "FMUState"
    names = [*("ExitInitializationMode", "Terminate", "Reset"), f"Get{REAL[version]}",
             f"Set{REAL[version]}", f"Get{state}", f"Set{state}", f"Free{state}"]  # fmt: skip
    for name in names:
        nothing = [c_void_p() for _ in range(6)]
        assert raw(stepping, prefix + name)(*nothing) == 3, name
    raw(stepping, f"{prefix}FreeInstance")(c_void_p())


def test_an_instance_is_not_made_of_nothing(version: Version, importer: Importer) -> None:
    token = importer.fmu.description.guid.encode()

    def made(name: bytes | None, given: bytes | None, kind: int = fmi2CoSimulation) -> Any:
        if version == 2:
            callbacks = byref(importer.callbacks)
            return importer.slave.fmi2Instantiate(name, kind, given, None, callbacks, 0, 0)
        heard = importer.slave.logMessage
        none = importer.slave.intermediateUpdate
        new = importer.slave.fmi3InstantiateCoSimulation
        events = c_bool(kind != fmi2CoSimulation)
        return new(
            name, given, None, c_bool(), c_bool(), events, c_bool(), None, 0, None, heard, none
        )

    for name, given, word in (
        (None, token, "no name"),
        (b"", token, "no name"),
        (b"x", None, "the token is that of another FMU"),
        (b"x", b"{0}", "the token is that of another FMU"),
    ):
        assert made(name, given) is None
        assert word in importer.messages.pop()
    assert made(b"x", token, fmi2ModelExchange) is None
    assert "there is no " in importer.messages.pop()
    if version == 2:
        assert importer.slave.fmi2Instantiate(b"x", 1, token, None, None, 0, 0) is None
        silent = fmi2CallbackFunctions()
        wrong = importer.slave.fmi2Instantiate(b"x", 1, b"{0}", None, byref(silent), 0, 0)
        assert wrong is None
    assert importer.messages == []


def test_nothing_is_returned_where_there_is_no_place(version: Version, stepping: Importer) -> None:
    if version == 2:
        refused(stepping, lambda: stepping.call("GetRealStatus", 2, None), "last successful time")
        value = c_double()
        stepping.call("GetRealStatus", 2, byref(value))
        assert value.value == 0.0
        refused(stepping, lambda: stepping.call("GetBooleanStatus", 0, None), "terminated")
    else:
        step = (0.0, PERIOD, c_bool(True), None, None, None, None)
        refused(stepping, lambda: stepping.call("DoStep", *step), "null pointer")
    state = stepping.saved()
    name = "SerializedFMUstateSize" if version == 2 else "SerializedFMUStateSize"
    refused(stepping, lambda: stepping.call(name, state, None), "no place")


def test_a_fault_is_told_once_and_the_step_goes_on(version: Version, stepping: Importer) -> None:
    stepping.set({"T_em": 1000.0})
    stepping.step(0.0, PERIOD)
    stepping.step(PERIOD, PERIOD)
    assert stepping.messages == ["fault `range_T_em` is set at 0.001 s"]
    assert stepping.get(["fault.range_T_em", "fault.range_T_br", "faults"]) == {
        "fault.range_T_em": True,
        "fault.range_T_br": False,
        "faults": 1 << 4,
    }


def test_messages_of_a_category_are_switched_off_and_on(
    version: Version, stepping: Importer
) -> None:
    def switched(is_on: bool, *names: bytes | None) -> None:
        listed = (ctypes.c_char_p * len(names))(*names)
        stepping.call("SetDebugLogging", is_on, c_size_t(len(names)), listed)

    switched(False, b"logStatusError")
    with pytest.raises(FMICallException):
        stepping.step(0.0, 0.5 * PERIOD)
    stepping.set({"T_em": 1000.0})
    stepping.step(0.0, PERIOD)
    assert stepping.messages.pop() == "fault `range_T_em` is set at 0.001 s"
    switched(False)
    stepping.set({"T_em": 0.0, "T_br": -1.0})
    stepping.step(PERIOD, PERIOD)
    assert stepping.messages == []
    switched(True)
    refused(stepping, lambda: switched(True, b"logAll"), "categories are")
    refused(stepping, lambda: switched(True, None), "categories are")
    refused(stepping, lambda: stepping.call("SetDebugLogging", True, 1, None), "null pointer")
