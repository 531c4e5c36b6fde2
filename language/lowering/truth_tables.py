"""Truth tables of a sampled automaton, evaluated once a tick before its guards.

The tables read the equations of the source mode after the advance. All conditions are evaluated
first, then the one matching row of each table; then all results are stored. A variable that the row
does not assign keeps its value.
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
    """Return the block `evaluate_tables` of all truth tables; empty if there is none.

    First all conditions are evaluated, then the matching row of each table, then all results are
    stored. `known` has the names with equations.
    """
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
    """Return whether an equation of a mode directly reads a variable that a truth table assigns."""
    written = {name for table in automaton.tables for name in table.assigned_names}
    formulas = [formula for mode in automaton.all_modes for formula in mode.equations.values()]
    return not written.isdisjoint(names_read(formula.tree for formula in formulas))


def truth_table_variables(automaton: Automaton) -> list[Variable]:
    """Return the `work` variables of the tables, table by table.

    They are `work.decision_<k>_<condition>` of table k, from 1, and `work.decided_<name>` of each
    variable that it assigns.
    """
    found: list[Variable] = []
    for table in automaton.tables:
        found += [
            Variable(_condition_ref(automaton, table, name).name, "truth")
            for name in table.conditions
        ]
        found += [stage_variable(automaton, STAGE_NAME, name) for name in table.assigned_names]
    return found


def _lower_table(automaton: Automaton, table: TruthTable, known: NameBindings) -> Block:
    """Return the chain of branches over the rows of a table, in order.

    The checks ensure that exactly one row matches (language/checks/check_truth_table.py), so the
    last row needs no condition.
    """
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
    """Return the assignments of the results of a row; the others keep their present value."""
    unchanged = [
        Assign(f"work.{STAGE_NAME}_{name}", known[name])
        for name in table.assigned_names
        if name not in row.assignments
    ]
    return (*read_stage(automaton, row.assignments, known, STAGE_NAME), *unchanged)


def _row_condition(automaton: Automaton, table: TruthTable, row: TruthRow) -> Expr | None:
    """Return the conjunction of the marks of a row; None if no condition has a mark."""
    found: Expr | None = None
    for name, mark in zip(table.conditions, row.marks, strict=True):
        if mark is not None:
            bit: Expr = _condition_ref(automaton, table, name)
            here = bit if mark else Unary("not", bit)
            found = here if found is None else Binary("and", found, here)
    return found


def _condition_ref(automaton: Automaton, table: TruthTable, condition: str) -> Ref:
    """Return the variable of a condition of a table."""
    return Ref(f"work.decision_{automaton.tables.index(table) + 1}_{condition}")
