"""Documents: load specs by name or path, apply calibrations and parse parameter values."""

from __future__ import annotations

import math
import reprlib
from collections.abc import Mapping
from decimal import Decimal
from numbers import Integral, Real

from language.ir.number_type import NUMBER_TYPES, NumberType
from language.loading.load import command_line_value
from language.overlays.expand_document import Project, add_calibrations, read_document
from language.overlays.literal_format import format_decimal
from language.text.arguments import PathTexts, optional, to_choice, to_mapping, to_texts
from language.text.document import Document, ScalarNode

Values = Mapping[str, str | float]
"""Parameter values by `parameter` or `instance.parameter`: texts with units, or numbers.

A number is in the unit in which the spec declares the parameter, as with `--set`.
"""


def load_calibrated_document(reference: str, project: Project, calibrations: PathTexts) -> Document:
    """Return the document of a spec with calibrations, by name or path, added after its own.

    Later calibrations override earlier ones when the document is expanded; they are not read here.
    Raises SpecError if the spec cannot be found or read, and TypeError for `calibrations` that are
    no names.
    """
    names = to_texts(calibrations, "calibrations")
    document = read_document(project.path_of(reference))
    return add_calibrations(document, names, "--calibration")


def parse_values(values: Values | None) -> dict[str, ScalarNode]:
    """Return parameter values as scalar nodes by name; empty for None.

    The literals are checked by the reader of the spec only, which places their problems at `--set`.
    Raises as `literals_of`.
    """
    return {name: command_line_value(text, name=name) for name, text in literals_of(values).items()}


def literals_of(values: Values | None) -> dict[str, str]:
    """Return parameter values as literals of the language by name; empty for None.

    Raises TypeError for anything but a mapping of names to texts and numbers, and ValueError for a
    number that is not finite.
    """
    given = optional(to_mapping, values, "values") or {}
    return {name: _literal_of(value, name) for name, value in given.items()}


def number_type_of(numbers: NumberType | None) -> NumberType | None:
    """Return a number type; None for None. Raises ValueError, which names the types."""
    return None if numbers is None else to_choice(numbers, NUMBER_TYPES, "numbers")


def _literal_of(value: object, name: str) -> str:
    """Return the value of a parameter as a literal; a number has no unit."""
    if isinstance(value, str):
        return value
    if isinstance(value, bool) or not isinstance(value, Real):
        raise TypeError(
            f"the value of `{name}` is a text such as `3 kW`, or a number in the declared unit, "
            f"not {reprlib.repr(value)}"
        )
    if isinstance(value, Integral):
        return format_decimal(Decimal(int(value)))
    number = float(value)
    if not math.isfinite(number):
        raise ValueError(f"the value of `{name}` is a finite number, not {number}")
    return format_decimal(Decimal(repr(number)))
