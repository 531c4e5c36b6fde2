"""Run module: what the C of one instance of a run is made of."""

from __future__ import annotations

import dataclasses
from typing import Any

from codegen.abreast import abreast
from codegen.expression import literal
from codegen.marks import LEFT, ranged_signals
from codegen.names import CNames, c_member
from codegen.run_places import INSTANCE, Places, row_width
from codegen.source import module_context
from codegen.usage import locals_of, usages
from language.assembly import RANGE_SLACK, Assembly, ranged, short_input, wires_of
from language.history import AGE
from language.program import LOG, LOGGED, Program
from language.stepping import EVENTS_PER_STEP


def module_of(
    assembly: Assembly, name: str, program: Program, places: Places, flow: int
) -> dict[str, Any]:
    """Return what the template of an instance's C reads."""
    used = usages(program, locals_of(program))
    place = CNames(program)
    is_flow = program.period is None
    flows = list(assembly.flows)
    slots = _slots(assembly, name, program)
    number = assembly.numbers()[name]
    return {
        **module_context(program),
        "digest": "",
        "title": f"Instance {name}",
        "is_flow": is_flow,
        "flow": flows.index(name) if is_flow else -1,
        "calls": {block: f"{block}({', '.join(used[block].parameters)})" for block in used},
        "defaults": _defaults(program),
        "ranges": _ranges(program, number) if is_flow else [],
        "invariants": _invariants(program, place, number),
        "has_record": "record" in program.blocks,
        "age": place(AGE.name),
        "fired": [place(v) for v in program.fired_variables()],
        "log": [place(v.name) for v in program.variables if v.name in (LOG, LOGGED)],
        "bound": sum(len(program.modes_of(region)) for region in program.mode_variables()),
        "number": number,
        "looks": [(k, place(wire)) for k, wire in slots],
        "is_looked_at": any(not _is_carried(wire) for _, wire in slots),
        "width": row_width(assembly),
        "lagging": _lagging(assembly, name),
        "most_pieces": EVENTS_PER_STEP,
        "varying": varying(assembly, name, program, places),
        "zero": literal(0.0, program.number),
        "states": [place(v.name) for v in program.variables if v.name.startswith("state.")],
        "has_faults": any(v.name == "memory.faults" for v in program.variables),
        "left": [] if is_flow else _left(program, place),
        "finite": [place(wire.source) for wire in program.outputs if wire.type == "real"],
    }


def abreast_of(
    assembly: Assembly, name: str, program: Program, places: Places
) -> dict[str, Any] | None:
    """Return how steps of several variants are taken side by side, where nothing else looks in."""
    if (
        program.period is not None
        or varying(assembly, name, program, places)
        or _lagging(assembly, name)
    ):
        return None
    return abreast(program, _slots(assembly, name, program))


def _slots(assembly: Assembly, name: str, program: Program) -> list[tuple[int, str]]:
    """Return the places of an instance's signals in a row, with the variables they are."""
    wires = wires_of(program)
    own = [(k, slot) for k, slot in enumerate(assembly.slots) if slot.startswith(f"{name}.")]
    return [(k, wires[slot.partition(".")[2]]) for k, slot in own]


def _invariants(program: Program, place: CNames, number: int) -> list[dict[str, Any]]:
    """Return the assertions, whose events come after transitions and ranges."""
    first = number + len(program.transitions) + len(ranged(program))
    return [
        {
            "mode": place(program.mode_variables()[info.region]),
            "number": info.mode,
            "holds": place(info.variable),
            "event": first + k,
        }
        for k, info in enumerate(program.invariants)
    ]


def _lagging(assembly: Assembly, name: str) -> list[str]:
    """Return the filters of sensors that look at an instance."""
    sensors = assembly.sensors.values()
    looking = [s for s in sensors if s.lag and s.source.partition(".")[0] == name]
    return [INSTANCE.format(sensor.name) for sensor in looking]


def _left(program: Program, place: CNames) -> list[str]:
    return [place(LEFT.format(k)) for k, _ in enumerate(ranged_signals(program))]


def _is_carried(variable: str) -> bool:
    """Tell whether a variable is as it is without its equation."""
    return variable.startswith(("state.", "discrete.", "memory."))


def _defaults(program: Program) -> list[str]:
    found = [
        f"{c_member(f'input.{key}')} = {literal(value, program.number)}"
        for key, value in program.defaults.items()
    ]
    flags = [v.name for v in program.variables if v.name.startswith("is_new.")]
    return [*found, *(f"is_new.{c_member(name)} = true" for name in flags)]


def _ranges(program: Program, number: int) -> list[dict[str, object]]:
    found = []
    for k, variable in enumerate(ranged(program)):
        assert variable.range is not None
        low, high = variable.range
        slack = RANGE_SLACK * (high - low)
        found.append(
            {
                "place": CNames(program)(variable.name),
                "low": repr(low - slack),
                "high": repr(high + slack),
                "number": number + len(program.transitions) + k,
            }
        )
    return found


def varying(
    assembly: Assembly, name: str, program: Program, places: Places
) -> list[dict[str, str]]:
    """Return the inputs of an instance that change inside its steps, and what they are then."""
    timed = dataclasses.replace(places, is_timed=True)
    known = {variable.name for variable in program.variables}
    found = []
    for feed in assembly.feeds[name]:
        if f"work.rise_{short_input(feed)}" in known:
            signal = timed.formula(feed.block) if feed.block else timed.signal(str(feed.source))
            found.append({"name": short_input(feed), "at": signal})
    return found
