"""The connections of a system as a Program: one block for each expression between instances."""

from __future__ import annotations

from collections.abc import Mapping

from language.expressions.syntax_tree import names
from language.ir.ops import Assign, Block, Ref
from language.ir.program import Program, Variable
from language.lowering.expressions import lower_expression
from language.lowering.program_builder import FORMULA_RESULT, formula_program
from language.model.declaration import Formula
from language.model.system import Connection, Scenario, System


def wire_formulas(system: System, scenario: Scenario) -> dict[str, Formula]:
    """Return the formulas of a system and a scenario by the name of their block.

    They are those of connections, outputs and pieces of input stimuli, in this order; a connection,
    an output or a piece that is no formula has none.
    """
    found: dict[str, Formula] = {}
    for connection in system.connections.values():
        if isinstance(connection.source, Formula):
            found[connection_block(connection)] = connection.source
    for name, output in system.outputs.items():
        if isinstance(output, Formula):
            found[output_block(name)] = output
    for name, stimulus in scenario.inputs.items():
        for number, piece in enumerate(stimulus.pieces):
            if piece.formula:
                found[piece_block(name, number)] = piece.formula
    return found


def connection_block(connection: Connection) -> str:
    """Return the name of the block of a connection: `connection.<instance>.<input>`."""
    return "connection." + ".".join(connection.target)


def piece_block(name: str, number: int) -> str:
    """Return the name of the block of a piece of an input: `piece.<name>.<number>`, from 0."""
    return f"piece.{name}.{number}"


def output_block(name: str) -> str:
    """Return the name of the block of an output of the system: `output.<name>`."""
    return f"output.{name}"


def wires_program(formulas: Mapping[str, Formula], truths: frozenset[str]) -> Program:
    """Return a Program with one block for each formula, which reads `signal.<name>`.

    The keys of `formulas` are the names of the blocks. Each block sets FORMULA_RESULT. The Program
    is named `wires`. `truths` are the signals of type bool; all others are
    real.
    """
    read = {name.path for formula in formulas.values() for name in names(formula.tree)}
    known = {name: Ref(f"signal.{name}") for name in read}
    blocks: dict[str, Block] = {
        key: (Assign(FORMULA_RESULT, lower_expression(formula.tree, known), formula.key),)
        for key, formula in formulas.items()
    }
    variables = [
        Variable(f"signal.{name}", "truth" if name in truths else "real") for name in sorted(read)
    ]
    return formula_program("wires", variables, blocks)
