"""Check of temperatures: warns of a temperature in degC that is used as a difference (rule 20a).

The value of `3 degC` is 276.15 K. It is a point on the scale and no difference, so the sum of two
such temperatures and the comparison of one with a difference have no meaning.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from typing import Literal

from language.expressions.syntax_tree import (
    Arithmetic,
    Conditional,
    FunctionCall,
    Name,
    Negation,
    NumberLiteral,
    Relation,
    SyntaxTree,
    children,
    walk,
)
from language.model.automaton import Automaton
from language.model.declaration import Formula, Input, State
from language.model.used_names import formulas_of
from language.text.diagnostic import Problems

Kind = Literal["point", "difference"] | None
"""Meaning of a value: a temperature on the scale, a difference of two, or not known."""


def check_temperatures(automaton: Automaton, problems: Problems) -> None:
    """Warn of sums of two temperatures, and of comparisons of a temperature with a difference.

    A name is a temperature if it is declared in degC, a state also if its start value has the unit
    degC. A quantity in K may be a temperature or a difference, so nothing is known of it. A sum
    that is a factor or a dividend is accepted, because a mean value is such a sum.
    """
    for named, label in _meaningless_uses(automaton, ()):
        hint = f"if `{named[-1].path}` is a difference, declare it in K: 3 degC are 276.15 K"
        problems.warning("temperature", named[-1].span, label, hint)


def parameters_used_as_differences(automaton: Automaton, in_celsius: Collection[str]) -> set[str]:
    """Return those of the parameters `in_celsius` that `check_temperatures` would warn of.

    Their values are given in degC, whatever the unit of their declaration.
    """
    uses = _meaningless_uses(automaton, in_celsius)
    return {one.path for named, _ in uses for one in named} & set(in_celsius)


def _meaningless_uses(
    automaton: Automaton, in_celsius: Collection[str]
) -> list[tuple[list[Name], str]]:
    """Return the parameters in degC in each sum or comparison without meaning, and what it is.

    `in_celsius` are further parameters in degC.
    """
    declared = {name for name, one in automaton.parameters.items() if one.unit.offset}
    check = _TemperatureCheck({*_temperatures(automaton), *in_celsius}, {*declared, *in_celsius})
    if check.in_celsius:
        for part in formulas_of(automaton):
            for tree in (part.tree,) if isinstance(part, Formula) else (part.left, part.right):
                check.kind_of(tree)
    return check.found


def _temperatures(automaton: Automaton) -> Iterator[str]:
    """Yield the names of parameters, inputs and states that are temperatures on the scale."""
    for name, parameter in automaton.parameters.items():
        if parameter.unit.offset:
            yield name
    variables: dict[str, Input | State] = {**automaton.inputs, **automaton.state_variables}
    for name, variable in variables.items():
        if variable.unit.offset:
            yield name
    for name, state in automaton.state_variables.items():
        if has_celsius(state.initial.tree):
            yield name


def has_celsius(tree: SyntaxTree) -> bool:
    """Return whether an expression has a number in degC."""
    return any(isinstance(one, NumberLiteral) and one.unit.offset for one in walk(tree))


class _TemperatureCheck:
    """Computes the kind of each part of an expression and collects the parts without meaning."""

    def __init__(self, points: set[str], in_celsius: set[str]) -> None:
        self.points = points
        self.in_celsius = in_celsius
        self.found: list[tuple[list[Name], str]] = []

    def kind_of(self, tree: SyntaxTree, is_scaled: bool = False) -> Kind:
        """Return the kind of a value; `is_scaled` tells that it is a factor or a dividend."""
        match tree:
            case Name():
                return "point" if tree.path in self.points else None
            case NumberLiteral():
                return "point" if tree.unit.offset else None
            case Negation():
                kind = self.kind_of(tree.operand, is_scaled)
                return "difference" if kind == "difference" else None
            case Arithmetic(operator="+" | "-"):
                return self._kind_of_sum(tree, is_scaled)
            case Conditional():
                self.kind_of(tree.condition)
                kinds = {self.kind_of(one, is_scaled) for one in (tree.then, tree.other)}
                return kinds.pop() if len(kinds) == 1 else None
            case FunctionCall(function="min" | "max"):
                kinds = {self.kind_of(one, is_scaled) for one in tree.arguments}
                return kinds.pop() if len(kinds) == 1 else None
            case Relation():
                kinds = {self.kind_of(tree.left), self.kind_of(tree.right)}
                if kinds == {"point", "difference"}:
                    self._collect(tree, "this compares a temperature in degC with a difference")
                return None
        for part in children(tree):
            self.kind_of(part, is_scaled=isinstance(tree, Arithmetic))
        return None

    def _kind_of_sum(self, tree: Arithmetic, is_scaled: bool) -> Kind:
        """Return the kind of a sum or a difference; collect the sum of two temperatures."""
        left, right = self.kind_of(tree.left, is_scaled), self.kind_of(tree.right, is_scaled)
        if left == right == "difference":
            return "difference"
        if tree.operator == "-":
            if left == right == "point":
                return "difference"
            return "point" if (left, right) == ("point", "difference") else None
        if left == right == "point":
            if not is_scaled:
                self._collect(tree, "this adds two temperatures, of which one is in degC")
            return None
        return "point" if "point" in (left, right) else None

    def _collect(self, tree: Arithmetic | Relation, label: str) -> None:
        """Collect the parameters in degC of an expression, if it has one."""
        named = [one for one in walk(tree) if isinstance(one, Name) and one.path in self.in_celsius]
        if named:
            self.found.append((named, label))
