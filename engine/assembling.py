"""Assembling: what is to be compiled of a system - instances, wires, sensors, recorded columns."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from fractions import Fraction

from engine.rows import recorded
from language.assembly import Assembly, Column, Course, Feed
from language.declaration import Formula
from language.experiment import Connection, Scenario, System
from language.operation import Block
from language.program import Program
from language.traversal import block_reads
from language.wires import block_of, piece_block, wire_formulas, wires_program


def assembly_of(system: System, scenario: Scenario, programs: Mapping[str, Program]) -> Assembly:
    """Return what is to be compiled of a system and a resolved scenario."""
    formulas = wire_formulas(system, scenario)
    truths = {name for name, thing in system.inputs.items() if thing.truth}
    truths |= {line.name for line in system.lines.values() if line.source in truths}
    for owner, program in programs.items():
        truths |= {f"{owner}.{w.name}" for w in program.outputs if w.type == "truth"}
    wires = wires_program(formulas, frozenset(truths))
    feeds: dict[str, list[Feed]] = {name: [] for name in programs}
    for (owner, _), connection in system.connections.items():
        feeds[owner].append(_feed(connection, programs[owner], system))
    columns = [Column(c.name, c.source, c.block) for c in recorded(system, scenario, programs)]
    slots = dict.fromkeys(column.source for column in columns if not column.block)
    for column in columns:
        if column.block:
            slots.update(dict.fromkeys(_signals(wires.blocks[column.block])))
    controlled = {
        owner
        for (owner, _), connection in system.connections.items()
        if any(read.partition(".")[0] in programs for read in connection.reads)
    }
    return Assembly(
        programs=programs,
        order=system.order,
        inputs=(*system.inputs, *system.lines),
        feeds={name: tuple(found) for name, found in feeds.items()},
        sensors=system.sensors,
        wires=wires,
        slots=tuple(slots),
        columns=tuple(columns),
        controlled=frozenset(controlled),
        courses=tuple(_courses(system, scenario)),
    )


def _feed(connection: Connection, program: Program, system: System) -> Feed:
    name = connection.target[1]
    variable = next(v for v in program.inputs if v.name == f"input.{name}")
    source = connection.source
    limited = any(v.name == f"latched.{name}" for v in program.variables)
    flagged = any(v.name == f"is_new.{name}" for v in program.variables)
    sensors = tuple(r for r in connection.reads if r in system.sensors) if flagged else ()
    if isinstance(source, Formula):
        return Feed(variable, "", block_of(connection), limited, sensors)
    value = source if isinstance(source, str) else source.numerator / source.denominator
    return Feed(variable, value, None, limited, sensors)


def _signals(block: Block) -> list[str]:
    return [n.removeprefix("signal.") for n in block_reads(block) if n.startswith("signal.")]


def _courses(system: System, scenario: Scenario) -> Iterator[Course]:
    """Yield the inputs that change between instants."""
    for name in (*system.inputs, *system.lines):
        line = system.lines.get(name)
        source = line.source if line else name
        stimulus = scenario.inputs[source]
        if stimulus.varies:
            pieces = enumerate(stimulus.pieces)
            blocks = tuple((k, piece_block(source, k)) for k, piece in pieces if piece.formula)
            yield Course(name, line.delay if line else Fraction(0), blocks)
