"""Printer of the checked model: one value a line, values in SI, with dimensions."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping
from fractions import Fraction

from language.expressions.syntax_tree import (
    Arithmetic,
    BoolLiteral,
    Conditional,
    FunctionCall,
    Logic,
    Name,
    Negation,
    Not,
    NumberLiteral,
    Power,
    Relation,
    SyntaxTree,
)
from language.expressions.units import Dimension, Unit
from language.model.automaton import Automaton, Balance
from language.model.declaration import Formula
from language.text.diagnostic import Span

INDENT = "  "
SKIPPED_FIELDS = ("name", "key", "span")
"""Fields that are not printed."""


def format_model(automaton: Automaton) -> str:
    """Return a checked automaton as text, one field a line, indented by two blanks a level.

    Values are in SI and each operation is in parentheses. Fields with default values, empty
    collections, names, keys and places are left out.
    """
    return "\n".join([f"automaton {automaton.name}", *_field_lines(automaton, 1)]) + "\n"


def format_tree(tree: SyntaxTree) -> str:
    """Return an expression as text with each operation in parentheses and literals in SI.

    A literal has its unit in SI symbols behind it unless it is a pure number; a whole value is
    exact, another one is the repr of its double. A tree of an unknown class, an ErrorNode included,
    gives `?`.
    """
    match tree:
        case NumberLiteral(value, unit, _):
            return _format_number(value) + (
                "" if unit.dimension.is_number else f" {unit.dimension}"
            )
        case BoolLiteral(value, _):
            return "true" if value else "false"
        case Name(path, _):
            return path
        case Negation(operand, _):
            return f"(-{format_tree(operand)})"
        case Not(operand, _):
            return f"(not {format_tree(operand)})"
        case (
            Arithmetic(operator, left, right, _)
            | Logic(operator, left, right, _)
            | Relation(operator, left, right, _)
        ):
            return f"({format_tree(left)} {operator} {format_tree(right)})"
        case Power(base, exponent, _):
            return f"({format_tree(base)}^{exponent})"
        case Conditional(condition, then, other, _):
            parts = (format_tree(part) for part in (condition, then, other))
            return "(if {} then {} else {})".format(*parts)
        case FunctionCall(function, arguments, _):
            return f"{function}({', '.join(format_tree(argument) for argument in arguments)})"
        case _:
            return "?"


def _field_lines(thing: object, depth: int) -> Iterator[str]:
    """Yield the lines of the fields of a dataclass that differ from their defaults."""
    assert dataclasses.is_dataclass(thing) and not isinstance(thing, type)
    for item in dataclasses.fields(thing):
        if item.name not in SKIPPED_FIELDS and getattr(thing, item.name) != item.default:
            yield from _value_lines(item.name, getattr(thing, item.name), depth)


def _value_lines(name: str, value: object, depth: int) -> Iterator[str]:
    """Yield the lines of a named value; an empty collection has none."""
    head = INDENT * depth + name
    short = _format_inline(value)
    if short is not None:
        yield f"{head}: {short}" if short else head
    elif isinstance(value, Mapping):
        below = [line for key in value for line in _value_lines(str(key), value[key], depth + 1)]
        yield from [f"{head}:", *below] if below else []
    elif isinstance(value, tuple):
        below = [line for item in value for line in _value_lines(_item_name(item), item, depth + 1)]
        yield from [f"{head}:", *below] if below else []
    elif dataclasses.is_dataclass(value):
        below = list(_field_lines(value, depth + 1))
        yield from [f"{head}:", *below] if below else []


def _format_inline(value: object) -> str | None:
    """Return a value as text if it fits on the line of its name, otherwise None.

    A place (`Span`) gives an empty text: its name alone is printed.
    """
    match value:
        case bool():
            return "true" if value else "false"
        case str() | int():
            return str(value)
        case Fraction():
            return _format_number(value)
        case Formula():
            return format_tree(value.tree)
        case Balance():
            return f"{format_tree(value.left)} = {format_tree(value.right)}"
        case Unit():
            return value.text
        case Dimension():
            return str(value)
        case Span():
            return ""
        case tuple() if value and all(isinstance(item, Fraction | str | int) for item in value):
            return ", ".join(
                _format_number(i) if isinstance(i, Fraction) else str(i) for i in value
            )
    return None


def _item_name(item: object) -> str:
    """Return the name of an item of a tuple, or of its class if it has none."""
    return str(getattr(item, "name", type(item).__name__))


def _format_number(value: Fraction) -> str:
    """Return an integer exactly, and a fraction as the shortest text of its float64 value."""
    return str(value.numerator) if value.denominator == 1 else repr(float(value))
