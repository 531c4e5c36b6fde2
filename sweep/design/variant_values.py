"""Variant values: evaluate settings and assign the values of a variant to targets."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from language.ir.ops import Expr, Ref, Value
from language.lowering.expressions import lower_assigned_value
from language.model.declaration import Formula
from language.model.system import System
from language.numerics.evaluate import evaluate
from sweep.definition.study import Study, SystemVariant, Target, design_group_size
from sweep.design.variant import Variant


@dataclass(frozen=True)
class VariantValues:
    """The values [SI] of one variant by target, and the seed of its noise.

    `refusal` is the reason why the variant cannot be simulated, or empty. `structural_values` are
    the values other than parameters and initial values.
    """

    variant: Variant
    values: Mapping[Target, float]
    seed: int
    refusal: str = ""
    structural_values: tuple[tuple[Target, float], ...] = field(default=())


def variant_values_of(study: Study, variant: Variant) -> VariantValues:
    """Return the values of all targets of a variant, including those that `set` computes.

    A setting is skipped if it reads a name that is neither a variable with a value nor a parameter.
    Targets that the system variant does not have are left out. `refusal` tells of the first value
    that is not finite, out of the range of its parameter, a negative stage of a sensor or offset,
    or a period or step that is not positive.
    """
    kind = study.system_variants[variant.system_variant]
    scenario = kind.scenario_bindings[study.scenarios[variant.scenario]].scenario
    values: dict[Target, float] = {}
    for varied in study.variables:
        if varied.name in variant.values:
            values.update(dict.fromkeys(varied.targets, variant.values[varied.name]))
    for setting in study.settings:
        names = [name for name in setting.formula.reads if name not in variant.values]
        if all(_is_parameter(kind.system, name) for name in names):
            found = _evaluate_setting(setting.formula, variant.values, values, kind.system)
            values.update(dict.fromkeys(setting.targets, found))
    values = {target: value for target, value in values.items() if _has_target(kind.system, target)}
    changed = tuple((t, v) for t, v in values.items() if t.kind not in ("parameter", "initial"))
    each = design_group_size(study.sampling.method, len(study.random_variables))
    seed = variant.seed(scenario.seed, study.replicates, each)
    return VariantValues(variant, values, seed, _find_refusal(kind, values), changed)


def _has_target(system: System, target: Target) -> bool:
    """Return whether a system has a target; system variants may differ in instances and sensors."""
    owner = target.path[0]
    if target.kind in ("input", "sensor"):
        return owner in (system.inputs if target.kind == "input" else system.sensors)
    if owner not in system.instances:
        return False
    automaton = system.instances[owner].automaton
    known = {"parameter": automaton.parameters, "initial": automaton.states}
    return target.kind == "clock" or target.path[1] in known[target.kind]


def _is_parameter(system: System, name: str) -> bool:
    """Return whether a name, with or without an instance, is a parameter of the system."""
    owner, _, short = name.rpartition(".")
    instances = [system.instances.get(owner)] if owner else system.instances.values()
    return any(each and short in each.automaton.parameters for each in instances)


def _evaluate_setting(
    formula: Formula,
    varied: Mapping[str, float],
    target_values: Mapping[Target, float],
    system: System,
) -> float:
    """Return the value [SI] of a formula of variables and parameters."""
    read: dict[str, float] = {}
    operands: dict[str, Expr] = {}
    for name in dict.fromkeys(formula.reads):
        read[name] = (
            varied[name] if name in varied else parameter_value(system, name, target_values)
        )
        operands[name] = Ref(name)
    return float(evaluate(lower_assigned_value(formula.tree, operands, False), read))


def parameter_value(system: System, name: str, target_values: Mapping[Target, float]) -> float:
    """Return the value [SI] of a parameter in a variant.

    It is that of `target_values`, else that of the system; a derived parameter is evaluated from
    the parameters that it reads, and one without a value is 0. A name without an instance means the
    first instance that has the parameter; StopIteration if none has, KeyError for an unknown
    `instance.parameter`.
    """
    owner, _, short = name.rpartition(".")
    if not owner:
        owner = next(o for o, i in system.instances.items() if short in i.automaton.parameters)
    target = Target("parameter", (owner, short))
    if target in target_values:
        return target_values[target]
    automaton = system.instances[owner].automaton
    parameter = automaton.parameters[short]
    if parameter.derived is None:
        return float(parameter.value or 0)
    read: dict[str, float] = {}
    operands: dict[str, Expr] = {}
    for inner in dict.fromkeys(parameter.derived.reads):
        if inner in automaton.enum_literals:
            operands[inner] = Value(automaton.enum_literals[inner])
        else:
            operands[inner] = Ref(inner)
            read[inner] = parameter_value(system, f"{owner}.{inner}", target_values)
    return float(evaluate(lower_assigned_value(parameter.derived.tree, operands, False), read))


def _find_refusal(system_variant: SystemVariant, values: Mapping[Target, float]) -> str:
    """Return the reason why values are invalid; empty if they are valid.

    A value must be finite and a parameter in its range. Values of sensors and clocks must not be
    negative, and periods and steps must be positive; a stage of a sensor that is 0 is absent.
    """
    for target, value in values.items():
        name = ".".join(target.path)
        if not math.isfinite(value):
            return f"`{name}` is {value}"
        if target.kind == "parameter":
            owner, short = target.path
            limits = system_variant.system.instances[owner].automaton.parameters[short].range
            low, high = map(float, limits) if limits else (-math.inf, math.inf)
            if not low <= value <= high:
                return f"`{name}` = {value:.6g} is outside its range [{low:.6g}, {high:.6g}]"
        if target.kind in ("sensor", "clock"):
            if target.path[-1] in ("period", "step") and value <= 0:
                return f"`{name}` = {value:.6g} is not above zero"
            if value < 0:
                return f"`{name}` = {value:.6g} is below zero"
    return ""
