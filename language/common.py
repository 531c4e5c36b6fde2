"""Common: a value that a block computes twice is computed once, and has a name.

Value numbering (Cocke and Schwartz 1970): equal operations on equal numbers have equal numbers; a
variable that is written has a new one.
"""

from __future__ import annotations

import dataclasses
from collections import Counter
from collections.abc import Hashable, Mapping

from language.formula_name import formula_name, formula_text
from language.lower import is_whole
from language.operation import Assign, Binary, Block, Call, Expr, Item, Op, Ref, Run, Store, Value
from language.program import Program, Variable
from language.substitution import own_expressions, parts, with_expressions, with_parts
from language.traversal import block_writes, walk

CHEAP = ("real", "whole", "abs")
"""Operations that cost no more than a name."""


def common_once(program: Program) -> Program:
    """Return a Program whose blocks compute no real twice from the same values."""
    writes = _writes(program)
    taken = {name.partition(".")[2].lower() for name in _names(program)}
    variables: dict[str, Variable] = {}
    blocks = {
        name: _Block(block, writes, taken, variables).result()
        for name, block in program.blocks.items()
    }
    return dataclasses.replace(
        program, blocks=blocks, variables=(*program.variables, *variables.values())
    )


class _Block:
    """The operations of one block, in order; those inside others are left as they are."""

    def __init__(
        self,
        block: Block,
        writes: Mapping[str, frozenset[str]],
        taken: set[str],
        variables: dict[str, Variable],
    ) -> None:
        self.block = block
        self.writes = writes
        self.taken = taken
        self.variables = variables
        self.versions: Counter[str] = Counter()
        self.counts: Counter[int] = Counter()
        self.named: dict[int, str] = {}
        self.numbers: dict[Hashable, int] = {}
        self.keys: dict[int, int] = {}
        self.result_ops: list[Op] = []

    def result(self) -> Block:
        """Return the block: its values are counted, then those that are read again are named."""
        for op in self.block:
            if isinstance(op, Assign | Store):
                for expr in own_expressions(op):
                    self._count(expr)
            self._pass(op)
        self.versions.clear()
        for op in self.block:
            if isinstance(op, Assign | Store):
                (changed,) = with_expressions((op,), self._change)
                self.result_ops.append(changed)
            else:
                self.result_ops.append(op)
            self._pass(op)
        return tuple(self.result_ops)

    def _pass(self, op: Op) -> None:
        """What an operation writes, in the blocks that it runs too, is another value from here."""
        self.keys.clear()
        self.versions.update(set(block_writes((op,))))
        for inner in walk((op,)):
            if isinstance(inner, Run):
                self.versions.update(self.writes[inner.block])

    def _key(self, expr: Expr) -> int:
        """Return the number of a value; that of an expression holds for one operation."""
        if id(expr) not in self.keys:
            value = self._parts(expr)
            self.keys[id(expr)] = self.numbers.setdefault(value, len(self.numbers))
        return self.keys[id(expr)]

    def _parts(self, expr: Expr) -> Hashable:
        match expr:
            case Value(value):
                return repr(value)
            case Ref(name):
                return name, self.versions[name]
            case Item(name, index):
                return name, self.versions[name], self._key(index)
            case Binary(operator, left, right):
                return operator, self._key(left), self._key(right)
            case Call(function, arguments):
                return function, tuple(self._key(argument) for argument in arguments)
            case _:
                return id(expr)

    def _count(self, expr: Expr) -> None:
        if _is_worth(expr):
            key = self._key(expr)
            self.counts[key] += 1
            if self.counts[key] > 1:
                return  # what is inside is not computed again either
        for part in parts(expr):
            self._count(part)

    def _change(self, expr: Expr) -> Expr:
        key = self._key(expr) if _is_worth(expr) else None
        if key is None or self.counts[key] < 2:
            return with_parts(expr, self._change)
        if key not in self.named:
            value = with_parts(expr, self._change)
            self.named[key] = self._name(expr)
            self.result_ops.append(Assign(self.named[key], value, formula_text(expr)))
        return Ref(self.named[key])

    def _name(self, expr: Expr) -> str:
        """Return a new name, or that of the same formula in another block."""
        about, base = formula_text(expr), formula_name(expr)
        name, number = base, 1
        while name.lower() in self.taken:
            known = self.variables.get(f"work.{name}")
            if known and known.about == about and known.name not in self.named.values():
                return known.name
            number += 1
            name = f"{base}_{number}"
        self.taken.add(name.lower())
        self.variables[f"work.{name}"] = Variable(f"work.{name}", "real", about=about)
        return f"work.{name}"


def _is_worth(expr: Expr) -> bool:
    if isinstance(expr, Binary):
        return expr.operator in "+-*/" and not is_whole(expr)
    return isinstance(expr, Call) and expr.function not in CHEAP


def _names(program: Program) -> list[str]:
    found = [v.name for v in program.variables] + [c.name for c in program.constants]
    return [*found, *(f"block.{name}" for name in program.blocks)]


def _writes(program: Program) -> dict[str, frozenset[str]]:
    """Return what each block writes, in the blocks that it runs too."""
    found: dict[str, frozenset[str]] = {}

    def visit(name: str) -> frozenset[str]:
        if name not in found:
            block = program.blocks[name]
            own = set(block_writes(block))
            for op in walk(block):
                if isinstance(op, Run):
                    own |= visit(op.block)
            found[name] = frozenset(own)
        return found[name]

    for name in program.blocks:
        visit(name)
    return found
