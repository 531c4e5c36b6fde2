"""Simulator source: prints a whole system as C that executes a planned run in one call.

The blocks are those of the Programs. The code around them does what the engine does between blocks
(engine/simulation/simulate.py, engine/execution/event_loop.py), so both have the same bits.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from fractions import Fraction
from typing import Any

from codegen.emit.c_expression import LocalNames, format_literal
from codegen.emit.c_math import emit_math_files
from codegen.emit.c_names import C_REAL_TYPE, c_member, c_type
from codegen.emit.c_struct import calibration_members
from codegen.passes.range_violation_flags import add_range_violation_flags
from codegen.simulator.instance_module import (
    simd_batch_of,
    simulator_module_context,
    varying_inputs,
)
from codegen.simulator.signal_names import (
    INSTANCE_NAME,
    SignalNameMap,
    emit_wire_formula,
    row_width,
    sensor_formulas,
)
from codegen.simulator.simd_batch import LANES
from codegen.toolchain.templates import product_version, render
from language.ir.number_type import NumberType
from language.ir.program import ENGINE_BLOCKS, STEP_INTERFACE, Program, unqualified_name
from language.ir.traversal import called_functions
from language.lowering.program_builder import finalise_program
from language.model.system import Sensor
from language.programs.system_program import (
    InputSource,
    InputTrajectory,
    SimulationAssembly,
    input_name,
    range_event_variables,
)


def emit_simulator_files(assembly: SimulationAssembly, simd_batch: bool = True) -> dict[str, str]:
    """Return the C files of a system's simulation by name; with `simd_batch` also SIMD steps.

    They are `run.h`, `run.c`, for each instance `i_<instance>.h` and `i_<instance>_run.c`, and
    ha_math for each number type that uses it.
    """
    programs = {
        name: _instance_program(name, program) for name, program in assembly.programs.items()
    }
    signal_names = SignalNameMap(assembly, programs)
    modules = {
        name: {
            **simulator_module_context(assembly, name, program, signal_names),
            "simd": simd_batch_of(assembly, name, program, signal_names) if simd_batch else None,
        }
        for name, program in programs.items()
    }
    context = _driver_context(assembly, programs, signal_names, modules)
    files = {
        "run.h": render("simulator/run.h.jinja", context),
        "run.c": render("simulator/run_driver.c.jinja", context),
    }
    numbers: dict[NumberType, None] = {"float64": None} if context["uses_math"] else {}
    for name, program in programs.items():
        files[f"{program.name}.h"] = render("emit/module.h.jinja", modules[name])
        files[f"{program.name}_run.c"] = render("simulator/run_module.c.jinja", modules[name])
        if modules[name]["uses_math"]:
            numbers[program.number_type] = None
    for number in numbers:
        files.update(emit_math_files(number))
    return files


def _instance_program(name: str, program: Program) -> Program:
    """Return the Program of an instance for printing.

    A sampled one has flags for range violations; a continuous one has the blocks that an engine
    runs.
    """
    own = dataclasses.replace(program, name=INSTANCE_NAME.format(name))
    if program.period is not None:
        return add_range_violation_flags(own)
    return finalise_program(
        own, ("init", "derive", *ENGINE_BLOCKS), keep=(*STEP_INTERFACE, "work.s")
    )


def _driver_context(
    assembly: SimulationAssembly,
    programs: Mapping[str, Program],
    signal_names: SignalNameMap,
    modules: Mapping[str, Mapping[str, Any]],
) -> dict[str, Any]:
    """Return the template context of the driver."""
    instances = [
        {
            **_instance_context(assembly, name, program, signal_names),
            "has_simd": bool(modules[name]["simd"]),
        }
        for name, program in programs.items()
    ]
    row_names = dataclasses.replace(signal_names, is_row=True)
    sensors = [_sensor_context(sensor, signal_names) for sensor in assembly.sensors.values()]
    called = called_functions(assembly.wires.blocks.values())
    has_lag = any(sensor.lag for sensor in assembly.sensors.values())
    return {
        "version": product_version(),
        "title": "A run",
        "instances": instances,
        "sensors": sensors,
        "sensor_formulas": sensor_formulas(),
        "seen": [seen for part in instances for flag in part["flags"] for seen, _ in flag["seen"]],
        "width": row_width(assembly),
        "lanes": LANES if any(one["has_simd"] for one in instances) else 0,
        "inputs": len(assembly.inputs),
        "has_lag": has_lag,
        "uses_math": has_lag or bool(called),
        "courses": [_course_context(assembly, course) for course in assembly.input_trajectories],
        "slots": [_slot_context(assembly, signal, signal_names) for signal in assembly.row_signals],
        "formulas": _formula_columns(assembly, row_names),
        "happenings": _happening_calls(assembly),
        "captures": _capture_calls(assembly),
        "tunables": [
            (
                INSTANCE_NAME.format(owner),
                unqualified_name(c.name),
                C_REAL_TYPE[programs[owner].number_type],
            )
            for owner, c in assembly.tunables()
        ],
    }


def _formula_columns(
    assembly: SimulationAssembly, row_names: SignalNameMap
) -> list[tuple[int, str]]:
    """Return the position in a row and the C text of each recorded column with a formula."""
    blocks = [column.block for column in assembly.columns if column.block]
    return [
        (len(assembly.row_signals) + k, row_names.emit_formula(block))
        for k, block in enumerate(blocks)
    ]


def _capture_calls(assembly: SimulationAssembly) -> list[tuple[int, str]]:
    """Return index and call of the capture action of each sensor with a delay."""
    return [
        (
            assembly.instant_actions.index(f"capture {n}"),
            f"{INSTANCE_NAME.format(n)}_capture(run, now);",
        )
        for n, sensor in assembly.sensors.items()
        if sensor.delay
    ]


def _slot_context(
    assembly: SimulationAssembly, signal: str, signal_names: SignalNameMap
) -> dict[str, object]:
    """Return the context of a slot of a row.

    An input with a trajectory is evaluated between instants.
    """
    courses = [course.name for course in assembly.input_trajectories]
    value = signal_names.emit_signal(signal)
    if signal in courses:
        value = f"is_instant ? {value} : course_{courses.index(signal)}(run, at)"
    return {"value": value, "is_flow": signal.partition(".")[0] in assembly.continuous_instances}


def _course_context(assembly: SimulationAssembly, course: InputTrajectory) -> dict[str, object]:
    """Return the context of an input trajectory: its delay as two doubles, its formulas."""
    high = float(course.delay)
    return {
        "delay": course.delay,
        "high": repr(high),
        "low": repr(float(course.delay - Fraction(high))),
        "column": assembly.inputs.index(course.name),
        "formulas": [
            (number, emit_wire_formula(assembly, block, LocalNames(lambda _: "now")))
            for number, block in course.formulas
        ],
    }


def _happening_calls(assembly: SimulationAssembly) -> list[tuple[int, str]]:
    """Return the index and the call of each action at an instant: samples of sensors and ticks."""
    calls = []
    for name in assembly.order:
        own = INSTANCE_NAME.format(name)
        if name in assembly.sensors:
            calls.append((assembly.instant_actions.index(name), f"{own}_sample(run, now);"))
        elif name not in assembly.continuous_instances:
            line = f"if (!tick_{own}(run, now)) {{ return false; }}"
            calls.append((assembly.instant_actions.index(name), line))
    return calls


def _instance_context(
    assembly: SimulationAssembly, name: str, program: Program, signal_names: SignalNameMap
) -> dict[str, Any]:
    """Return the context of an instance in the driver: inputs, flags, page and monitors."""
    is_flow = program.period is None
    varied = {c_member(c.name) for owner, c in assembly.tunables() if owner == name}
    flags = [
        {
            "name": input_name(feed),
            "seen": [
                (f"seen_{name}_{input_name(feed)}_{sensor}", INSTANCE_NAME.format(sensor))
                for sensor in feed.sensors
            ],
        }
        for feed in assembly.input_sources[name]
        if feed.sensors
    ]
    return {
        "name": program.name,
        "is_flow": is_flow,
        "flow": list(assembly.continuous_instances).index(name) if is_flow else -1,
        "is_controlled": name in assembly.controlled,
        "ranges": range_event_variables(program) if is_flow else (),
        "invariants": len(program.invariants),
        "feeds": [
            _feed_context(feed, program, signal_names) for feed in assembly.input_sources[name]
        ],
        "flags": flags,
        "varying": varying_inputs(assembly, name, program, signal_names),
        "page": [field for field in calibration_members(program) if field.name not in varied],
    }


def _feed_context(
    feed: InputSource, program: Program, signal_names: SignalNameMap
) -> dict[str, object]:
    """Return the context of an input of an instance: its C type and the value that it is fed."""
    kind = c_type(feed.variable, program.number_type)
    if feed.block:
        value = signal_names.emit_formula(feed.block)
    elif isinstance(feed.source, str):
        value = signal_names.emit_signal(feed.source)
    else:
        value = format_literal(feed.source, "float64")
    return {
        "name": c_member(feed.variable.name),
        "type": kind,
        "value": f"({value}) != 0.0" if kind == "bool" else f"({kind})({value})",
        "must_be_finite": feed.variable.type == "real" and not feed.has_saturation,
    }


def _sensor_context(sensor: Sensor, signal_names: SignalNameMap) -> dict[str, object]:
    """Return the context of a sensor: source, lag, noise, resolution, delay buffer."""
    name, lag = INSTANCE_NAME.format(sensor.name), float(sensor.lag)
    look = f"lag_look(&me->lag, {lag!r}, now, measured)" if sensor.lag else "measured"
    room = math.ceil(sensor.delay / sensor.period) + 2 if sensor.period and sensor.delay else 0
    return {
        "name": name,
        "source": signal_names.emit_signal(sensor.source),
        "lag": repr(lag) if sensor.lag else "",
        "look": look,
        "sd": repr(float(sensor.noise)) if sensor.noise else "",
        "quantum": repr(float(sensor.quantum)) if sensor.quantum else "",
        "room": room,
    }
