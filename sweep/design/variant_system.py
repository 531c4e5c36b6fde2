"""Variant system: apply the values of a variant that change the structure of system or scenario.

These are values of sensors, clocks and inputs; a batch has no arrays for them.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable
from decimal import Decimal
from fractions import Fraction
from pathlib import Path

from language.loading.scenario_reader import read_scenario
from language.model.system import Scenario, System
from language.overlays.expand_document import Project
from language.text.document import Entry, MappingNode, ScalarNode
from language.text.node_edit import find_node, put_node
from sweep.definition.study import TIME_DECIMALS, ScenarioBinding, Target

TargetValues = Iterable[tuple[Target, float]]


def apply_to_system(system: System, values: TargetValues) -> System:
    """Return the system with changed sensor stages, periods, steps and offsets.

    A value is taken as its shortest decimal, exactly. Targets of other kinds (parameters, initial
    values, inputs) are ignored. Raises KeyError for an unknown sensor or instance.
    """
    sensors, instances = dict(system.sensors), dict(system.instances)
    for target, value in values:
        exact = exact_fraction(value)
        if target.kind == "sensor":
            name, field = target.path
            sensors[name] = dataclasses.replace(sensors[name], **{field: exact})  # type: ignore[arg-type]
        elif target.kind == "clock" and target.path[1] == "offset":
            name = target.path[0]
            instances[name] = dataclasses.replace(instances[name], offset=exact)
        elif target.kind == "clock":
            name, field = target.path
            old = instances[name].automaton
            changed = dataclasses.replace(old, **{field: exact})  # type: ignore[arg-type]
            instances[name] = dataclasses.replace(instances[name], automaton=changed)
    return dataclasses.replace(system, sensors=sensors, instances=instances)


def apply_to_scenario(binding: ScenarioBinding, system: System, values: TargetValues) -> Scenario:
    """Return the scenario with changed parts of inputs; unchanged without targets of inputs.

    Times are rounded to nanoseconds. Horizon, seed and initial values are those of the bound
    scenario, whose `document` must be present. Raises SpecError if the changed inputs are invalid,
    e.g. steps out of order.
    """
    input_values = [(target, value) for target, value in values if target.kind == "input"]
    if not input_values:
        return binding.scenario
    assert binding.document is not None
    root = binding.document.root
    for target, value in input_values:
        root = _with_input_part(root, target, value, system)
    document = dataclasses.replace(binding.document, root=root)
    found = read_scenario(document, Project(Path()), system)
    kept = binding.scenario
    return dataclasses.replace(
        kept, inputs=found.inputs, horizon=kept.horizon, seed=kept.seed, initial=kept.initial
    )


def _with_input_part(
    root: MappingNode, target: Target, value: float, system: System
) -> MappingNode:
    """Return the scenario document with one part of an input set to a value [SI]."""
    name, *part = target.path
    is_time = target.is_input_time
    value = round(value, TIME_DECIMALS) if is_time else value
    unit = "s" if is_time else str(system.inputs[name].unit.dimension)
    text = f"{format_decimal(value)} {unit}" if unit != "1" else format_decimal(value)
    node = find_node(root, ("inputs", name))
    assert node is not None
    if part and part[0] in ("steps", "table", "times"):
        assert isinstance(node, MappingNode)
        form = "steps" if node.get("steps") is not None else "table"
        table = node.get(form)
        assert isinstance(table, MappingNode)
        changed = _with_point(table, int(part[1]), text, part[0] == "times")
        return put_node(root, ("inputs", name, form), changed)
    inner = find_node(root, ("inputs", name, *part))
    assert inner is not None
    return put_node(root, ("inputs", name, *part), ScalarNode(text, inner.span))


def _with_point(table: MappingNode, number: int, text: str, is_time: bool) -> MappingNode:
    """Return a table of steps or points whose n-th entry has another time or another value."""
    made: dict[str, Entry] = {}
    for place, entry in enumerate(table, start=1):
        key, node = entry.key, entry.node
        if place == number:
            key = text if is_time else key
            node = node if is_time else ScalarNode(text, node.span)
        made[key] = Entry(key, entry.span, node)
    return MappingNode(made, table.span)


def format_decimal(value: float) -> str:
    """Return the shortest decimal that reads back as this float, without an exponent."""
    return format(Decimal(repr(value)), "f")


def exact_fraction(value: float) -> Fraction:
    """Return the shortest decimal of a float as a fraction: 0.001 gives 1/1000."""
    return Fraction(format_decimal(value))
