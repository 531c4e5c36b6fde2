"""Build system program: collects instances, wires, sensors and recorded columns for compilation."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from fractions import Fraction

from engine.results.row_recorder import recorded_columns
from language.ir.ops import Block
from language.ir.program import Program
from language.ir.traversal import block_reads
from language.model.declaration import Formula
from language.model.system import Connection, Scenario, System
from language.programs.connection_program import (
    connection_block,
    piece_block,
    wire_formulas,
    wires_program,
)
from language.programs.system_program import (
    InputSource,
    InputTrajectory,
    RecordedSignal,
    SimulationAssembly,
)


def assembly_of(
    system: System, scenario: Scenario, programs: Mapping[str, Program]
) -> SimulationAssembly:
    """Return the assembly of a system and a resolved scenario.

    Its inputs are those of the system, then the delayed signals. Row signals are those that the
    recorded columns read, directly or in an expression, each once. An instance is `controlled` if
    one of its inputs reads a signal of an instance. `input_trajectories` are only of inputs and
    delayed signals whose stimulus varies between instants.
    """
    formulas = wire_formulas(system, scenario)
    truths = {name for name, thing in system.inputs.items() if thing.is_bool}
    truths |= {line.name for line in system.delayed_signals.values() if line.source in truths}
    for owner, program in programs.items():
        truths |= {f"{owner}.{w.name}" for w in program.outputs if w.type == "truth"}
    wires = wires_program(formulas, frozenset(truths))
    feeds: dict[str, list[InputSource]] = {name: [] for name in programs}
    for (owner, _), connection in system.connections.items():
        feeds[owner].append(_feed_of(connection, programs[owner], system))
    columns = [
        RecordedSignal(c.name, c.source, c.block)
        for c in recorded_columns(system, scenario, programs)
    ]
    slots = dict.fromkeys(column.source for column in columns if not column.block)
    for column in columns:
        if column.block:
            slots.update(dict.fromkeys(_signals_read(wires.blocks[column.block])))
    controlled = {
        owner
        for (owner, _), connection in system.connections.items()
        if any(read.partition(".")[0] in programs for read in connection.reads)
    }
    return SimulationAssembly(
        programs=programs,
        order=system.order,
        inputs=(*system.inputs, *system.delayed_signals),
        input_sources={name: tuple(sources) for name, sources in feeds.items()},
        sensors=system.sensors,
        wires=wires,
        row_signals=tuple(slots),
        columns=tuple(columns),
        controlled=frozenset(controlled),
        input_trajectories=tuple(_varying_inputs(system, scenario)),
    )


def _feed_of(connection: Connection, program: Program, system: System) -> InputSource:
    """Return the source of an input: a signal, a number or an expression block, and its flags."""
    name = connection.target[1]
    variable = next(v for v in program.inputs if v.name == f"input.{name}")
    source = connection.source
    limited = any(v.name == f"latched.{name}" for v in program.variables)
    flagged = any(v.name == f"is_new.{name}" for v in program.variables)
    sensors = tuple(r for r in connection.reads if r in system.sensors) if flagged else ()
    if isinstance(source, Formula):
        return InputSource(variable, "", connection_block(connection), limited, sensors)
    value = source if isinstance(source, str) else source.numerator / source.denominator
    return InputSource(variable, value, None, limited, sensors)


def _signals_read(block: Block) -> list[str]:
    """Return the signals that a block of the wires reads."""
    return [n.removeprefix("signal.") for n in block_reads(block) if n.startswith("signal.")]


def _varying_inputs(system: System, scenario: Scenario) -> Iterator[InputTrajectory]:
    """Yield the inputs and delayed inputs that change between instants."""
    for name in (*system.inputs, *system.delayed_signals):
        line = system.delayed_signals.get(name)
        source = line.source if line else name
        stimulus = scenario.inputs[source]
        if stimulus.varies:
            pieces = enumerate(stimulus.pieces)
            blocks = tuple((k, piece_block(source, k)) for k, piece in pieces if piece.formula)
            yield InputTrajectory(name, line.delay if line else Fraction(0), blocks)
