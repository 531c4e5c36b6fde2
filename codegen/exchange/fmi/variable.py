"""FMU variables: the attributes of a variable in the model description, and its storage in C."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

Version = Literal[2, 3]
VERSIONS: tuple[Version, ...] = (2, 3)
"""The supported versions of FMI."""
Causality = Literal["independent", "input", "parameter", "output", "local"]
ROLES: Mapping[str, str] = {"input": "INPUT", "parameter": "PARAMETER"}
"""The C constants for variables that an importer may set; all others are read only."""
FMI_TYPES: Mapping[Version, tuple[str, ...]] = {
    2: ("Real", "Integer", "Boolean"),
    3: (
        *("Float32", "Float64", "Int8", "UInt8", "Int16", "UInt16", "Int32", "UInt32"),
        *("Int64", "UInt64", "Boolean"),
    ),
}
"""Types that the get and set functions of a version access; strings and binaries are not
supported.
"""
FMI3_TYPE_OF: Mapping[str, str] = {
    "double": "Float64",
    "float": "Float32",
    "int32_t": "Int32",
    "int16_t": "Int16",
    "uint8_t": "UInt8",
    "uint16_t": "UInt16",
    "uint32_t": "UInt32",
}
"""The type of FMI 3.0 by C type."""
TYPE_LIMITS: Mapping[str, tuple[str, str]] = {
    "double": ("-DBL_MAX", "DBL_MAX"),
    "float": ("-(double)FLT_MAX", "(double)FLT_MAX"),
    "bool": ("0.0", "1.0"),
    "int32_t": ("-2147483648.0", "2147483647.0"),
    "uint8_t": ("0.0", "255.0"),
    "uint16_t": ("0.0", "65535.0"),
    "uint32_t": ("0.0", "4294967295.0"),
}
"""The smallest and largest value of a settable member by C type, as C expressions."""


@dataclass(frozen=True)
class FmuVariable:
    """A variable of an FMU.

    `kept` is the C type of the member at `place` in the image (an instance with its page), or
    `fault` for a fault bit. `declared` names an enumeration type, or is empty. `range` is the range
    of a parameter in the description; `low` and `high` are the limits of a settable value, as C
    expressions.
    """

    name: str
    type: str
    kept: str
    place: str
    causality: Causality
    variability: str
    start: str = ""
    unit: str = ""
    declared: str = ""
    about: str = ""
    range: tuple[str, str] | None = None
    low: str = "0.0"
    high: str = "0.0"

    @property
    def role(self) -> str:
        """The C constant that tells whether an importer may set it: INPUT, PARAMETER or SHOWN.

        SHOWN, for all other causalities, is read only.
        """
        return ROLES.get(self.causality, "SHOWN")


def fmi_type(version: Version, storage_type: str) -> str:
    """Return the FMI type whose functions access a value of a C type.

    It is Boolean for `bool` and `fault`. Version 2 has Real for `double` and `float`, Integer for
    others; version 3 has the type of FMI3_TYPE_OF (KeyError for another C type).
    """
    if storage_type in ("bool", "fault"):
        return "Boolean"
    if version == 3:
        return FMI3_TYPE_OF[storage_type]
    return "Real" if storage_type in ("double", "float") else "Integer"


def fmi_enumeration_type(version: Version) -> str:
    """Return the FMI type whose functions access an enumeration: Integer (FMI 2) or Int64."""
    return "Integer" if version == 2 else "Int64"
