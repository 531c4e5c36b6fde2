"""Values: a parameter with another value, as variants, calibrations and effects give it."""

from __future__ import annotations

from language.document import Entry, Node, Scalar, Table
from language.points import with_points
from language.problem import Problems


def with_given(parameter: Table, value: Node, problems: Problems) -> Table:
    """Return a parameter with another value, or with values at points of its table."""
    if isinstance(value, Scalar) and "table" in parameter.entries:
        label = "this parameter is a table: its values are `{points: {...}}`"
        problems.error("form", value.span, label)
        return parameter
    if isinstance(value, Scalar):
        return with_value(parameter, value)
    if isinstance(value, Table):
        return with_points(parameter, value, problems)
    problems.error(
        "form", value.span, "a value is a number with a unit, a word, or `{points: ...}`"
    )
    return parameter


def with_value(parameter: Table, value: Scalar) -> Table:
    """Return a parameter with another value; a bare real is in the unit of the old one."""
    entries = dict(parameter.entries)
    old, kind = parameter.get("value"), parameter.get("type")
    is_real = not isinstance(kind, Scalar) or kind.text == "real"
    if is_real and "unit" not in entries and isinstance(old, Scalar):
        _, _, unit = old.text.strip().partition(" ")
        span = entries["value"].span
        entries["unit"] = Entry("unit", span, Scalar(unit or "1", old.span))
    key = entries["value"].span if "value" in entries else parameter.span
    entries["value"] = Entry("value", key, value)
    return Table(entries, parameter.span)
