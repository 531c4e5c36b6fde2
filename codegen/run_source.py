"""Run source: a whole system as C that carries out a planned run in one call, for this machine.

The blocks are those of the Programs, printed as everywhere; around them stands what the engine does
between them (engine/simulate.py, engine/continuous.py), so that both have the same bits.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from fractions import Fraction
from typing import Any

from codegen.abreast import LANES
from codegen.expression import literal
from codegen.marks import marked
from codegen.mathematics import math_files
from codegen.member import page_of
from codegen.names import REAL, c_member, c_type
from codegen.rendering import render, version
from codegen.run_module import abreast_of, module_of, varying
from codegen.run_places import INSTANCE, Clock, Places, formula_of, row_width
from language.assembly import Assembly, Course, Feed, ranged, short_input
from language.continuous import PARTS
from language.number import NumberType
from language.program import Program, short
from language.signal import Sensor
from language.stepping import BETWEEN
from language.traversal import block_names
from language.wiring import finished


def run_files(assembly: Assembly, side_by_side: bool = True) -> dict[str, str]:
    """Return the files of a system's runs by name; `side_by_side` ones are for many variants."""
    programs = {name: _part(name, program) for name, program in assembly.programs.items()}
    places = Places(assembly, programs)
    inside = {
        name: {
            **module_of(assembly, name, program, places, flow),
            "abreast": abreast_of(assembly, name, program, places) if side_by_side else None,
        }
        for flow, (name, program) in enumerate(programs.items())
    }
    context = _driver(assembly, programs, places, inside)
    files = {
        "run.h": render("run.h.jinja", context),
        "run.c": render("run_driver.c.jinja", context),
    }
    numbers: dict[NumberType, None] = {"float64": None} if context["uses_math"] else {}
    for name, program in programs.items():
        files[f"{program.name}.h"] = render("module.h.jinja", inside[name])
        files[f"{program.name}_run.c"] = render("run_module.c.jinja", inside[name])
        if inside[name]["uses_math"]:
            numbers[program.number] = None
    for number in numbers:
        files.update(math_files(number))
    return files


def _part(name: str, program: Program) -> Program:
    """Return the Program of an instance as it is printed: its parts, or its tick."""
    own = dataclasses.replace(program, name=INSTANCE.format(name))
    if program.period is not None:
        return marked(own)
    return finished(own, ("init", "derive", *PARTS), keep=(*BETWEEN, "work.s"))


def _driver(
    assembly: Assembly,
    programs: Mapping[str, Program],
    places: Places,
    inside: Mapping[str, Mapping[str, Any]],
) -> dict[str, Any]:
    instances = [
        {
            **_instance(assembly, name, program, places),
            "is_abreast": bool(inside[name]["abreast"]),
        }
        for name, program in programs.items()
    ]
    rows = dataclasses.replace(places, is_row=True)
    sensors = [_sensor(sensor, places) for sensor in assembly.sensors.values()]
    wired = {name for block in assembly.wires.blocks.values() for name in block_names(block)}
    called = {name for name in wired if name.startswith("call ")}
    has_lag = any(sensor.lag for sensor in assembly.sensors.values())
    return {
        "version": version(),
        "title": "A run",
        "instances": instances,
        "sensors": sensors,
        "seen": [seen for part in instances for flag in part["flags"] for seen, _ in flag["seen"]],
        "width": row_width(assembly),
        "lanes": LANES if any(one["is_abreast"] for one in instances) else 0,
        "inputs": len(assembly.inputs),
        "has_lag": has_lag,
        "uses_math": has_lag or bool(called),
        "courses": [_course(assembly, course) for course in assembly.courses],
        "slots": [_slot(assembly, signal, places) for signal in assembly.slots],
        "formulas": _formulas(assembly, rows),
        "happenings": _happenings(assembly),
        "captures": _captures(assembly),
        "tunables": [
            (INSTANCE.format(owner), short(c.name), REAL[programs[owner].number])
            for owner, c in assembly.tunables()
        ],
    }


