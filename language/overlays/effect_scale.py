"""Effect scale: parameters of effects that are multiples of a magnitude of the place.

With `scale: load` the numbers of a parameter are multiples of the load at the place. The magnitudes
come from recordings (`diagnosis`). A value that a variant gives is absolute and sets the magnitude:

    T_c: {value: 0.05, unit: $force, scale: load, range: [0, 5]}     values: {T_c: 2 N*m}
    -> T_c: {value: 2 N*m, unit: N*m, range: [0, 200]}

Without recordings and without a given value a magnitude is 1 in SI units, and there is no range.
"""

from __future__ import annotations

from collections.abc import Mapping
from decimal import Decimal
from fractions import Fraction

from language.expressions.parser import parse_expression
from language.expressions.syntax_tree import (
    Arithmetic,
    Name,
    NumberLiteral,
    Power,
    SyntaxTree,
    names,
)
from language.overlays.literal_format import format_decimal
from language.readers.base_reader import Reader
from language.text.diagnostic import Problems, suggest_name
from language.text.document import Entry, MappingNode, ScalarNode, SequenceNode, YamlNode
from language.text.node_edit import mapping_entries, put_node, scalars_of

SCALE_NAMES = (
    *("load", "rate", "least", "inertia", "stretch"),
    *("level", "time", "response", "period", "horizon"),
)
"""Magnitudes [SI] of a place: force and speed of a balance or element, least magnitude of the state
of a balance, inertia, deflection of a spring, value of a signal, correlation time of the signal,
time constant of the model, sample period, length of a recording."""
QUANTITY_KEYS = ("value", "range", "neutral", "plain", "starts")
"""Keys of a parameter whose numbers are multiples."""


def scale_parameters(
    body: MappingNode, scales: Mapping[str, Fraction], values: Mapping[str, Entry]
) -> MappingNode:
    """Return the body of an effect in which the numbers of parameters are absolute.

    `scales` are the magnitudes of the place [SI]. A missing one is 1, and a parameter that reads it
    loses its range. A parameter in `values` has the magnitude for which its declared value, or else
    its first start that is not 0, is the size of the given value. Values that cannot be read are
    left to later checks.
    """
    for entry in mapping_entries(body.get("parameters")):
        node = entry.node
        if isinstance(node, MappingNode) and isinstance(text := node.get("scale"), ScalarNode):
            tree = parse_expression(text)
            factor = _evaluate(tree, scales)
            given = _factor_of_value(node, values[entry.key]) if entry.key in values else None
            is_known = given or all(name.path in scales for name in names(tree))
            scaled = _scale_node(node, given or factor)
            body = put_node(
                body, ("parameters", entry.key), scaled if is_known else _without_range(scaled)
            )
    return body


def remove_scale(parameter: Entry, problems: Problems) -> Entry:
    """Return a parameter without its `scale`; a scale that is not valid is reported.

    A scale is a product or quotient of `SCALE_NAMES` and their powers. The numbers of a parameter
    with a scale have no unit.
    """
    node = parameter.node
    if not isinstance(node, MappingNode) or "scale" not in node.entries:
        return parameter
    text = node.get("scale")
    with problems.collect_errors():
        if not isinstance(text, ScalarNode):
            problems.error("effect", node.entries["scale"].span, "a scale is a magnitude")
            problems.raise_if_errors()
        assert isinstance(text, ScalarNode)
        tree = parse_expression(text)
        for name in names(tree):
            if name.path not in SCALE_NAMES:
                label = f"`{name.path}` is no magnitude of a place"
                hint = suggest_name(name.path, SCALE_NAMES) or f"there are {' '.join(SCALE_NAMES)}"
                problems.error("effect", name.span, label, hint)
        if not _is_product(tree):
            label = "a scale is a product of magnitudes and their whole powers"
            problems.error("effect", text.span, label, "`scale: inertia / time^2`")
    for key in QUANTITY_KEYS:
        for item in _numbers(node.get(key)):
            if " " in item.text.strip():
                label = "with `scale` a number is a multiple, without a unit"
                problems.error("effect", item.span, label)
    entries = {key: part for key, part in node.entries.items() if key != "scale"}
    return Entry(parameter.key, parameter.span, MappingNode(entries, node.span))


def _is_product(tree: SyntaxTree) -> bool:
    """Return whether a tree consists of names, numbers, `*`, `/` and powers."""
    match tree:
        case Name() | NumberLiteral():
            return True
        case Arithmetic(operator, left, right, _):
            return operator in ("*", "/") and _is_product(left) and _is_product(right)
        case Power(base, _, _):
            return _is_product(base)
        case _:
            return False


def _evaluate(tree: SyntaxTree, scales: Mapping[str, Fraction]) -> Fraction:
    """Return the value of a scale [SI]; magnitudes that are not known are 1."""
    match tree:
        case Name(path, _):
            return scales.get(path, Fraction(1))
        case NumberLiteral(value, _, _):
            return value
        case Arithmetic("*", left, right, _):
            return _evaluate(left, scales) * _evaluate(right, scales)
        case Arithmetic("/", left, right, _):
            return _evaluate(left, scales) / _evaluate(right, scales)
        case Power(base, exponent, _):
            return Fraction(_evaluate(base, scales) ** exponent)
        case _:
            raise TypeError(tree)


def _factor_of_value(parameter: MappingNode, given: Entry) -> Fraction | None:
    """Return the magnitude that a given value sets; None for 0 or without a number to compare."""
    if not isinstance(given.node, ScalarNode):
        return None
    reader = Reader(Problems())
    value, _ = reader.read_quantity(given.node, given.key, given.span, None)
    declared = [
        reader.read_quantity(item, given.key, given.span, None)[0]
        for key in ("value", "starts")
        for item in _numbers(parameter.get(key))
    ]
    reference = next((one for one in declared if one), None)
    return abs(value / reference) if value and reference else None


def _scale_node(parameter: MappingNode, factor: Fraction) -> MappingNode:
    """Return a parameter whose numbers are multiplied by a factor, without `scale`."""
    entries = {key: entry for key, entry in parameter.entries.items() if key != "scale"}
    for key in QUANTITY_KEYS:
        if key in entries:
            entries[key] = Entry(key, entries[key].span, _multiply(entries[key].node, factor))
    return MappingNode(entries, parameter.span)


def _without_range(parameter: MappingNode) -> MappingNode:
    """Return a parameter without its range."""
    entries = {key: entry for key, entry in parameter.entries.items() if key != "range"}
    return MappingNode(entries, parameter.span)


def _multiply(node: YamlNode, factor: Fraction) -> YamlNode:
    """Return a number or a list of numbers times a factor; other texts stay."""
    if isinstance(node, SequenceNode):
        return SequenceNode(tuple(_multiply(item, factor) for item in node.nodes), node.span)
    if not isinstance(node, ScalarNode) or node.text == "absent":
        return node
    value, _ = Reader(Problems()).read_quantity(node, "value", node.span, None)
    product = value * factor
    number = Decimal(product.numerator) / Decimal(product.denominator)
    return ScalarNode(format_decimal(number.normalize()), node.span)


def _numbers(node: YamlNode | None) -> tuple[ScalarNode, ...]:
    """Return the numbers of a value or a list of values."""
    return tuple(item for item in scalars_of(node) if item.text != "absent")
