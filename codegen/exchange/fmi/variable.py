"""Variable: one value of an FMU - how the description tells it, where the C keeps it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

Version = Literal[2, 3]
VERSIONS: tuple[Version, ...] = (2, 3)
Causality = Literal["independent", "input", "parameter", "output", "local"]
ROLES: Mapping[str, str] = {"input": "INPUT", "parameter": "PARAMETER"}
"""What may be set; the rest is shown."""
FMI_TYPES: Mapping[Version, tuple[str, ...]] = {
    2: ("Real", "Integer", "Boolean"),
    3: (
        *("Float32", "Float64", "Int8", "UInt8", "Int16", "UInt16", "Int32", "UInt32"),
        *("Int64", "UInt64", "Boolean"),
    ),
}
"""Types that the functions of a version read and write; there are no texts and no bytes."""
FMI3_TYPE_OF: Mapping[str, str] = {
    "double": "Float64",
    "float": "Float32",
    "int32_t": "Int32",
    "int16_t": "Int16",
    "uint8_t": "UInt8",
    "uint16_t": "UInt16",
    "uint32_t": "UInt32",
}
"""Types of FMI 3.0 of what the C keeps."""
TYPE_LIMITS: Mapping[str, tuple[str, str]] = {
    "double": ("-DBL_MAX", "DBL_MAX"),
    "float": ("-(double)FLT_MAX", "(double)FLT_MAX"),
    "bool": ("0.0", "1.0"),
    "int32_t": ("-2147483648.0", "2147483647.0"),
    "uint8_t": ("0.0", "255.0"),
    "uint16_t": ("0.0", "65535.0"),
}
"""What a member that may be set can hold, as C."""


@dataclass(frozen=True)
class FmuVariable:
    """A variable of an FMU.

    `kept` is the C type of the member at `place` of an image (an instance with its page), or
    `fault` for one of its bits; `declared` names an enumeration; `range` is what is told of a
    parameter, `low` and `high` what may be set, as C.
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
        """Return what an importer may do with it, as the C names it."""
        return ROLES.get(self.causality, "SHOWN")


def fmi_type(version: Version, storage_type: str) -> str:
    """Return the type of FMI whose functions read a value of a C type."""
    if storage_type in ("bool", "fault"):
        return "Boolean"
    if version == 3:
        return FMI3_TYPE_OF[storage_type]
    return "Real" if storage_type in ("double", "float") else "Integer"


def fmi_enumeration_type(version: Version) -> str:
    """Return the type of FMI whose functions read an enumeration."""
    return "Integer" if version == 2 else "Int64"
