"""Constants of a Program: the values of parameters and the block that recomputes derived ones.

Values are rounded to the number type of the automaton; times are evaluated exactly.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from fractions import Fraction
from typing import Any

from language.expressions.syntax_tree import (
    Arithmetic,
    Name,
    Negation,
    NumberLiteral,
    Power,
    SyntaxTree,
)
from language.ir.number_type import round_to_type
from language.ir.ops import Assign, Block
from language.ir.program import Constant
from language.lowering.expressions import lower_assigned_value
from language.lowering.program_parameters import (
    constant_bindings,
    constant_of,
    declaring_automaton,
    parameter_kinds,
    parameter_order,
)
from language.lowering.wait_ticks import seconds_to_ticks, tunable_waits
from language.model.automaton import Automaton, Transition
from language.model.declaration import Formula
from language.numerics.evaluate import ARITHMETIC, Scalar, evaluate
from language.text.diagnostic import Problems, SpecError


def parameter_constants(automaton: Automaton, problems: Problems) -> dict[str, Constant]:
    """Return the constants of all parameters and of the axes of tables.

    Keys are the names of parameters and `axis.<name>_<k>`. A parameter comes after those that it is
    derived from, an axis after its table. A tunable wait is a count of ticks, rounded up. A value
    that is not finite is reported as an error and replaced by 0.
    """
    known = constant_bindings(automaton)
    kinds = parameter_kinds(automaton)
    values: dict[str, Scalar] = {}
    found: dict[str, Constant] = {}
    for name in parameter_order(automaton):
        parameter = automaton.parameters[name]
        if parameter.derived:
            formula = lower_assigned_value(parameter.derived.tree, known, False)
            value = float(evaluate(formula, values, automaton.numbers))
        elif name in tunable_waits(automaton):
            value = seconds_to_ticks(automaton, parameter.value or Fraction(0))
        else:
            value = round_to_type(parameter.value or Fraction(0), automaton.numbers)
        if not math.isfinite(value):
            problems.error(
                "value",
                parameter.span,
                f"parameter `{name}` is {value}, not finite",
                "look for a division by zero or a huge power",
            )
            value = 0.0
        new = {name: constant_of(automaton, name, kinds[name], value)}
        new.update({axis.name: axis for axis in axis_constants(automaton, name)})
        found.update(new)
        values.update(constant_values(new))
    return found


def axis_constants(automaton: Automaton, name: str) -> list[Constant]:
    """Return the axes of a table parameter as fixed constants `axis.<name>_<k>`, k from 1.

    The points are rounded to the number type. The list is empty for a parameter that is no table.
    """
    table = automaton.parameters[name].table
    key = f"{declaring_automaton(automaton, name)} {automaton.parameters[name].key}.table.over"
    return [
        Constant(
            name=f"axis.{name}_{k}",
            kind="fixed",
            value=0.0,
            unit=str(axis.unit.dimension),
            key=f"{key} {axis.name}",
            items=tuple(round_to_type(point, automaton.numbers) for point in axis.points),
        )
        for k, axis in enumerate(table.axes if table else (), start=1)
    ]


def derive_block(automaton: Automaton) -> Block:
    """Return the assignments `derived.<name>` of the parameters that depend on tunable parameters.

    Each comes after those that it reads. Parameters that are derived from fixed ones only are left
    out.
    """
    known = constant_bindings(automaton)
    kinds = parameter_kinds(automaton)
    ops = []
    for name in parameter_order(automaton):
        derived = automaton.parameters[name].derived
        if derived and kinds[name] == "derived":
            key = f"{automaton.name} {derived.key}"
            ops.append(
                Assign(f"derived.{name}", lower_assigned_value(derived.tree, known, False), key)
            )
    return tuple(ops)


def constant_values(constants: Mapping[str, Constant]) -> dict[str, Scalar]:
    """Return the values of constants by their names in the Program; a table is a tuple."""
    found: dict[str, Any] = {c.name: c.items or c.value for c in constants.values()}
    return found


def evaluate_constant(
    formula: Formula, automaton: Automaton, values: Mapping[str, Scalar], what: str
) -> float:
    """Return the value of a formula of parameters, computed in float64.

    `values` are those of the constants by name in the Program; `what` names the quantity in
    messages. Raises SpecError if the formula reads another name, or if the value is not finite.
    """
    problems = Problems()
    try:
        value = float(
            evaluate(
                lower_assigned_value(formula.tree, constant_bindings(automaton), False), values
            )
        )
    except KeyError as error:
        label = f"`{error.args[0]}` is not a parameter: {what} is made of parameters"
        problems.error("constant", formula.span, label)
        raise SpecError(problems.reported) from None
    if not math.isfinite(value):
        problems.error(
            "value",
            formula.span,
            f"this is {value}, not a finite number",
            "look for a division by zero or a huge power",
        )
        raise SpecError(problems.reported)
    return value


def wait_seconds(transition: Transition, automaton: Automaton) -> Fraction:
    """Return the wait of a transition [s], exactly; 0 without `wait`.

    Raises SpecError like `evaluate_exactly`.
    """
    return evaluate_exactly(transition.wait, automaton) if transition.wait else Fraction(0)


def evaluate_exactly(formula: Formula, automaton: Automaton) -> Fraction:
    """Return the value of a formula of numbers and parameters as an exact fraction.

    Derived parameters are evaluated; a parameter without a value counts as 0. Only + - * /,
    negation and whole powers are allowed. Raises SpecError for another expression and for a
    division by zero.
    """
    problems = Problems()

    def value(tree: SyntaxTree) -> Fraction:
        """Return the exact value of a subtree; TypeError if it is not constant arithmetic."""
        match tree:
            case NumberLiteral(number, _, _):
                return number
            case Name(path, _) if path in automaton.parameters:
                parameter = automaton.parameters[path]
                return (
                    value(parameter.derived.tree)
                    if parameter.derived
                    else parameter.value or Fraction(0)
                )
            case Negation(operand, _):
                return -value(operand)
            case Power(base, exponent, _):
                return value(base) ** exponent
            case Arithmetic(operator, left, right, _):
                result: Fraction = ARITHMETIC[operator](value(left), value(right))
                return result
            case _:
                raise TypeError

    try:
        return value(formula.tree)
    except (TypeError, ZeroDivisionError):
        label = "a time is made of numbers, parameters and + - * /"
        problems.error("wait", formula.span, label)
        raise SpecError(problems.reported) from None
