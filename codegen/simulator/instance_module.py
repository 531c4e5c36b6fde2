"""Instance module: the template context of the C of one instance in a compiled simulation."""

from __future__ import annotations

import dataclasses
from typing import Any

from codegen.emit.c_expression import format_literal
from codegen.emit.c_module import module_context
from codegen.emit.c_names import CNames, c_member
from codegen.passes.block_usage import block_usages, locals_of
from codegen.passes.inline_policy import mark_inlining
from codegen.passes.range_violation_flags import RANGE_VIOLATION_FLAG, ranged_signals
from codegen.simulator.signal_names import INSTANCE_NAME, SignalNameMap, row_width
from codegen.simulator.simd_batch import simd_batch_context
from language.ir.program import LOG_COUNT_VARIABLE, LOG_VARIABLE, Program
from language.lowering.continuous_delay import RECORD_AGE
from language.programs.major_step import MAX_EVENTS_PER_STEP
from language.programs.system_program import (
    RANGE_TOLERANCE,
    SimulationAssembly,
    input_name,
    output_variables,
    range_event_variables,
)


def simulator_module_context(
    assembly: SimulationAssembly,
    name: str,
    program: Program,
    signal_names: SignalNameMap,
) -> dict[str, Any]:
    """Return the context of the template of an instance's C.

    It extends `module_context` with what the code around the blocks needs: defaults, monitored
    ranges, invariants, slots of the row, events. `flow` is the index of the instance
    among the continuous ones, -1 for a sampled one.
    """
    usage_by_block = block_usages(program, locals_of(program))
    c_names = CNames(program)
    is_flow = program.period is None
    flows = list(assembly.continuous_instances)
    slots = _row_slots(assembly, name, program)
    number = assembly.first_event_numbers()[name]
    return {
        **module_context(mark_inlining(program)),
        "digest": "",
        "title": f"Instance {name}",
        "is_flow": is_flow,
        "flow": flows.index(name) if is_flow else -1,
        "calls": {
            block: f"{block}({', '.join(usage_by_block[block].parameters)})"
            for block in usage_by_block
        },
        "defaults": _default_assignments(program),
        "ranges": _range_contexts(program, number) if is_flow else [],
        "invariants": _invariant_contexts(program, c_names, number),
        "has_record": "record" in program.blocks,
        "age": c_names(RECORD_AGE.name),
        "fired": [c_names(v) for v in program.fired_variables()],
        "log": [
            c_names(v.name)
            for v in program.variables
            if v.name in (LOG_VARIABLE, LOG_COUNT_VARIABLE)
        ],
        "bound": sum(len(program.modes_of(region)) for region in program.mode_variables()),
        "number": number,
        "looks": [(k, c_names(wire)) for k, wire in slots],
        "is_looked_at": any(not _is_retained(wire) for _, wire in slots),
        "width": row_width(assembly),
        "lagging": _lagging_sensors(assembly, name),
        "most_pieces": MAX_EVENTS_PER_STEP,
        "varying": varying_inputs(assembly, name, program, signal_names),
        "zero": format_literal(0.0, program.number_type),
        "states": [c_names(v.name) for v in program.variables if v.name.startswith("state.")],
        "has_faults": any(v.name == "memory.faults" for v in program.variables),
        "left": [] if is_flow else _range_mark_members(program, c_names),
        "finite": [c_names(wire.source) for wire in program.outputs if wire.type == "real"],
    }


def simd_batch_of(
    assembly: SimulationAssembly, name: str, program: Program, signal_names: SignalNameMap
) -> dict[str, Any] | None:
    """Return the template context of SIMD steps over several variants of an instance.

    Returns None for a sampled automaton, for inputs that vary inside a step, if a sensor with a lag
    measures the instance, and for a Program that `simd_batch_context` does not vectorise.
    """
    if (
        program.period is not None
        or varying_inputs(assembly, name, program, signal_names)
        or _lagging_sensors(assembly, name)
    ):
        return None
    return simd_batch_context(program, _row_slots(assembly, name, program))


def _row_slots(assembly: SimulationAssembly, name: str, program: Program) -> list[tuple[int, str]]:
    """Return pairs of a slot in a row and the variable of an instance that fills it."""
    wires = output_variables(program)
    own = [(k, slot) for k, slot in enumerate(assembly.row_signals) if slot.startswith(f"{name}.")]
    return [(k, wires[slot.partition(".")[2]]) for k, slot in own]


def _invariant_contexts(program: Program, c_names: CNames, number: int) -> list[dict[str, Any]]:
    """Return the contexts of invariants.

    Their event numbers follow those of transitions and ranges.
    """
    first = number + len(program.transitions) + len(range_event_variables(program))
    return [
        {
            "mode": c_names(program.mode_variables()[info.region]),
            "number": info.mode,
            "holds": c_names(info.variable),
            "event": first + k,
        }
        for k, info in enumerate(program.invariants)
    ]


def _lagging_sensors(assembly: SimulationAssembly, name: str) -> list[str]:
    """Return the C names of the sensors with a lag that measure an instance."""
    sensors = assembly.sensors.values()
    looking = [s for s in sensors if s.lag and s.source.partition(".")[0] == name]
    return [INSTANCE_NAME.format(sensor.name) for sensor in looking]


def _range_mark_members(program: Program, c_names: CNames) -> list[str]:
    """Return the C text of the flags for range violations."""
    return [c_names(RANGE_VIOLATION_FLAG.format(k)) for k, _ in enumerate(ranged_signals(program))]


def _is_retained(variable: str) -> bool:
    """Tell whether a variable has its value without an evaluation of equations."""
    return variable.startswith(("state.", "discrete.", "memory."))


def _default_assignments(program: Program) -> list[str]:
    """Return the C assignments of default inputs, and of flags for new values."""
    assignments = [
        f"{c_member(f'input.{key}')} = {format_literal(value, program.number_type)}"
        for key, value in program.defaults.items()
    ]
    flags = [v.name for v in program.variables if v.name.startswith("is_new.")]
    return [*assignments, *(f"is_new.{c_member(name)} = true" for name in flags)]


def _range_contexts(program: Program, number: int) -> list[dict[str, object]]:
    """Return the contexts of variables whose range is monitored in a simulation."""
    contexts = []
    for k, variable in enumerate(range_event_variables(program)):
        assert variable.range is not None
        low, high = variable.range
        slack = RANGE_TOLERANCE * (high - low)
        contexts.append(
            {
                "place": CNames(program)(variable.name),
                "low": repr(low - slack),
                "high": repr(high + slack),
                "number": number + len(program.transitions) + k,
            }
        )
    return contexts


def varying_inputs(
    assembly: SimulationAssembly, name: str, program: Program, signal_names: SignalNameMap
) -> list[dict[str, str]]:
    """Return the inputs of an instance that vary inside its steps, with their C text at a time.

    They are those whose Program has a variable `work.rise_<input>`, as `name` and `at`, in the
    order of the connections.
    """
    timed = dataclasses.replace(signal_names, is_timed=True)
    known = {variable.name for variable in program.variables}
    inputs = []
    for feed in assembly.input_sources[name]:
        if f"work.rise_{input_name(feed)}" in known:
            signal = (
                timed.emit_formula(feed.block)
                if feed.block
                else timed.emit_signal(str(feed.source))
            )
            inputs.append({"name": input_name(feed), "at": signal})
    return inputs
