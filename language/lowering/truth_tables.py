"""Decision: the truth tables of a sampled automaton, once a tick before its guards are read.

Rule: after the advance, on the equations of the mode that was active, all conditions are evaluated,
then the one row of each table that holds; all rows read the values before the tables, then all
commit. What a row does not write keeps its value. Equations are evaluated anew where they read it.
"""

from __future__ import annotations

from language.ir.ops import Assign, Binary, Block, Branch, Expr, Op, Ref, Unary
from language.ir.program import Variable
from language.lowering.action_stages import commit_stage, read_stage, stage_variable
from language.lowering.expressions import NameBindings, lower_expression, names_read
from language.model.automaton import Automaton
from language.model.truth_table import TruthRow, TruthTable

STAGE_NAME = "decided"


def truth_table_block(automaton: Automaton, known: NameBindings) -> Block:
    """Return `decide`: what all tables write; nothing where there is none."""
    conditions: list[Op] = []
    rows: list[Op] = []
    for table in automaton.tables:
        for name, formula in table.conditions.items():
            key = f"{automaton.name} {formula.key}"
            conditions.append(
                Assign(
                    _condition_ref(automaton, table, name).name,
                    lower_expression(formula.tree, known),
                    key,
                )
            )
        rows += _lower_table(automaton, table, known)
    written = [name for table in automaton.tables for name in table.assigned_names]
    return (*conditions, *rows, *commit_stage(automaton, written, STAGE_NAME))


def has_table_dependent_equations(automaton: Automaton) -> bool:
    """Tell whether some equation reads what a table writes."""
    written = {name for table in automaton.tables for name in table.assigned_names}
    formulas = [formula for mode in automaton.all_modes for formula in mode.equations.values()]
    return not written.isdisjoint(names_read(formula.tree for formula in formulas))


def truth_table_variables(automaton: Automaton) -> list[Variable]:
    """Return the work variables of the tables."""
    found: list[Variable] = []
    for table in automaton.tables:
        found += [
            Variable(_condition_ref(automaton, table, name).name, "truth")
            for name in table.conditions
        ]
        found += [stage_variable(automaton, STAGE_NAME, name) for name in table.assigned_names]
    return found


def _lower_table(automaton: Automaton, table: TruthTable, known: NameBindings) -> Block:
    """Exactly one row holds (language/checks/check_truth_table.py): the last one needs no question."""
    *others, last = table.rows
    chain = _lower_row(automaton, table, last, known)
    for row in reversed(others):
        condition = _row_condition(automaton, table, row)
        assert condition is not None, f"{table.key}: a row beside others has no mark"
        chain = (Branch(condition, _lower_row(automaton, table, row, known), chain),)
    return chain


def _lower_row(
    automaton: Automaton, table: TruthTable, row: TruthRow, known: NameBindings
) -> Block:
    """What a row writes, and what it leaves as it is."""
    kept = [
        Assign(f"work.{STAGE_NAME}_{name}", known[name])
        for name in table.assigned_names
        if name not in row.assignments
    ]
    return (*read_stage(automaton, row.assignments, known, STAGE_NAME), *kept)


def _row_condition(automaton: Automaton, table: TruthTable, row: TruthRow) -> Expr | None:
    found: Expr | None = None
    for name, mark in zip(table.conditions, row.marks, strict=True):
        if mark is not None:
            bit: Expr = _condition_ref(automaton, table, name)
            here = bit if mark else Unary("not", bit)
            found = here if found is None else Binary("and", found, here)
    return found


def _condition_ref(automaton: Automaton, table: TruthTable, condition: str) -> Ref:
    return Ref(f"work.decision_{automaton.tables.index(table) + 1}_{condition}")
