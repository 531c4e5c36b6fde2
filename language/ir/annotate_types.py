"""Type annotation: the pass that gives each reference the type of its declaration.

    Ref(timer.t)    ->    Ref(timer.t, is_integer=True)        where timer.t is declared whole

Lowering may leave the mark of a reference out where it does not depend on it. The declaration of a
variable or constant is the only home of its type, and every reference of a finished Program agrees
with it.
"""

from __future__ import annotations

import dataclasses

from language.ir.ops import Block, Expr, Item, Ref
from language.ir.program import Program
from language.ir.rewrite_ops import map_expressions, map_operands


def annotate_types(program: Program) -> Program:
    """Return a Program in which `is_integer` of each Ref and Item follows from its declaration.

    Names that are not declared, and the bodies of functions, are unchanged.
    """
    types = program.types()
    whole = frozenset(name for name, kind in types.items() if kind == "whole")

    def annotate(expr: Expr) -> Expr:
        """Return an expression with its references marked."""
        if isinstance(expr, Ref):
            is_whole = expr.name in whole
            if is_whole == expr.is_integer or expr.name not in types:
                return expr
            return Ref(expr.name, is_whole)
        inner = map_operands(expr, annotate)
        if isinstance(inner, Item) and inner.name in types:
            is_whole = inner.name in whole
            return (
                inner if is_whole == inner.is_integer else Item(inner.name, inner.index, is_whole)
            )
        return inner

    def annotate_block(block: Block) -> Block:
        """Return a block with its references marked."""
        return map_expressions(block, annotate)

    return dataclasses.replace(
        program, blocks={name: annotate_block(block) for name, block in program.blocks.items()}
    )
