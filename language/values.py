"""Values: a parameter with another value, as variants, calibrations and effects give it."""

from __future__ import annotations

from language.document import Entry, MappingNode, ScalarNode, YamlNode
from language.points import override_points
from language.problem import Problems


def override_parameter(parameter: MappingNode, value: YamlNode, problems: Problems) -> MappingNode:
    """Return a parameter with another value, or with values at points of its table."""
    if isinstance(value, ScalarNode) and "table" in parameter.entries:
        label = "this parameter is a table: its values are `{points: {...}}`"
        problems.error("form", value.span, label)
        return parameter
    if isinstance(value, ScalarNode):
        return set_parameter_value(parameter, value)
    if isinstance(value, MappingNode):
        return override_points(parameter, value, problems)
    problems.error(
        "form", value.span, "a value is a number with a unit, a word, or `{points: ...}`"
    )
    return parameter


def set_parameter_value(parameter: MappingNode, value: ScalarNode) -> MappingNode:
    """Return a parameter with another value; a bare real is in the unit of the old one."""
    entries = dict(parameter.entries)
    old, kind = parameter.get("value"), parameter.get("type")
    is_real = not isinstance(kind, ScalarNode) or kind.text == "real"
    if is_real and "unit" not in entries and isinstance(old, ScalarNode):
        _, _, unit = old.text.strip().partition(" ")
        span = entries["value"].span
        entries["unit"] = Entry("unit", span, ScalarNode(unit or "1", old.span))
    key = entries["value"].span if "value" in entries else parameter.span
    entries["value"] = Entry("value", key, value)
    return MappingNode(entries, parameter.span)
