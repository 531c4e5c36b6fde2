"""States, instances and functions that an importer has no right to; messages, and their ways."""

from __future__ import annotations

import ctypes
from ctypes import byref, c_bool, c_double, c_size_t, c_void_p
from typing import Any

import pytest
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import fmi2CallbackFunctions, fmi2CoSimulation, fmi2ModelExchange

from codegen.exchange.fmi.unsupported_functions import unsupported_functions
from codegen.exchange.fmi.variable import Version
from tests.codegen.exchange.fmi.conftest import Ready
from tests.codegen.exchange.fmi.error_assertions import (
    PERIOD,
    REAL,
    assert_refused,
    library_function,
)
from tests.codegen.exchange.fmi.importer import Importer


def test_states_of_others_are_refused(version: Version, ready: Ready, stepping: Importer) -> None:
    other = Importer(ready("contactor", version))
    assert_refused(stepping, lambda: stepping.restore(other.save_state()), "another FMU")
    assert_refused(stepping, lambda: stepping.restore(c_void_p()), "there is no state")
    assert_refused(stepping, lambda: stepping.serialise_state(c_void_p()), "there is no state")
    data = stepping.serialise_state(stepping.save_state())
    for wrong in (
        data[:-1],
        data + b"\0",
        b"",
        other.serialise_state(other.save_state()),
        b"x" + data[1:],
        data[:200] + bytes([data[200] ^ 1]) + data[201:],
    ):
        assert_refused(stepping, lambda wrong=wrong: stepping.deserialise_state(wrong), "bytes")  # type: ignore[misc]
    name = "GetFMUstate" if version == 2 else "GetFMUState"
    assert_refused(stepping, lambda: stepping.call(name, None), "no place")
    assert_refused(stepping, lambda: stepping.call(name.replace("Get", "Free"), None), "no place")
    state = stepping.save_state()
    stepping.call(name.replace("Get", "Free"), byref(state))
    assert state.value is None
    stepping.call(name.replace("Get", "Free"), byref(state))


def test_a_state_is_saved_again_in_its_place(version: Version, stepping: Importer) -> None:
    state = stepping.save_state()
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
    listed = list(unsupported_functions(version))
    assert len(listed) == {2: 19, 3: 36}[version]
    for refusal in listed:
        function = library_function(stepping, refusal.name)
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
        assert library_function(stepping, prefix + name)(*nothing) == 3, name
    library_function(stepping, f"{prefix}FreeInstance")(c_void_p())


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
        assert_refused(
            stepping, lambda: stepping.call("GetRealStatus", 2, None), "last successful time"
        )
        value = c_double()
        stepping.call("GetRealStatus", 2, byref(value))
        assert value.value == 0.0
        assert_refused(stepping, lambda: stepping.call("GetBooleanStatus", 0, None), "terminated")
    else:
        step = (0.0, PERIOD, c_bool(True), None, None, None, None)
        assert_refused(stepping, lambda: stepping.call("DoStep", *step), "null pointer")
    state = stepping.save_state()
    name = "SerializedFMUstateSize" if version == 2 else "SerializedFMUStateSize"
    assert_refused(stepping, lambda: stepping.call(name, state, None), "no place")


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
    assert_refused(stepping, lambda: switched(True, b"logAll"), "categories are")
    assert_refused(stepping, lambda: switched(True, None), "categories are")
    assert_refused(
        stepping, lambda: stepping.call("SetDebugLogging", True, 1, None), "null pointer"
    )
