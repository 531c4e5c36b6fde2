"""Symbolic summary: the values of variables after a block, as clauses of a contract.

The clauses are lemmas between the C and its contract: they are proven of a function and assumed
where it is called. A value without a translation to ACSL is unconstrained.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TypeAlias

from codegen.proofs.acsl.acsl_expression import Look, Speech, Unsaid
from language.ir.ops import Assign, Block, Branch, Count, Expr, Op, Ref, RunBlock, Store, Switch
from language.ir.traversal import block_writes, reachable_blocks

LONGEST = 20000
"""Maximum length of the text of a value [characters]; a longer value is unconstrained."""


@dataclass(frozen=True)
class Fork:
    """A choice between two values by a predicate of the initial values."""

    test: str
    then: Found
    other: Found


Found: TypeAlias = str | Fork | None
"""A value in terms of the initial values; None is unconstrained."""
Values: TypeAlias = dict[str, Found]


@dataclass(frozen=True)
class Summary:
    """The effects of blocks.

    `before` gives the text of an initial value, `now` of a final value.
    """

    blocks: Mapping[str, Block]
    speech: Speech
    before: Look
    now: Look

    def ensured(self, block: Block, silent: frozenset[str]) -> Iterator[str]:
        """Yield the postconditions of a block for all variables it writes, except `silent`."""
        values: Values = {}
        self._block(block, values)
        for name, found in sorted(values.items()):
            said = "" if name in silent else self._said(name, found)
            if said and said != "\\true" and len(said) < LONGEST:
                yield f"ensures {said};"

    def written(self, block: Block) -> set[str]:
        """Return the variables that a block and the blocks that it runs may write."""
        found = set(block_writes(block))
        for name in self._run_by(block):
            found |= set(block_writes(self.blocks[name]))
        return found

    def _run_by(self, block: Block) -> set[str]:
        return reachable_blocks("", {**self.blocks, "": block}) - {""}

    def _said(self, name: str, found: Found) -> str:
        """Return that a variable has a value now."""
        match found:
            case None:
                return "\\true"
            case Fork(test, then, other):
                sides = self._said(name, then), self._said(name, other)
                if sides == ("\\true", "\\true"):
                    return "\\true"
                return f"(({test}) ? {sides[0]} : {sides[1]})"
        relation = "<==>" if self.speech.is_truth_name(name) else "=="
        return f"(({self.now(name)}) {relation} ({found}))"

    def _look(self, values: Values) -> Look:
        def look(name: str) -> str:
            return self._text(values[name]) if name in values else self.before(name)

        return look

    def _text(self, found: Found) -> str:
        match found:
            case None:
                raise Unsaid
            case Fork(test, then, other):
                return f"(({test}) ? ({self._text(then)}) : ({self._text(other)}))"
        return found

    def _block(self, block: Block, values: Values) -> None:
        for op in block:
            self._op(op, values)

    def _op(self, op: Op, values: Values) -> None:
        match op:
            case Assign(target, value, _):
                values[target] = self._value(target, value, values)
            case Branch(condition, then, other):
                self._forked(self._test(condition, values), then, other, values)
            case Switch(selector, cases):
                self._chosen(selector, cases, values)
            case Count(timer, condition, limit, _):
                count = self._value_of(timer, values)
                on: Found = count and Fork(f"{count} < {limit}", f"({count} + 1)", count)
                test = self._test(condition, values)
                values[timer] = Fork(test, on, "0") if test else None
            case RunBlock(name):
                self._block(self.blocks[name], values)
            case Store(array, Ref(index), value) if index not in values:
                values[item(array, index)] = self._value("", value, values)
            case _:
                for name in self.written((op,)):
                    values[name] = None
                    values.update({n: None for n in values if n.startswith(f"{name} ")})

    def _value(self, target: str, value: Expr, values: Values) -> Found:
        speech, look = self.speech, self._look(values)
        try:
            if speech.is_truth_name(target):
                return _short(speech.predicate(value, look))
            return _short(speech.term(value, look))
        except Unsaid:
            return None

    def _value_of(self, name: str, values: Values) -> str:
        try:
            return _short(self._look(values)(name)) or ""
        except Unsaid:
            return ""

    def _test(self, condition: Expr, values: Values) -> str:
        try:
            return _short(self.speech.predicate(condition, self._look(values))) or ""
        except Unsaid:
            return ""

    def _chosen(self, selector: str, cases: tuple[tuple[int, Block], ...], values: Values) -> None:
        now = self._value_of(selector, values)
        merged = dict(values)
        for number, block in reversed(cases):
            own = dict(values)
            self._block(block, own)
            merged = self._merged(f"{now} == {number}" if now else "", own, merged)
        values.update(merged)

    def _forked(self, test: str, then: Block, other: Block, values: Values) -> None:
        first, second = dict(values), dict(values)
        self._block(then, first)
        self._block(other, second)
        values.update(self._merged(test, first, second))

    def _merged(self, test: str, then: Values, other: Values) -> Values:
        found: Values = {}
        for name in {**then, **other}:
            one, two = (own[name] if name in own else self.before(name) for own in (then, other))
            found[name] = one if one == two else Fork(test, one, two) if test else None
        return found


def item(array: str, index: str) -> str:
    """Return the name of an array element whose index is the initial value of a variable."""
    return f"{array} {index}"


def _short(text: str) -> str | None:
    return text if len(text) < LONGEST else None
