"""Known: dimensions of the names of an automaton's tree, before it is read as a model."""

from __future__ import annotations

from collections.abc import Iterator

from language.dimension import DimensionCheck
from language.document import Items, Scalar, Table
from language.kind import Enumeration, Kind, Whole
from language.parse import parse_balance, parse_expression
from language.problem import Problems, SpecError
from language.rewrite import reads
from language.scope import Scope
from language.syntax import Application, Arithmetic, Broken, Tree
from language.units import SECOND, Dimension, UnitError, parse_unit, product


def mode_tables(tree: Table) -> Iterator[Table]:
    """Yield the tables of all modes of an automaton's tree, those inside modes and regions too."""
    for key in ("modes", "templates"):
        for entry in _tables(tree.get(key)):
            yield entry
            yield from mode_tables(entry)
    for region in _tables(tree.get("regions")):
        yield from mode_tables(region)


def entries_of(tree: Table, section: str) -> Iterator[tuple[str, Scalar]]:
    """Yield the scalars of a section (`equations`, `flow`) at the root and in every mode."""
    for owner in (tree, *mode_tables(tree)):
        table = owner.get(section)
        for entry in table if isinstance(table, Table) else ():
            if isinstance(entry.node, Scalar):
                yield entry.key, entry.node


class Known:
    """The dimensions of parameters, inputs, states, discrete variables and equations."""

    def __init__(self, tree: Table) -> None:
        """Look at declarations; equations are looked at when they are asked for."""
        self.tree = tree
        self.kinds: dict[str, Kind | None] = {}
        self.equations: dict[str, list[Scalar]] = {}
        for name, scalar in entries_of(tree, "equations"):
            self.equations.setdefault(name, []).append(scalar)
        for section in ("inputs", "states", "discrete", "parameters"):
            for name, table in _named_tables(tree.get(section)):
                self.kinds[name] = self._declared(table)

    def kind(self, name: str) -> Kind | None:
        """Return what a name is; None where that cannot be told."""
        if name not in self.kinds:
            self.kinds[name] = None
            found = (self.of(scalar) for scalar in self.equations.get(name, ()))
            usable = [kind for kind in found if kind is not None]
            exact = [kind for kind in usable if isinstance(kind, Dimension) and not kind.is_number]
            self.kinds[name] = next(iter(exact or usable), None)
        return self.kinds[name]

    def of(self, scalar: Scalar) -> Kind | None:
        """Return what an expression is; None where that cannot be told."""
        try:
            return self._of_tree(parse_expression(scalar), scalar.text)
        except SpecError:
            return None

    def force(self, state: str, balance: Scalar) -> Dimension | None:
        """Return the dimension of the sides of a balance."""
        try:
            left, _ = parse_balance(balance)
        except SpecError:
            return None
        kind = self.kind(state)
        if not isinstance(kind, Dimension):
            return None
        rate = product(kind, SECOND, -1)
        coefficient = _coefficient(left)
        if coefficient is None:
            return Dimension(rate.powers, kind.angle)
        factor = self._of_tree(coefficient, balance.text)
        return product(factor, rate) if isinstance(factor, Dimension) else None

    def _of_tree(self, tree: Tree, text: str) -> Kind | None:
        scope = Scope({name: self.kind(name) for name in reads(text)})
        return DimensionCheck(scope, Problems()).kind(tree)

    def _declared(self, table: Table) -> Kind | None:
        kind = table.get("type")
        if isinstance(kind, Scalar) and kind.text == "bool":
            return "truth"
        if isinstance(kind, Scalar) and kind.text == "int":
            return Whole()
        names = table.get("values")
        if isinstance(kind, Scalar) and kind.text == "enum" and isinstance(names, Items):
            return Enumeration(tuple(n.text for n in names.nodes if isinstance(n, Scalar)))
        unit, value = table.get("unit"), table.get("value")
        if isinstance(unit, Scalar):
            return unit_dimension(unit.text)
        return self.of(value) if isinstance(value, Scalar) else Dimension()


def unit_dimension(text: str) -> Dimension | None:
    """Return the dimension of a unit's text; None where it is no unit."""
    try:
        return parse_unit(text).dimension
    except UnitError:
        return None


def unit_text(dimension: Dimension) -> str:
    """Return the SI unit of a dimension as it is written in a spec."""
    return str(Dimension(dimension.powers, dimension.angle or 0))


def _coefficient(left: Tree) -> Tree | None:
    """Return the factor beside der(x), None where there is none."""
    match left:
        case Arithmetic("*", Application("der", _, _), other, _):
            return other
        case Arithmetic("*", other, Application("der", _, _), _):
            return other
        case Application("der", _, _):
            return None
        case _:
            return Broken(left.span)


def _tables(node: object) -> Iterator[Table]:
    for _, table in _named_tables(node):
        yield table


def _named_tables(node: object) -> Iterator[tuple[str, Table]]:
    for entry in node if isinstance(node, Table) else ():
        if isinstance(entry.node, Table):
            yield entry.key, entry.node
