"""MC/DC: represent guards as decisions of conditions and determine which conditions are covered.

MC/DC (Chilenski and Miller 1994, Applicability of modified condition/decision coverage) requires
that each condition independently affects the outcome. Unique cause: two evaluations differ in this
condition only and in the outcome. Masking: in both evaluations the outcome depends on the
condition, while others may differ. Equal conditions count once.
"""

from __future__ import annotations

import itertools
from collections.abc import Collection
from contextlib import suppress
from dataclasses import dataclass
from typing import Literal

from language.expressions.parser import parse_expression
from language.expressions.syntax_tree import BoolLiteral, Logic, Not, SyntaxTree
from language.ir.ops import Binary, Expr, Unary
from language.model.automaton import Transition
from language.model.printer import format_tree
from language.text.diagnostic import SpecError
from language.text.document import ScalarNode

DecisionStructure = (
    int
    | bool
    | tuple[str, "DecisionStructure"]
    | tuple[str, "DecisionStructure", "DecisionStructure"]
)
"""A condition by index, a constant, or `not`, `and`, `or` of structures."""
ConditionCoverage = Literal["unique cause", "masking", "always true", "always false", "not shown"]
COVERED: tuple[ConditionCoverage, ...] = ("unique cause", "masking")
"""The values that count as covered."""
MAX_CONDITIONS = 10
"""Largest number of conditions of a recorded decision; there are 2**n combinations."""


@dataclass(frozen=True)
class Decision:
    """The guard of a transition by key path, with conditions in the order of the text.

    The events of the transition come first. The completion of a superstate is one condition.
    """

    key: str
    conditions: tuple[str, ...]
    structure: DecisionStructure

    def outcome(self, combination: int) -> bool:
        """Return the value of the guard; bit k of the combination is condition k."""
        return _evaluate(self.structure, combination)

    def condition_coverage(self, combinations: Collection[int]) -> tuple[ConditionCoverage, ...]:
        """Return the coverage of each condition by the observed combinations.

        The first that applies: `unique cause` (two combinations differ in this condition only and
        in the outcome), `masking`, `always true` or `always false`, `not shown`. Without
        combinations it is `always false`.
        """
        return tuple(self._coverage_of(1 << k, combinations) for k in range(len(self.conditions)))

    def outcomes(self, combinations: Collection[int]) -> frozenset[bool]:
        """Return the different values of the guard over the combinations; empty without any."""
        return frozenset(self.outcome(combination) for combination in combinations)

    def _coverage_of(self, bit: int, combinations: Collection[int]) -> ConditionCoverage:
        """Return the coverage of the condition with this bit."""
        ons = [one for one in combinations if one & bit]
        offs = {one for one in combinations if not one & bit}
        if any(one ^ bit in offs and self._affects_outcome(one, bit) for one in ons):
            return "unique cause"
        mattering = [one for one in ons if self._affects_outcome(one, bit)]
        others = [one for one in offs if self._affects_outcome(one, bit)]
        if any(self.outcome(a) != self.outcome(b) for a, b in itertools.product(mattering, others)):
            return "masking"
        if not offs or not ons:
            return "always true" if ons else "always false"
        return "not shown"

    def _affects_outcome(self, combination: int, bit: int) -> bool:
        """Return whether the outcome changes if the condition with this bit is inverted."""
        return self.outcome(combination) != self.outcome(combination ^ bit)


def decision_of(transition: Transition) -> Decision:
    """Return the decision of a transition: any of its events, and its guard.

    The conditions are `event <name>` for each event, then the operands of `and`, `or` and `not` in
    the guard as texts; equal ones count once. The literal true beside events is left out. The
    completion of a superstate is the single condition `completion`.
    """
    if transition.is_completion:
        return Decision(transition.key, ("completion",), 0)
    conditions: list[SyntaxTree] = []

    def joined(tree: SyntaxTree) -> DecisionStructure:
        match tree:
            case Logic(operator, left, right, _):
                return (operator, joined(left), joined(right))
            case Not(operand, _):
                return ("not", joined(operand))
            case BoolLiteral(value, _):
                return value
        if tree not in conditions:
            conditions.append(tree)
        return conditions.index(tree) + len(transition.events)

    structure: DecisionStructure = any_of(len(transition.events))
    guard = transition.when.tree
    if not (transition.events and isinstance(guard, BoolLiteral) and guard.value):
        own = joined(guard)
        structure = ("and", structure, own) if transition.events else own
    events = (f"event {name}" for name in transition.events)
    return Decision(transition.key, (*events, *map(_condition_text, conditions)), structure)


def any_of(count: int) -> DecisionStructure:
    """Return the structure `or` of the conditions 0 to count - 1.

    For a count below 2 it is condition 0.
    """
    structure: DecisionStructure = 0
    for place in range(1, count):
        structure = ("or", structure, place)
    return structure


def match_conditions(structure: DecisionStructure, expr: Expr) -> dict[int, Expr] | None:
    """Return the lowered expression of each condition by index; None if the structures differ.

    A condition may be lowered to any expression, e.g. `rising(x)` to `x and not previous`; a
    constant matches anything. Of several occurrences of a condition the first one is taken.
    """
    match structure, expr:
        case bool(), _:
            return {}
        case int(place), _:
            return {place: expr}
        case (("not", inner), Unary("not", operand)):
            return match_conditions(inner, operand)
        case ((operator, left, right), Binary(found, first, second)) if operator == found:
            parts = match_conditions(left, first), match_conditions(right, second)
            if parts[0] is not None and parts[1] is not None:
                return {**parts[1], **parts[0]}
    return None


def _evaluate(structure: DecisionStructure, combination: int) -> bool:
    """Return the value of a structure for a combination. Raises TypeError for other objects."""
    match structure:
        case bool():
            return structure
        case int():
            return bool(combination >> structure & 1)
        case ("not", operand):
            return not _evaluate(operand, combination)
        case ("and", left, right):
            return _evaluate(left, combination) and _evaluate(right, combination)
        case (_, left, right):
            return _evaluate(left, combination) or _evaluate(right, combination)
    raise TypeError(f"not a decision: {structure}")


def _condition_text(tree: SyntaxTree) -> str:
    """Return the text of a condition as in the file, or formatted if it is not a single text
    there.
    """
    span = tree.span
    if not span.is_atomic and 1 <= span.line <= len(span.source.lines):
        line = span.source.lines[span.line - 1]
        text = line[span.column - 1 : span.column - 1 + span.width]
        with suppress(SpecError):
            if parse_expression(ScalarNode(text, span)) == tree:
                return text
    return format_tree(tree).removeprefix("(").removesuffix(")")
