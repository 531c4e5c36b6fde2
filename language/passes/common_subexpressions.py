"""Common-subexpression elimination: the pass after which a block computes a real expression once.

before                      after
a := ((x * y) + 1.0)        work.x_y := (x * y)
b := ((x * y) + 2.0)        a := (work.x_y + 1.0)
                            b := (work.x_y + 2.0)

The values are those of a local value numbering.
"""

from __future__ import annotations

import dataclasses
from collections import Counter
from collections.abc import Mapping

from language.ir.expression_type import is_whole
from language.ir.formula_name import format_formula, formula_name
from language.ir.ops import Assign, Binary, Block, Call, Expr, Op, Ref, Store
from language.ir.program import Program, Variable
from language.ir.rewrite_ops import direct_expressions, map_expressions, map_operands, operands
from language.ir.traversal import block_writes, called_blocks, reachable_blocks
from language.passes.value_numbering import ValueNumbering

CHEAP_FUNCTIONS = ("real", "whole", "abs")
"""Functions that cost no more than reading a variable."""


def eliminate_common_subexpressions(program: Program) -> Program:
    """Return a Program whose blocks compute no real expression twice from the same values.

    Named are arithmetic on reals and calls other than CHEAP_FUNCTIONS that occur twice or more in
    the assignments and stores of one block, until a variable that they read is written. Expressions
    inside branches, loops and switches are left as they are. The new `work` variables are named
    after their formula; a name in use gets `_2`, `_3`, ...
    """
    writes = _transitive_writes(program)
    taken = {name.partition(".")[2].lower() for name in _all_names(program)}
    variables: dict[str, Variable] = {}
    blocks = {
        name: _BlockRewriter(block, writes, taken, variables).rewrite()
        for name, block in program.blocks.items()
    }
    return dataclasses.replace(
        program, blocks=blocks, variables=(*program.variables, *variables.values())
    )


class _BlockRewriter:
    """Rewriter of the assignments of one block; nested operations are not rewritten."""

    def __init__(
        self,
        block: Block,
        writes: Mapping[str, frozenset[str]],
        used_names: set[str],
        variables: dict[str, Variable],
    ) -> None:
        self.block = block
        self.writes = writes
        self.used_names = used_names
        self.variables = variables
        self.values = ValueNumbering()
        self.use_counts: Counter[int] = Counter()
        self.names_by_number: dict[int, str] = {}
        self.rewritten_ops: list[Op] = []

    def rewrite(self) -> Block:
        """Return the block with repeated expressions replaced by variables.

        The first traversal counts the uses of each value, the second one replaces them.
        """
        for op in self.block:
            if isinstance(op, Assign | Store):
                for expr in direct_expressions(op):
                    self._count_uses(expr)
            self._invalidate_written(op)
        self.values.versions.clear()
        for op in self.block:
            if isinstance(op, Assign | Store):
                (changed,) = map_expressions((op,), self._replace_repeated)
                self.rewritten_ops.append(changed)
            else:
                self.rewritten_ops.append(op)
            self._invalidate_written(op)
        return tuple(self.rewritten_ops)

    def _invalidate_written(self, op: Op) -> None:
        """Start a new version of each variable that an operation writes, directly or by a block."""
        self.values.versions.update(set(block_writes((op,))))
        for called in called_blocks((op,)):
            self.values.versions.update(self.writes[called])

    def _count_uses(self, expr: Expr) -> None:
        """Count the values of an expression; the parts of a repeated value are skipped."""
        if _is_worth_naming(expr):
            key = self.values.number_of(expr)
            self.use_counts[key] += 1
            if self.use_counts[key] > 1:
                return  # its parts are not computed again either
        for part in operands(expr):
            self._count_uses(part)

    def _replace_repeated(self, expr: Expr) -> Expr:
        """Return an expression in which values with two or more uses are variables.

        The first use appends the assignment of the variable to the rewritten operations.
        """
        key = self.values.number_of(expr) if _is_worth_naming(expr) else None
        if key is None or self.use_counts[key] < 2:
            return map_operands(expr, self._replace_repeated)
        if key not in self.names_by_number:
            value = map_operands(expr, self._replace_repeated)
            self.names_by_number[key] = self._choose_name(expr)
            self.rewritten_ops.append(
                Assign(self.names_by_number[key], value, format_formula(expr))
            )
        return Ref(self.names_by_number[key])

    def _choose_name(self, expr: Expr) -> str:
        """Return the name of a new variable, or that of the same formula in another block."""
        about, base = format_formula(expr), formula_name(expr)
        name, number = base, 1
        while name.lower() in self.used_names:
            known = self.variables.get(f"work.{name}")
            if known and known.about == about and known.name not in self.names_by_number.values():
                return known.name
            number += 1
            name = f"{base}_{number}"
        self.used_names.add(name.lower())
        self.variables[f"work.{name}"] = Variable(f"work.{name}", "real", about=about)
        return f"work.{name}"


def _is_worth_naming(expr: Expr) -> bool:
    """Return whether an expression computes a real by arithmetic or by a costly function."""
    if isinstance(expr, Binary):
        return expr.operator in "+-*/" and not is_whole(expr)
    return isinstance(expr, Call) and expr.function not in CHEAP_FUNCTIONS


def _all_names(program: Program) -> list[str]:
    """Return the names of all variables and constants, and `block.<name>` of all blocks."""
    found = [v.name for v in program.variables] + [c.name for c in program.constants]
    return [*found, *(f"block.{name}" for name in program.blocks)]


def _transitive_writes(program: Program) -> dict[str, frozenset[str]]:
    """Return the variables that each block writes, directly or through the blocks that it runs."""
    return {
        name: frozenset(
            variable
            for run in reachable_blocks(name, program.blocks)
            for variable in block_writes(program.blocks[run])
        )
        for name in program.blocks
    }
