"""Name types: the types of the names in an automaton's tree, before it is read as a model."""

from __future__ import annotations

from collections.abc import Iterator

from language.expressions.parser import parse_balance, parse_expression
from language.expressions.syntax_tree import Arithmetic, ErrorNode, FunctionCall, SyntaxTree
from language.expressions.text_rewrite import names_in_text
from language.expressions.units import SECOND, Dimension, UnitError, dimension_product, parse_unit
from language.text.diagnostic import Problems, SpecError
from language.text.document import MappingNode, ScalarNode, SequenceNode
from language.typecheck.infer import TypeChecker
from language.typecheck.name_environment import NameEnvironment
from language.typecheck.types import EnumType, ExprType, IntType


def mode_and_template_mappings(tree: MappingNode) -> Iterator[MappingNode]:
    """Yield the mappings of all modes and templates of a tree, at any depth, outer ones first.

    Modes and templates at the root come before those in regions of the root; regions inside modes
    are searched, too. Regions themselves are not yielded.
    """
    for key in ("modes", "templates"):
        for entry in _child_mappings(tree.get(key)):
            yield entry
            yield from mode_and_template_mappings(entry)
    for region in _child_mappings(tree.get("regions")):
        yield from mode_and_template_mappings(region)


def formula_entries(tree: MappingNode, section: str) -> Iterator[tuple[str, ScalarNode]]:
    """Yield name and scalar of a section (`equations`, `flow`) of the root, then of every mode.

    Templates count as modes. Entries that are no scalars are left out; a name may occur several
    times.
    """
    for owner in (tree, *mode_and_template_mappings(tree)):
        table = owner.get(section)
        for entry in table if isinstance(table, MappingNode) else ():
            if isinstance(entry.node, ScalarNode):
                yield entry.key, entry.node


class TreeTypes:
    """The types of parameters, inputs, states, discrete variables and equations of a tree."""

    def __init__(self, tree: MappingNode) -> None:
        """Read the declarations; the types of equations are inferred on request and cached.

        A name that is declared twice has the last of inputs, states, discrete variables and
        parameters.
        """
        self.tree = tree
        self.types: dict[str, ExprType | None] = {}
        self.equations: dict[str, list[ScalarNode]] = {}
        for name, scalar in formula_entries(tree, "equations"):
            self.equations.setdefault(name, []).append(scalar)
        for section in ("inputs", "states", "discrete", "parameters"):
            for name, table in _named_mappings(tree.get(section)):
                self.types[name] = self._declared_type(table)

    def type_of_name(self, name: str) -> ExprType | None:
        """Return the type of a name, or None if it is unknown, cyclic or cannot be inferred.

        Without `unit` and `type` a declaration has the type of its value, or that of a pure number.
        Of several formulas of an equation, the first with a dimension that is no pure number is
        preferred, else the first with a type.
        """
        if name not in self.types:
            self.types[name] = None
            kinds = (self.type_of_formula(scalar) for scalar in self.equations.get(name, ()))
            usable = [kind for kind in kinds if kind is not None]
            exact = [kind for kind in usable if isinstance(kind, Dimension) and not kind.is_number]
            self.types[name] = next(iter(exact or usable), None)
        return self.types[name]

    def type_of_formula(self, scalar: ScalarNode) -> ExprType | None:
        """Return the type of an expression, or None if it cannot be parsed or inferred.

        Problems are discarded.
        """
        try:
            return self._infer_tree(parse_expression(scalar), scalar.text)
        except SpecError:
            return None

    def balance_dimension(self, state: str, balance: ScalarNode) -> Dimension | None:
        """Return the dimension of the left side of the balance of a state, or None if unknown.

        The left side must be `der(x)` or a product of one factor and `der(x)`; that x is `state` is
        not checked. `der(x)` has the dimension of the state per second, and alone the angle of the
        state. The result is None if the balance cannot be parsed, for another left side, if the
        state is not real, and if the dimension of the factor is not known. Problems are discarded.
        """
        try:
            left, _ = parse_balance(balance)
        except SpecError:
            return None
        kind = self.type_of_name(state)
        if not isinstance(kind, Dimension):
            return None
        rate = dimension_product(kind, SECOND, -1)
        coefficient = _derivative_coefficient(left)
        if coefficient is None:
            return Dimension(rate.powers, kind.angle)
        factor = self._infer_tree(coefficient, balance.text)
        return dimension_product(factor, rate) if isinstance(factor, Dimension) else None

    def _infer_tree(self, tree: SyntaxTree, text: str) -> ExprType | None:
        """Return the inferred type of an expression; problems are discarded."""
        scope = NameEnvironment({name: self.type_of_name(name) for name in names_in_text(text)})
        return TypeChecker(scope, Problems()).infer_type(tree)

    def _declared_type(self, table: MappingNode) -> ExprType | None:
        """Return the type that a declaration gives.

        Without `type` and `unit` it is the type of the value, or a number.
        """
        kind = table.get("type")
        if isinstance(kind, ScalarNode) and kind.text == "bool":
            return "truth"
        if isinstance(kind, ScalarNode) and kind.text == "int":
            return IntType()
        names = table.get("values")
        if isinstance(kind, ScalarNode) and kind.text == "enum" and isinstance(names, SequenceNode):
            return EnumType(tuple(n.text for n in names.nodes if isinstance(n, ScalarNode)))
        unit, value = table.get("unit"), table.get("value")
        if isinstance(unit, ScalarNode):
            return dimension_of_unit(unit.text)
        return self.type_of_formula(value) if isinstance(value, ScalarNode) else Dimension()


def dimension_of_unit(text: str) -> Dimension | None:
    """Return the dimension of the text of a unit, or None if it is no unit."""
    try:
        return parse_unit(text).dimension
    except UnitError:
        return None


def format_si_unit(dimension: Dimension) -> str:
    """Return the SI unit of a dimension as a spec writes it; an undefined angle counts as 0."""
    return Dimension(dimension.powers, dimension.angle or 0).display_name


def format_rate_unit(quantity: Dimension, rate: Dimension) -> str:
    """Return the SI unit of the rate of a quantity: `N*m/s` and not `W` for that of a torque.

    `rate` is the dimension of the rate. It gives the text if the unit of the quantity is a quotient
    or 1.
    """
    text = format_si_unit(quantity)
    return format_si_unit(rate) if text == "1" or "/" in text else f"{text}/s"


def _derivative_coefficient(left: SyntaxTree) -> SyntaxTree | None:
    """Return the factor of der(x) in the left side of a balance; None for der(x) alone.

    Another form gives an ErrorNode.
    """
    match left:
        case Arithmetic("*", FunctionCall("der", _, _), other, _):
            return other
        case Arithmetic("*", other, FunctionCall("der", _, _), _):
            return other
        case FunctionCall("der", _, _):
            return None
        case _:
            return ErrorNode(left.span)


def _child_mappings(node: object) -> Iterator[MappingNode]:
    """Yield the values of a mapping that are mappings; nothing for another node."""
    for _, table in _named_mappings(node):
        yield table


def _named_mappings(node: object) -> Iterator[tuple[str, MappingNode]]:
    """Yield key and value for the values of a mapping that are mappings."""
    for entry in node if isinstance(node, MappingNode) else ():
        if isinstance(entry.node, MappingNode):
            yield entry.key, entry.node
