"""Values: a parameter with another value, as variants, calibrations and effects give it."""

from __future__ import annotations

from language.document import Entry, Scalar, Table


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
