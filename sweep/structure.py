"""Structure: a system and a scenario with values that no batch takes as an array."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable
from decimal import Decimal
from fractions import Fraction
from pathlib import Path

from language.document import Entry, Node, Scalar, Table
from language.experiment import Scenario, System
from language.project import Project
from language.scenario import read_scenario
from language.tree import at, put
from sweep.study import NANOSECONDS, Course, Target

Values = Iterable[tuple[Target, float]]


def structured(system: System, values: Values) -> System:
    """Return a system with other stages of sensors, periods, steps and offsets."""
    sensors, instances = dict(system.sensors), dict(system.instances)
    for target, value in values:
        exact = exact_value(value)
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


def stimulated(course: Course, system: System, values: Values) -> Scenario:
    """Return the scenario with other parts of inputs. Raises SpecError (steps out of order)."""
    given = [(target, value) for target, value in values if target.kind == "input"]
    if not given:
        return course.scenario
    assert course.document is not None
    root = course.document.root
    for target, value in given:
        root = _with_part(root, target, value, system)
    document = dataclasses.replace(course.document, root=root)
    found = read_scenario(document, Project(Path()), system)
    kept = course.scenario
    return dataclasses.replace(
        kept, inputs=found.inputs, horizon=kept.horizon, seed=kept.seed, initial=kept.initial
    )


def _with_part(root: Table, target: Target, value: float, system: System) -> Table:
    name, *part = target.path
    is_time = target.is_input_time
    value = round(value, NANOSECONDS) if is_time else value
    unit = "s" if is_time else str(system.inputs[name].unit.dimension)
    text = f"{decimal(value)} {unit}" if unit != "1" else decimal(value)
    node = at(root, ("inputs", name))
    assert node is not None
    if part and part[0] in ("steps", "table", "times"):
        assert isinstance(node, Table)
        form = "steps" if node.get("steps") is not None else "table"
        table = node.get(form)
        assert isinstance(table, Table)
        changed = _with_point(table, int(part[1]), text, part[0] == "times")
        return put(root, ("inputs", name, form), changed)
    inner = at(root, ("inputs", name, *part))
    assert inner is not None
    return put(root, ("inputs", name, *part), Scalar(text, inner.span))


def _with_point(table: Table, number: int, text: str, is_time: bool) -> Table:
    """Return steps or points of a table in which the n-th has another time or value."""
    made: dict[str, Entry] = {}
    for place, entry in enumerate(table, start=1):
        key, node = entry.key, entry.node
        if place == number:
            key = text if is_time else key
            node = node if is_time else _scalar(node, text)
        made[key] = Entry(key, entry.span, node)
    return Table(made, table.span)


def _scalar(node: Node, text: str) -> Scalar:
    return Scalar(text, node.span)


def decimal(value: float) -> str:
    """Return the shortest decimal of a number, without an exponent: as the language reads it."""
    return format(Decimal(repr(value)), "f")


def exact_value(value: float) -> Fraction:
    """Return the shortest decimal of a number, exactly: 0.001 is 1/1000."""
    return Fraction(decimal(value))
