"""Model text: a checked model printed, one value a line, with SI values and dimensions."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping
from fractions import Fraction

from language.declaration import Formula
from language.model import Automaton, Balance
from language.problem import Span
from language.syntax import (
    Application,
    Arithmetic,
    Choice,
    Logic,
    Name,
    Negative,
    Not,
    Number,
    Power,
    Relation,
    Tree,
    Truth,
)
from language.units import Dimension, Unit

INDENT = "  "
SKIPPED = ("name", "key", "span")


def model_text(automaton: Automaton) -> str:
    """Return a checked automaton as text: every value in SI, every operation in parentheses."""
    return "\n".join([f"automaton {automaton.name}", *_fields(automaton, 1)]) + "\n"


def tree_text(tree: Tree) -> str:
    """Return an expression with every operation in parentheses and literals in SI."""
    match tree:
        case Number(value, unit, _):
            return _number(value) + ("" if unit.dimension.is_number else f" {unit.dimension}")
        case Truth(value, _):
            return "true" if value else "false"
        case Name(path, _):
            return path
        case Negative(operand, _):
            return f"(-{tree_text(operand)})"
        case Not(operand, _):
            return f"(not {tree_text(operand)})"
        case (
            Arithmetic(operator, left, right, _)
            | Logic(operator, left, right, _)
            | Relation(operator, left, right, _)
        ):
            return f"({tree_text(left)} {operator} {tree_text(right)})"
        case Power(base, exponent, _):
            return f"({tree_text(base)}^{exponent})"
        case Choice(condition, then, other, _):
            parts = (tree_text(part) for part in (condition, then, other))
            return "(if {} then {} else {})".format(*parts)
        case Application(function, arguments, _):
            return f"{function}({', '.join(tree_text(argument) for argument in arguments)})"
        case _:
            return "?"


def _fields(thing: object, depth: int) -> Iterator[str]:
    assert dataclasses.is_dataclass(thing) and not isinstance(thing, type)
    for item in dataclasses.fields(thing):
        if item.name not in SKIPPED and getattr(thing, item.name) != item.default:
            yield from _lines(item.name, getattr(thing, item.name), depth)


def _lines(name: str, value: object, depth: int) -> Iterator[str]:
    head = INDENT * depth + name
    short = _short(value)
    if short is not None:
        yield f"{head}: {short}" if short else head
    elif isinstance(value, Mapping):
        below = [line for key in value for line in _lines(str(key), value[key], depth + 1)]
        yield from [f"{head}:", *below] if below else []
    elif isinstance(value, tuple):
        below = [line for item in value for line in _lines(_named(item), item, depth + 1)]
        yield from [f"{head}:", *below] if below else []
    elif dataclasses.is_dataclass(value):
        below = list(_fields(value, depth + 1))
        yield from [f"{head}:", *below] if below else []


def _short(value: object) -> str | None:
    """Return what fits on the line of its name; None for what has lines of its own."""
    match value:
        case bool():
            return "true" if value else "false"
        case str() | int():
            return str(value)
        case Fraction():
            return _number(value)
        case Formula():
            return tree_text(value.tree)
        case Balance():
            return f"{tree_text(value.left)} = {tree_text(value.right)}"
        case Unit():
            return value.text
        case Dimension():
            return str(value)
        case Span():
            return ""
        case tuple() if value and all(isinstance(item, Fraction | str | int) for item in value):
            return ", ".join(_number(i) if isinstance(i, Fraction) else str(i) for i in value)
    return None


def _named(item: object) -> str:
    return str(getattr(item, "name", type(item).__name__))


def _number(value: Fraction) -> str:
    return str(value.numerator) if value.denominator == 1 else repr(float(value))
