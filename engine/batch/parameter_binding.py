"""Parameter binding: makes swept parameters tunable, so that variants share their Programs.

A swept parameter becomes tunable in the Programs of the batch, and a swept initial value becomes a
tunable parameter of its own. Variants then differ in calibration only. Numbers that are solved at
check time (gains, matrix exponentials) and waits cannot follow a tunable parameter. Parameters that
they depend on are set before lowering, and the Programs are built once for each value.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from engine.batch.batch import Batch
from engine.simulation.instance_programs import programs_of
from engine.simulation.stimuli import resolve_recording
from language.expressions.syntax_tree import Name
from language.ir.printer import digest
from language.ir.program import Program
from language.model.automaton import Automaton
from language.model.declaration import Formula, Parameter
from language.model.system import Scenario, System
from language.text.diagnostic import SpecError

Bounds = tuple[float, float]
"""Least and largest value of a parameter."""
INITIAL_PARAMETER = "start_of_{}"
"""Name of the parameter that stands for a swept initial value."""


@dataclass(frozen=True)
class ParameterBinding:
    """Binding of the swept names of a batch to tunable parameters of `system` and `scenario`.

    `tunables` gives the instance and tunable parameter of a swept name. `rebuild_reasons` says why
    other names need Programs for each value. `programs` are the Programs of `system`. If nothing is
    rebuilt, `bounds` are the values [SI] between which the Programs are equal except for
    calibration.
    """

    system: System
    scenario: Scenario
    programs: Mapping[str, Program]
    tunables: Mapping[str, tuple[str, str]]
    rebuild_reasons: Mapping[str, str]
    bounds: Mapping[str, Bounds] = field(default_factory=dict)


@dataclass(frozen=True)
class ProgramGroup:
    """Variants (indices in the batch) that share their Programs."""

    variants: NDArray[np.int64]
    binding: ParameterBinding


def bind_parameters(batch: Batch) -> ParameterBinding:
    """Return the binding of the swept names of a batch.

    All names are tunable if the Programs at both ends of the bounds differ only in tunable and
    derived values. The bounds are the declared ranges, where they contain all values, else the
    least and largest value; if declared ranges fail, the latter are tried. Otherwise each parameter
    is decided on its own, initial values are tunable, and `bounds` are empty. Raises ValueError as
    `require_known_names`, and SpecError for a value that the checks refuse.
    """
    require_known_names(batch)
    scenario = _without_initial(resolve_recording(batch.scenario), batch)
    seen_bounds = value_bounds(batch)
    for ends in (
        (declared, seen_bounds)
        if (declared := _declared_bounds(batch, seen_bounds)) != seen_bounds
        else (seen_bounds,)
    ):
        shared_binding = _bind_all_tunable(batch, scenario, ends)
        if shared_binding:
            return shared_binding
    arrays = {**batch.parameters, **batch.initial}
    rebuild_reasons: dict[str, str] = {}
    system, tunables = batch.system, {}
    for name in dict.fromkeys([*batch.parameters, *batch.initial]):
        reason = None if name in batch.initial else _rebuild_reason(batch, scenario, name)
        if reason:
            rebuild_reasons[name] = reason
        else:
            tunables[name] = _tunable_of(name, batch)
            system = _with_tunable(system, name, batch, float(arrays[name][0]))
    return ParameterBinding(
        system, scenario, programs_of(system, scenario), tunables, rebuild_reasons
    )


def value_bounds(batch: Batch) -> dict[str, Bounds]:
    """Return the least and largest value [SI] of each swept parameter, without initial values."""
    return {name: (float(min(v)), float(max(v))) for name, v in batch.parameters.items()}


def _declared_bounds(batch: Batch, seen_bounds: Mapping[str, Bounds]) -> dict[str, Bounds]:
    """Return the declared ranges of parameters that contain all their values.

    Other parameters have the bounds of their values.
    """
    bounds = {}
    for name, (low, high) in seen_bounds.items():
        owner, _, short = name.partition(".")
        declared = batch.system.instances[owner].automaton.parameters[short].range
        first, last = map(float, declared) if declared else (low, high)
        bounds[name] = (first, last) if first <= low and high <= last else (low, high)
    return bounds


def _bind_all_tunable(
    batch: Batch, scenario: Scenario, bounds: Mapping[str, Bounds]
) -> ParameterBinding | None:
    """Return a binding with all names tunable.

    The result is None if the Programs at both bounds differ in more than values, a check refuses
    them, or a parameter is not a real number in the Program.
    """
    names = list(dict.fromkeys([*batch.parameters, *batch.initial]))
    systems, program_sets = [], []
    try:
        for end in range(2):
            system = batch.system
            for name in names:
                value = bounds[name][end] if name in bounds else 0.0
                system = _with_tunable(system, name, batch, value)
            systems.append(system)
            program_sets.append(programs_of(system, scenario))
    except SpecError:
        return None
    if any(_is_not_real(program_sets[0], name) for name in names):
        return None
    low, high = ({n: digest(_without_values(p)) for n, p in part.items()} for part in program_sets)
    tunables = {name: _tunable_of(name, batch) for name in names}
    return (
        ParameterBinding(systems[0], scenario, program_sets[0], tunables, {}, bounds)
        if low == high
        else None
    )


def group_variants(batch: Batch) -> list[ProgramGroup]:
    """Return the variants grouped by the values of the parameters that need a rebuild.

    The groups are sorted by these values, in the order of `rebuild_reasons`; the variants of a
    group are in the order of the batch. Without such parameters all variants are one group. Errors
    are those of `bind_parameters`.
    """
    binding = bind_parameters(batch)
    if not binding.rebuild_reasons:
        return [ProgramGroup(np.arange(batch.count), binding)]
    names = list(binding.rebuild_reasons)
    table = np.stack([batch.parameters[name] for name in names], axis=1)
    rows, row_of_variant = np.unique(table, axis=0, return_inverse=True)
    result = []
    for number, row in enumerate(rows):
        system = binding.system
        for name, value in zip(names, row.tolist(), strict=True):
            system = _with_parameter_value(system, name, value)
        programs = programs_of(system, binding.scenario)
        group_binding = dataclasses.replace(binding, system=system, programs=programs)
        result.append(
            ProgramGroup(np.flatnonzero(row_of_variant.reshape(-1) == number), group_binding)
        )
    return result


def require_known_names(batch: Batch) -> None:
    """Raise ValueError for names or arrays of a batch that do not fit its system.

    These are unknown parameters, states, inputs and signals, parameters that are tables, arrays
    without `count` finite values, `variant_inputs` of another number than 0 or `count`, and input
    tables that do not start at 0 s or lack a value for each start.
    """
    for name in batch.parameters:
        owner, _, short = name.partition(".")
        instance = batch.system.instances.get(owner)
        if instance is None or short not in instance.automaton.parameters:
            raise ValueError(f"`{name}` is no parameter of {batch.system.name}")
        if instance.automaton.parameters[short].table is not None:
            raise ValueError(f"`{name}` is a table: a batch varies numbers")
    for name in batch.initial:
        owner, _, short = name.partition(".")
        instance = batch.system.instances.get(owner)
        if instance is None or short not in instance.automaton.states:
            raise ValueError(f"`{name}` is no state of {batch.system.name}")
    arrays = {**batch.parameters, **batch.initial}
    arrays |= {name: table.values for name, table in batch.inputs.items()}
    for name, values in arrays.items():
        if len(values) != batch.count or not np.all(np.isfinite(values)):
            raise ValueError(f"`{name}` needs {batch.count} finite values")
    if len(batch.variant_inputs) not in (0, batch.count):
        raise ValueError(
            f"{len(batch.variant_inputs)} courses are not those of {batch.count} variants"
        )
    for name, table in batch.inputs.items():
        if name not in batch.system.inputs:
            raise ValueError(f"`{name}` is no input of {batch.system.name}")
        if (
            not table.starts
            or table.starts[0] != 0
            or table.values.shape[1:] != (len(table.starts),)
        ):
            raise ValueError(f"`{name}` needs a value for each start, the first at 0 s")
    known = (*batch.system.signals, *batch.system.inputs)
    for name in (*batch.outputs, *(measure.signal for measure in batch.statistics)):
        if name not in known:
            raise ValueError(f"`{name}` is no signal of {batch.system.name}")


def _without_initial(scenario: Scenario, batch: Batch) -> Scenario:
    """Return the scenario without the swept initial values.

    It records the outputs and the signals of statistics of the batch; if there are none, its own
    first signal.
    """
    initial = {name: value for name, value in scenario.initial.items() if name not in batch.initial}
    signals = tuple(dict.fromkeys([*batch.outputs, *(m.signal for m in batch.statistics)]))
    return dataclasses.replace(scenario, initial=initial, signals=signals or scenario.signals[:1])


def _tunable_of(name: str, batch: Batch) -> tuple[str, str]:
    """Return the instance and tunable parameter that stand for a swept name."""
    owner, _, short = name.partition(".")
    return owner, INITIAL_PARAMETER.format(short) if name in batch.initial else short


def _with_tunable(system: System, name: str, batch: Batch, first: float) -> System:
    """Return the system with a swept name tunable; a parameter gets the value `first`.

    An initial value becomes the new tunable parameter `start_of_<state>`.
    """
    owner, _, short = name.partition(".")
    automaton = system.instances[owner].automaton
    parameters, states = dict(automaton.parameters), dict(automaton.states)
    if name not in batch.initial:
        return _with_tunable_parameter(_with_parameter_value(system, name, first), owner, short)
    state, fresh = states[short], INITIAL_PARAMETER.format(short)
    key, span = f"parameters.{fresh}", state.span
    parameters[fresh] = Parameter(fresh, "tunable", state.unit, Fraction(0), None, None, key, span)
    formula = Formula(Name(fresh, span), state.initial.key)
    states[short] = dataclasses.replace(state, initial=formula)
    changed = dataclasses.replace(automaton, parameters=parameters, states=states)
    return _with_automaton(system, owner, changed)


def _with_parameter_value(system: System, name: str, value: float) -> System:
    """Return the system with a parameter of an instance, and of its model, set to a value [SI].

    A derived parameter becomes fixed.
    """
    owner, _, short = name.partition(".")
    # The shortest decimal is exact, so that a wait of 2 ms has two ticks of 1 ms.
    exact = Fraction(repr(float(value)))

    def with_value(automaton: Automaton) -> Automaton:
        old = automaton.parameters.get(short)
        if old is None:
            return automaton
        kind = "fixed" if old.kind == "derived" else old.kind
        new = dataclasses.replace(old, value=exact, derived=None, kind=kind)
        model = automaton.model and with_value(automaton.model)
        parameters = {**automaton.parameters, short: new}
        return dataclasses.replace(automaton, parameters=parameters, model=model)

    return _with_automaton(system, owner, with_value(system.instances[owner].automaton))


def _with_automaton(system: System, owner: str, automaton: Automaton) -> System:
    """Return the system with the automaton of an instance replaced."""
    instance = dataclasses.replace(system.instances[owner], automaton=automaton)
    return dataclasses.replace(system, instances={**system.instances, owner: instance})


def _rebuild_reason(batch: Batch, scenario: Scenario, name: str) -> str | None:
    """Return why a parameter needs Programs for each value; None if it can be tunable.

    The Programs at the least and the largest value are compared. Raises SpecError for a value that
    the checks refuse.
    """
    owner, _, short = name.partition(".")
    values = batch.parameters[name]
    single_system = _single_instance_system(batch.system, owner)
    ends = [
        _with_parameter_value(single_system, name, end)
        for end in sorted({float(min(values)), float(max(values))})
    ]
    for system in ends:
        programs_of(system, scenario)
    try:
        candidate_programs = [
            programs_of(_with_tunable_parameter(system, owner, short), scenario)[owner]
            for system in ends
        ]
    except SpecError as error:
        return f"{error.problems[0].label}: a Program for each value"
    if _is_not_real({owner: candidate_programs[0]}, name):
        return f"`{name}` is a whole number in C: a Program for each value"
    if len({digest(_without_values(program)) for program in candidate_programs}) == 1:
        return None
    return f"`{owner}` has numbers or times that are solved from it: a Program for each value"


def _is_not_real(programs: Mapping[str, Program], name: str) -> bool:
    """Return whether a tunable parameter is not real in its Program, as a wait in ticks."""
    owner, _, short = name.partition(".")
    constants = programs[owner].constants if owner in programs else ()
    return any(c.name == f"calibration.{short}" and c.type != "real" for c in constants)


def _single_instance_system(system: System, owner: str) -> System:
    """Return a system with one instance, whose Program does not depend on the others."""
    connections = {key: wire for key, wire in system.connections.items() if key[0] == owner}
    instances = {owner: system.instances[owner]}
    return dataclasses.replace(system, instances=instances, connections=connections)


def _without_values(program: Program) -> Program:
    """Return the Program with tunable and derived constants set to 0."""
    constants = tuple(
        dataclasses.replace(c, value=0.0) if c.kind in ("tunable", "derived") else c
        for c in program.constants
    )
    return dataclasses.replace(program, constants=constants)


def _with_tunable_parameter(system: System, owner: str, short: str) -> System:
    """Return the system with a parameter of an instance made tunable."""
    automaton = system.instances[owner].automaton
    parameter = dataclasses.replace(automaton.parameters[short], kind="tunable")
    parameters = {**automaton.parameters, short: parameter}
    return _with_automaton(system, owner, dataclasses.replace(automaton, parameters=parameters))
