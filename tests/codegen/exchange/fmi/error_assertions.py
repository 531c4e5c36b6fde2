"""What importers do wrong: how a refusal is checked, and functions of a library by their names."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from typing import Any

import pytest
from fmpy.fmi1 import FMICallException

from tests.codegen.exchange.fmi.importer import Importer

PERIOD = 0.001
REAL = {2: "Real", 3: "Float64"}


def assert_refused(importer: Importer, call: Callable[[], object], *words: str) -> None:
    """Check that a call returns an error, tells why in one message, and leaves time alone."""
    before = len(importer.messages)
    with pytest.raises(FMICallException):
        call()
    (message,) = importer.messages[before:]
    assert all(word in message for word in words), message


def library_function(importer: Importer, name: str) -> Any:
    """Return a function of the library, without what FMPy says of its arguments."""
    return getattr(ctypes.CDLL(importer.slave.dll._name), name)