def _formulas(assembly: Assembly, rows: Places) -> list[tuple[int, str]]:
    """Return the place in a row of each column that is a formula, behind the slots, and its C."""
    blocks = [column.block for column in assembly.columns if column.block]
    return [(len(assembly.slots) + k, rows.formula(block)) for k, block in enumerate(blocks)]


def _captures(assembly: Assembly) -> list[tuple[int, str]]:
    """Return, for each sensor with a delay, the happening at which it captures, and the call."""
    return [
        (assembly.happenings.index(f"capture {n}"), f"{INSTANCE.format(n)}_capture(run, now);")
        for n, sensor in assembly.sensors.items()
        if sensor.delay
    ]


def _slot(assembly: Assembly, signal: str, places: Places) -> dict[str, object]:
    """Return what fills a slot of a row; an input may change between the instants."""
    courses = [course.name for course in assembly.courses]
    value = places.signal(signal)
    if signal in courses:
        value = f"is_instant ? {value} : course_{courses.index(signal)}(run, at)"
    return {"value": value, "is_flow": signal.partition(".")[0] in assembly.flows}


def _course(assembly: Assembly, course: Course) -> dict[str, object]:
    high = float(course.delay)
    return {
        "delay": course.delay,
        "high": repr(high),
        "low": repr(float(course.delay - Fraction(high))),
        "column": assembly.inputs.index(course.name),
        "formulas": [
            (number, formula_of(assembly, block, Clock())) for number, block in course.formulas
        ],
    }


def _happenings(assembly: Assembly) -> list[tuple[int, str]]:
    found = []
    for name in assembly.order:
        own = INSTANCE.format(name)
        if name in assembly.sensors:
            found.append((assembly.happenings.index(name), f"{own}_sample(run, now);"))
        elif name not in assembly.flows:
            line = f"if (!tick_{own}(run, now)) {{ return false; }}"
            found.append((assembly.happenings.index(name), line))
    return found


def _instance(assembly: Assembly, name: str, program: Program, places: Places) -> dict[str, Any]:
    is_flow = program.period is None
    varied = {c_member(c.name) for owner, c in assembly.tunables() if owner == name}
    flags = [
        {
            "name": short_input(feed),
            "seen": [
                (f"seen_{name}_{short_input(feed)}_{sensor}", INSTANCE.format(sensor))
                for sensor in feed.sensors
            ],
        }
        for feed in assembly.feeds[name]
        if feed.sensors
    ]
    return {
        "name": program.name,
        "is_flow": is_flow,
        "flow": list(assembly.flows).index(name) if is_flow else -1,
        "is_controlled": name in assembly.controlled,
        "ranges": ranged(program) if is_flow else (),
        "invariants": len(program.invariants),
        "feeds": [_fed(feed, program, places) for feed in assembly.feeds[name]],
        "flags": flags,
        "varying": varying(assembly, name, program, places),
        "page": [field for field in page_of(program) if field.name not in varied],
    }


def _fed(feed: Feed, program: Program, places: Places) -> dict[str, object]:
    kind = c_type(feed.variable, program.number)
    if feed.block:
        value = places.formula(feed.block)
    elif isinstance(feed.source, str):
        value = places.signal(feed.source)
    else:
        value = literal(feed.source, "float64")
    return {
        "name": c_member(feed.variable.name),
        "type": kind,
        "value": f"({value}) != 0.0" if kind == "bool" else f"({kind})({value})",
        "must_be_finite": feed.variable.type == "real" and not feed.is_limited,
    }


def _sensor(sensor: Sensor, places: Places) -> dict[str, object]:
    name, lag = INSTANCE.format(sensor.name), float(sensor.lag)
    look = f"lag_look(&me->lag, {lag!r}, now, measured)" if sensor.lag else "measured"
    room = math.ceil(sensor.delay / sensor.period) + 2 if sensor.period and sensor.delay else 0
    return {
        "name": name,
        "source": places.signal(sensor.source),
        "lag": repr(lag) if sensor.lag else "",
        "look": look,
        "sd": repr(float(sensor.noise)) if sensor.noise else "",
        "quantum": repr(float(sensor.quantum)) if sensor.quantum else "",
        "room": room,
    }
