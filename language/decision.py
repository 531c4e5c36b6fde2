"""Decision: the truth tables of a sampled automaton, once a tick before its guards are read.

Rule: after the advance, on the equations of the mode that was active, all conditions are evaluated,
then the one row of each table that holds; all rows read the values before the tables, then all
commit. What a row does not write keeps its value. Equations are evaluated anew where they read it.
"""

from __future__ import annotations

from language.action import committing, reading, work_variable
from language.lower import Names, expression, reads_of
from language.model import Automaton
from language.operation import Assign, Binary, Block, Branch, Expr, Op, Ref, Unary
from language.program import Variable
from language.truth import TruthRow, TruthTable

VERB = "decided"


def decision_block(automaton: Automaton, known: Names) -> Block:
    """Return `decide`: what all tables write; nothing where there is none."""
    conditions: list[Op] = []
    rows: list[Op] = []
    for table in automaton.tables:
        for name, formula in table.conditions.items():
            key = f"{automaton.name} {formula.key}"
            conditions.append(
                Assign(_bit(automaton, table, name).name, expression(formula.tree, known), key)
            )
        rows += _chain(automaton, table, known)
    written = [name for table in automaton.tables for name in table.written]
    return (*conditions, *rows, *committing(automaton, written, VERB))


def decided_equations(automaton: Automaton) -> bool:
    """Tell whether some equation reads what a table writes."""
    written = {name for table in automaton.tables for name in table.written}
    formulas = [formula for mode in automaton.all_modes for formula in mode.equations.values()]
    return not written.isdisjoint(reads_of(formula.tree for formula in formulas))


def decision_variables(automaton: Automaton) -> list[Variable]:
    """Return the work variables of the tables."""
    found: list[Variable] = []
    for table in automaton.tables:
        found += [Variable(_bit(automaton, table, name).name, "truth") for name in table.conditions]
        found += [work_variable(automaton, VERB, name) for name in table.written]
    return found


def _chain(automaton: Automaton, table: TruthTable, known: Names) -> Block:
    """Exactly one row holds (language/check_truth_table.py): the last one needs no question."""
    *others, last = table.rows
    chain = _row(automaton, table, last, known)
    for row in reversed(others):
        condition = _holds(automaton, table, row)
        assert condition is not None, f"{table.key}: a row beside others has no mark"
        chain = (Branch(condition, _row(automaton, table, row, known), chain),)
    return chain


def _row(automaton: Automaton, table: TruthTable, row: TruthRow, known: Names) -> Block:
    """What a row writes, and what it leaves as it is."""
    kept = [
        Assign(f"work.{VERB}_{name}", known[name])
        for name in table.written
        if name not in row.results
    ]
    return (*reading(automaton, row.results, known, VERB), *kept)


def _holds(automaton: Automaton, table: TruthTable, row: TruthRow) -> Expr | None:
    found: Expr | None = None
    for name, mark in zip(table.conditions, row.marks, strict=True):
        if mark is not None:
            bit: Expr = _bit(automaton, table, name)
            here = bit if mark else Unary("not", bit)
            found = here if found is None else Binary("and", found, here)
    return found


def _bit(automaton: Automaton, table: TruthTable, condition: str) -> Ref:
    return Ref(f"work.decision_{automaton.tables.index(table) + 1}_{condition}")
