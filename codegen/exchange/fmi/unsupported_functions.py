"""Unsupported functions: the functions of the headers that an FMU exports but does not support."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from importlib import resources

from codegen.exchange.fmi.variable import FMI_TYPES, Version

COMMENT = re.compile(r"/\*.*?\*/", re.DOTALL)
"""A comment in C."""
FUNCTION = re.compile(r"typedef\s+fmi\dStatus\s+(fmi\d\w+?)TYPE\s*\((.*?)\);", re.DOTALL)
"""The type definition of a function that returns a status: name and parameters."""
IMPLEMENTED: Mapping[Version, str] = {
    2: "SetDebugLogging SetupExperiment EnterInitializationMode ExitInitializationMode Terminate "
    "Reset GetFMUstate SetFMUstate FreeFMUstate SerializedFMUstateSize SerializeFMUstate "
    "DeSerializeFMUstate DoStep GetRealStatus GetBooleanStatus",
    3: "SetDebugLogging EnterInitializationMode ExitInitializationMode Terminate Reset "
    "GetFMUState SetFMUState FreeFMUState SerializedFMUStateSize SerializeFMUState "
    "DeserializeFMUState DoStep",
}
"""Functions that return a status and have their own template."""
UNSUPPORTED_REASONS: tuple[tuple[str, str], ...] = (
    ("String$", "no variable is a text"),
    ("Binary", "no variable is binary"),
    ("Clock|Interval|Shift", "there are no clocks"),
    ("Dependenc", "dependencies are not told"),
    ("InputDerivatives|OutputDerivatives|Directional|Adjoint", "derivatives are not told or taken"),
    ("Configuration", "there are no structural parameters"),
    ("ModelPartition", "there is no scheduled execution"),
    ("Status$|CancelStep", "a step is done when DoStep returns"),
    ("StepMode|EvaluateDiscrete|UpdateDiscrete", "there is no event mode"),
    ("", "this is co-simulation, not model exchange"),
)
"""Reasons why a function is rejected: the first pattern that is found in its name applies."""


@dataclass(frozen=True)
class UnsupportedFunction:
    """A function that is exported because FMI requires it, and returns an error on each call."""

    name: str
    parameters: tuple[str, ...]
    why: str

    @property
    def arguments(self) -> tuple[str, ...]:
        """The names of the parameters, without types, stars and brackets."""
        return tuple(parameter.split()[-1].strip("*[]") for parameter in self.parameters)


def unsupported_functions(version: Version) -> Iterator[UnsupportedFunction]:
    """Yield the functions of a version that an FMU exports but does not support, in header order.

    These are the functions of `fmi<version>FunctionTypes.h` that return a status and are neither in
    IMPLEMENTED nor a get or set function of FMI_TYPES. The reason is that of the first pattern of
    UNSUPPORTED_REASONS in the name.
    """
    file = resources.files("codegen.exchange.fmi").joinpath(
        "headers", f"fmi{version}FunctionTypes.h"
    )
    implemented = {f"fmi{version}{name}" for name in IMPLEMENTED[version].split()}
    implemented |= {
        f"fmi{version}{what}{kind}" for kind in FMI_TYPES[version] for what in ("Get", "Set")
    }
    for name, parameters in FUNCTION.findall(COMMENT.sub("", file.read_text("ascii"))):
        if name not in implemented:
            parameter_texts = tuple(_format_parameter(text) for text in parameters.split(","))
            why = next(why for pattern, why in UNSUPPORTED_REASONS if re.search(pattern, name))
            yield UnsupportedFunction(name, parameter_texts, why)


def _format_parameter(parameter: str) -> str:
    """Return a parameter on one line, with the star of a pointer beside its name."""
    return " ".join(parameter.split()).replace("* ", " *")
