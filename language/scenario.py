"""Scenario reader: inputs over time, start values and horizon for a system."""

from __future__ import annotations

from fractions import Fraction

from language.document import Document, Entry, Node, Scalar, Table
from language.model import Scenario, Stimulus, System
from language.problem import Problems, Span, SpecError, nearest
from language.project import Project, expanded
from language.reader import Reader
from language.syntax import Arithmetic, Negative, Number, Tree
from language.units import SECOND, Dimension, Unit, common, fits, product

SCENARIO_KEYS = ("language", "scenario", "of", "horizon", "initial", "inputs", "record")
INPUT_KEYS = ("start", "steps")
MAX_HORIZON = Fraction(86400)
"""Longest horizon: a day; longer is a mistake of the unit."""


def read_scenario(document: Document, project: Project, system: System) -> Scenario:
    """Read a scenario for a system. Raises SpecError with all problems."""
    document = expanded(document, project)
    problems = Problems()
    if document.kind != "scenario":
        label = f"`{document.name}` is a {document.kind}, not a scenario"
        problems.error("form", document.name_span, label)
    problems.stop_if_any()
    scenario = _ScenarioReader(problems, system).read(document)
    problems.stop_if_any()
    return scenario


class _ScenarioReader(Reader):
    """The sections of a scenario, one method each."""

    def __init__(self, problems: Problems, system: System) -> None:
        super().__init__(problems)
        self.system = system

    def read(self, document: Document) -> Scenario:
        tree = self.table(document.root, f"scenario {document.name}", SCENARIO_KEYS)
        at = document.name_span
        horizon = self._time(tree.get("horizon"), "horizon", at)
        record = self.table(tree.get("record"), "record", ("every",))
        every_node = record.get("every")
        every = self._time(every_node, "every", at) if every_node else Fraction(1, 1000)
        if horizon > MAX_HORIZON:
            self.problems.error("range", at, "the horizon is longer than a day")
        return Scenario(
            name=document.name,
            of=self.text(tree.get("of"), "of", at),
            horizon=horizon,
            initial=self._initial(tree),
            inputs=self._inputs(tree, at),
            every=every,
            span=at,
        )

    def _time(self, node: Node | None, what: str, span: Span) -> Fraction:
        value, unit = self.quantity(node, what, span, None)
        if not fits(unit.dimension, SECOND) or value <= 0:
            if not self.problems.has_errors:
                place = node.span if node else span
                self.problems.error("range", place, f"`{what}` is a time above zero, like `2.5 s`")
            return Fraction(1)
        return value

    def _initial(self, tree: Table) -> dict[str, Fraction]:
        found = {}
        instances = self.system.instances
        known = [f"{i.name}.{s}" for i in instances.values() for s in i.automaton.states]
        for entry in self.table(tree.get("initial"), "initial"):
            owner, _, name = entry.key.partition(".")
            if entry.key not in known:
                label = f"`{entry.key}` is not a state of an instance of `{self.system.name}`"
                self.problems.error("name", entry.span, label, nearest(entry.key, known))
                continue
            wanted = instances[owner].automaton.states[name].unit
            formula = self.expression(entry.node, entry.key, entry.span)
            if formula:
                with self.problems.collecting():
                    found[entry.key] = self._constant(formula.tree, wanted)
        return found

    def _constant(self, tree: Tree, unit: Unit) -> Fraction:
        value, dimension = constant(tree)
        if not fits(dimension, unit.dimension) and not getattr(tree, "is_bare_zero", False):
            label = f"this is in `{dimension}`, the state is in `{unit.dimension}`"
            self.problems.error("dimension", tree.span, label)
        return value

    def _inputs(self, tree: Table, at: Span) -> dict[str, Stimulus]:
        found = {}
        known = self.system.inputs
        for entry in self.table(tree.get("inputs"), "inputs"):
            if entry.key not in known:
                label = f"`{entry.key}` is not an input of `{self.system.name}`"
                self.problems.error("name", entry.span, label, nearest(entry.key, known))
                continue
            found[entry.key] = self._stimulus(entry, known[entry.key].unit)
        for name, thing in known.items():
            if name not in found and thing.default is not None:
                found[name] = Stimulus(((Fraction(0), thing.default),))
            elif name not in found and not self.problems.has_errors:
                label = f"input `{name}` of `{self.system.name}` has no value in the scenario"
                self.problems.error("missing", at, label)
        return found

    def _stimulus(self, entry: Entry, unit: Unit) -> Stimulus:
        if isinstance(entry.node, Scalar):
            value, _ = self.quantity(entry.node, entry.key, entry.span, unit)
            return Stimulus(((Fraction(0), value),))
        table = self.table(entry.node, f"inputs.{entry.key}", INPUT_KEYS)
        start, _ = self.quantity(table.get("start"), "start", entry.span, unit)
        steps = [(Fraction(0), start)]
        for step in self.table(table.get("steps"), f"inputs.{entry.key}.steps"):
            time = self._time(Scalar(step.key, step.span), "the time of a step", step.span)
            value, _ = self.quantity(step.node, "step", step.span, unit)
            if time <= steps[-1][0]:
                self.problems.error("order", step.span, "steps are in the order of time")
            steps.append((time, value))
        return Stimulus(tuple(steps))


def constant(tree: Tree) -> tuple[Fraction, Dimension]:
    """Return an expression of literals exactly, with its dimension. Raises SpecError."""
    problems = Problems()
    match tree:
        case Number(value, unit, _):
            return value, unit.dimension
        case Negative(operand, _):
            value, dimension = constant(operand)
            return -value, dimension
        case Arithmetic(operator, left, right, span):
            (a, first), (b, second) = constant(left), constant(right)
            if operator in "*/":
                if operator == "/" and b == 0:
                    problems.error("value", span, "this divides by zero")
                    raise SpecError(problems.found)
                value = a * b if operator == "*" else a / b
                return value, product(first, second, 1 if operator == "*" else -1)
            if fits(first, second):
                return (a + b if operator == "+" else a - b), common(first, second)
            problems.error("dimension", span, f"`{operator}` joins `{first}` and `{second}`")
        case _:
            problems.error("constant", tree.span, "this is made of numbers with units only")
    raise SpecError(problems.found)
