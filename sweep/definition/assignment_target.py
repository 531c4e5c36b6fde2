"""Assignment target: find the places of a system and its scenarios to which a study can assign
values."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from dataclasses import dataclass

from language.expressions.units import Unit, parse_unit
from language.model.system import System
from language.text.document import Document, MappingNode, ScalarNode
from language.typecheck.types import TypeName
from sweep.definition.study import Target

TIME = parse_unit("s")
"""The unit of times."""
SENSOR_FIELDS = {
    "noise.sd": "noise", "filter.lag": "lag", "delay": "delay", "quantise": "quantum",
    "sample": "period",
}  # fmt: skip
"""The stages of a sensor by key path of the language, with the field of the model."""
CLOCKS = ("period", "step", "offset")
"""The fields of an instance's clock."""


@dataclass(frozen=True)
class TargetInfo:
    """The targets of a name with unit, type, enumeration values and range [SI].

    `is_width` marks differences and standard deviations, whose unit has no offset.
    """

    targets: tuple[Target, ...]
    unit: Unit
    type: TypeName = "real"
    values: tuple[str, ...] = ()
    low: float | None = None
    high: float | None = None
    is_width: bool = False


def find_targets(system: System, scenarios: list[Document]) -> dict[str, TargetInfo]:
    """Return all targets of a system and of expanded scenarios by name.

    Names: `<instance>.<parameter>` (not derived, no table), `initial.<instance>.<state>` (real),
    `<sensor>.<stage>` for stages that the sensor has, `<instance>.period`, `.step` or `.offset`,
    and `inputs.<name>.<part>` of real inputs; a later scenario replaces parts of the same name. A
    parameter name without an instance refers to all instances that have it, with the unit and range
    of the first. With a single instance, `initial.<state>` needs no instance.
    """
    found: dict[str, TargetInfo] = {}
    for name, place in (*_parameters(system), *_initial_values(system), *_sensors(system)):
        found[name] = place
    for name, place in _clocks(system):
        found[name] = place
    for name, place in list(found.items()):
        kind, path = place.targets[0].kind, place.targets[0].path
        if kind == "parameter":
            short = path[1]
            if short not in found:
                found[short] = place
            elif found[short].targets[0].kind == "parameter" and "." in name:
                targets = dict.fromkeys((*found[short].targets, *place.targets))
                found[short] = dataclasses.replace(found[short], targets=tuple(targets))
    alone = system.sole_instance
    for name, place in list(found.items()):
        if alone and name.startswith(f"initial.{alone}."):
            found[f"initial.{name.rpartition('.')[2]}"] = place
    for document in scenarios:
        found.update(_inputs(system, document))
    return found


def _parameters(system: System) -> Iterator[tuple[str, TargetInfo]]:
    """Yield `<instance>.<parameter>` for parameters that are neither derived nor tables."""
    for owner, instance in system.instances.items():
        for name, parameter in instance.automaton.parameters.items():
            if parameter.derived is None and parameter.table is None:
                target = Target("parameter", (owner, name))
                limits = parameter.range
                low, high = map(float, limits) if limits else (None, None)
                place = TargetInfo(
                    (target,), parameter.unit, parameter.type, parameter.values, low, high
                )
                yield f"{owner}.{name}", place


def _initial_values(system: System) -> Iterator[tuple[str, TargetInfo]]:
    """Yield `initial.<instance>.<state>` for real states."""
    for owner, instance in system.instances.items():
        for name, state in instance.automaton.states.items():
            if state.type == "real":
                yield (
                    f"initial.{owner}.{name}",
                    TargetInfo((Target("initial", (owner, name)),), state.unit),
                )


def _sensors(system: System) -> Iterator[tuple[str, TargetInfo]]:
    """Yield `<sensor>.<stage>` for the stages that a sensor has."""
    for name, sensor in system.sensors.items():
        for path, field in SENSOR_FIELDS.items():
            if getattr(sensor, field):
                is_time = field in ("lag", "delay", "period")
                unit = (
                    TIME if is_time else Unit(str(sensor.dimension), TIME.factor, sensor.dimension)
                )
                target = Target("sensor", (name, field))
                yield f"{name}.{path}", TargetInfo((target,), unit, is_width=True)


def _clocks(system: System) -> Iterator[tuple[str, TargetInfo]]:
    """Yield `<instance>.period` of sampled, `.step` of continuous instances, and `.offset` of
    all.
    """
    for owner, instance in system.instances.items():
        for clock in CLOCKS:
            is_sampled = instance.automaton.is_sampled
            if clock == "offset" or (clock == "period") == is_sampled:
                yield f"{owner}.{clock}", TargetInfo((Target("clock", (owner, clock)),), TIME)


def _inputs(system: System, document: Document) -> Iterator[tuple[str, TargetInfo]]:
    """Yield the parts of the real inputs that a scenario defines, as `inputs.<name>.<part>`."""
    node = document.root.get("inputs")
    for entry in node if isinstance(node, MappingNode) else ():
        thing = system.inputs.get(entry.key)
        if thing is None or thing.type != "real":
            continue
        for part, unit in _parts(entry.node, thing.unit):
            path = (entry.key, *part)
            is_width = part[-1:] == ("amplitude",)
            own = _difference_unit(unit) if is_width else unit
            place = TargetInfo((Target("input", path),), own, is_width=is_width)
            yield "inputs." + ".".join(path), place


def _difference_unit(unit: Unit) -> Unit:
    """Return the unit of differences of quantities in a unit: K for degC."""
    return Unit(str(unit.dimension), unit.factor, unit.dimension) if unit.offset else unit


def _parts(node: object, unit: Unit) -> Iterator[tuple[tuple[str, ...], Unit]]:
    """Yield path and unit of each number in the node of an input.

    The parts are the value itself, `start`, values and times of steps and tables, and the fields of
    `ramp` and `chirp`.
    """
    if isinstance(node, ScalarNode):
        yield (), unit
    if not isinstance(node, MappingNode):
        return
    if node.get("start") is not None:
        yield ("start",), unit
    for form in ("steps", "table"):
        points = node.get(form)
        for number, _ in enumerate(points if isinstance(points, MappingNode) else (), start=1):
            yield (form, str(number)), unit
            yield ("times", str(number)), TIME
    for form, keys in (("ramp", ("from", "to", "value")), ("chirp", ("from", "to", "amplitude"))):
        table = node.get(form)
        for key in keys if isinstance(table, MappingNode) else ():
            yield (form, key), TIME if key in ("from", "to") else unit
