"""Case: a point of a study as values for instances, start values, parts of inputs, sensors."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from language.declaration import Formula
from language.evaluate import evaluate
from language.experiment import System
from language.lower import assigned
from language.operation import Expr, Ref, Value
from sweep.point import Point
from sweep.study import Kind, Study, Target, points_each


@dataclass(frozen=True)
class Case:
    """The values [SI] of one variant, by target; `refused` says why it cannot be simulated."""

    point: Point
    values: Mapping[Target, float]
    seed: int
    refused: str = ""
    structure: tuple[tuple[Target, float], ...] = field(default=())


def case_of(study: Study, point: Point) -> Case:
    """Return the values of a variant, with those that follow from what varies."""
    kind = study.kinds[point.kind]
    scenario = kind.courses[study.scenarios[point.scenario]].scenario
    values: dict[Target, float] = {}
    for varied in study.varied:
        if varied.name in point.values:
            values.update(dict.fromkeys(varied.targets, point.values[varied.name]))
    for setting in study.settings:
        names = [name for name in setting.formula.reads if name not in point.values]
        if all(_is_parameter(kind.system, name) for name in names):
            found = _value(setting.formula, point.values, values, kind.system)
            values.update(dict.fromkeys(setting.targets, found))
    values = {target: value for target, value in values.items() if _has(kind.system, target)}
    changed = tuple((t, v) for t, v in values.items() if t.kind not in ("parameter", "initial"))
    each = points_each(study.sampling.method, len(study.drawn))
    seed = point.seed(scenario.seed, study.replicates, each)
    return Case(point, values, seed, _refusal(kind, values), changed)


def _has(system: System, target: Target) -> bool:
    """Tell whether a system has a place: of several variants, one may lack what others have."""
    owner = target.path[0]
    if target.kind in ("input", "sensor"):
        return owner in (system.inputs if target.kind == "input" else system.sensors)
    if owner not in system.instances:
        return False
    automaton = system.instances[owner].automaton
    known = {"parameter": automaton.parameters, "initial": automaton.states}
    return target.kind == "clock" or target.path[1] in known[target.kind]


def _is_parameter(system: System, name: str) -> bool:
    owner, _, short = name.rpartition(".")
    instances = [system.instances.get(owner)] if owner else system.instances.values()
    return any(each and short in each.automaton.parameters for each in instances)


def _value(
    formula: Formula, varied: Mapping[str, float], given: Mapping[Target, float], system: System
) -> float:
    read: dict[str, float] = {}
    known: dict[str, Expr] = {}
    for name in dict.fromkeys(formula.reads):
        read[name] = varied[name] if name in varied else parameter_value(system, name, given)
        known[name] = Ref(name)
    return float(evaluate(assigned(formula.tree, known, False), read))


def parameter_value(system: System, name: str, given: Mapping[Target, float]) -> float:
    """Return the value [SI] of a parameter in a variant; of one name in several the first's."""
    owner, _, short = name.rpartition(".")
    if not owner:
        owner = next(o for o, i in system.instances.items() if short in i.automaton.parameters)
    target = Target("parameter", (owner, short))
    if target in given:
        return given[target]
    automaton = system.instances[owner].automaton
    parameter = automaton.parameters[short]
    if parameter.derived is None:
        return float(parameter.value or 0)
    read: dict[str, float] = {}
    known: dict[str, Expr] = {}
    for inner in dict.fromkeys(parameter.derived.reads):
        if inner in automaton.literals:
            known[inner] = Value(automaton.literals[inner])
        else:
            known[inner] = Ref(inner)
            read[inner] = parameter_value(system, f"{owner}.{inner}", given)
    return float(evaluate(assigned(parameter.derived.tree, known, False), read))


def _refusal(kind: Kind, values: Mapping[Target, float]) -> str:
    """Return why values cannot be used: not finite, outside a declared range, no time."""
    for target, value in values.items():
        name = ".".join(target.path)
        if not math.isfinite(value):
            return f"`{name}` is {value}"
        if target.kind == "parameter":
            owner, short = target.path
            limits = kind.system.instances[owner].automaton.parameters[short].range
            low, high = map(float, limits) if limits else (-math.inf, math.inf)
            if not low <= value <= high:
                return f"`{name}` = {value:.6g} is outside its range [{low:.6g}, {high:.6g}]"
        is_positive = target.kind == "sensor" or target.path[-1] in ("period", "step")
        if target.kind in ("sensor", "clock") and (value < 0 or (is_positive and value == 0)):
            return f"`{name}` = {value:.6g} is not above zero"
    return ""
