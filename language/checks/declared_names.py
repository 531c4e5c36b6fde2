"""Declared names: collects the types of declarations and reports names that are used twice."""

from __future__ import annotations

from language.checks.check_single_writer import equation_names_of
from language.expressions.name_rules import check_variable_name, report_case_collisions
from language.model.automaton import Automaton
from language.model.declaration import Input, Parameter, State
from language.model.system import SystemInput
from language.text.diagnostic import Problems, Span
from language.typecheck.types import EnumType, ExprType, IntType

BUILTIN_NAMES = ("mode", "faults")
"""Names that the language defines."""


def declaration_type(declaration: Parameter | Input | State | SystemInput) -> ExprType:
    """Return the type of a declaration: truth, enumeration, integer interval or dimension.

    A fixed integer parameter has the interval of its value; other integers that of their range, or
    an interval without bounds. A real has the dimension of its unit.
    """
    if declaration.type == "bool":
        return "truth"
    if declaration.type == "enum":
        return EnumType(declaration.values)
    if declaration.type == "int":
        if (
            isinstance(declaration, Parameter)
            and declaration.kind == "fixed"
            and declaration.value is not None
        ):
            return IntType(int(declaration.value), int(declaration.value))
        limits = getattr(declaration, "range", None)
        return IntType(int(limits[0]), int(limits[1])) if limits else IntType()
    return declaration.unit.dimension


def collect_declared_names(
    automaton: Automaton, problems: Problems
) -> tuple[dict[str, ExprType], dict[str, ExprType]]:
    """Return the types of all declared names, and those of the values of enumerations.

    Names are parameters, inputs, states and discrete variables; the first result also has the
    values. Reported are names that are declared twice (also as an equation or region),
    BUILTIN_NAMES, words of the C library (also as an equation or output), names that differ in case
    only, and values that two enumerations with different lists share.
    """
    table = _DeclarationTable(automaton, problems)
    table.declare()
    return table.kinds, table.literal_kinds


class _DeclarationTable:
    """Types of the declared names and the place of the first declaration of each."""

    def __init__(self, automaton: Automaton, problems: Problems) -> None:
        self.automaton = automaton
        self.problems = problems
        self.kinds: dict[str, ExprType] = {}
        self.literal_kinds: dict[str, ExprType] = {}
        self.first_spans: dict[str, Span] = {}

    def declare(self) -> None:
        """Collect the declarations and report clashes with equations and regions."""
        automaton = self.automaton
        groups = (automaton.parameters, automaton.inputs, automaton.state_variables)
        for group in groups:
            for name, thing in group.items():
                self._declare_name(name, declaration_type(thing), thing.span)
        for group in groups:
            for thing in group.values():
                if thing.values:
                    self._declare_literals(thing)
        equations = equation_names_of(automaton.all_modes)
        for name in equations:
            for mode in automaton.all_modes:
                if name in mode.equations:
                    self._report_clash(name, mode.equations[name].span)
                    check_variable_name(name, mode.equations[name].span, self.problems)
                    break
        for name, span in automaton.outputs.items():
            if name not in self.first_spans and name not in equations:
                check_variable_name(name, span, self.problems)
        for region in automaton.regions:
            self._report_clash(region.name, region.span)
        self._report_case_collisions()

    def _report_case_collisions(self) -> None:
        """Report names, and modes, that differ in case only."""
        automaton = self.automaton
        named = list(self.first_spans.items())
        for mode in automaton.all_modes:
            named += [(name, formula.span) for name, formula in mode.equations.items()]
        report_case_collisions(named, self.problems)
        report_case_collisions([(m.name, m.span) for m in automaton.all_modes], self.problems)

    def _declare_name(self, name: str, kind: ExprType, span: Span) -> None:
        """Add a name with its type; report it if it exists already."""
        self._report_clash(name, span)
        check_variable_name(name, span, self.problems)
        self.kinds[name] = kind
        self.first_spans.setdefault(name, span)

    def _declare_literals(self, declaration: Parameter | Input | State) -> None:
        """Add the values of an enumeration.

        Two enumerations that share a value need equal lists.
        """
        kind = EnumType(declaration.values)
        for value in declaration.values:
            known = self.kinds.get(value)
            if known is None:
                self.kinds[value] = kind
                self.first_spans[value] = declaration.span
                self.literal_kinds[value] = kind
            elif known != kind or value not in self.literal_kinds:
                self._report_clash(value, declaration.span)

    def _report_clash(self, name: str, span: Span) -> None:
        """Report a name that is declared before or reserved."""
        if name in self.first_spans:
            hint = f"it is given first at {self.first_spans[name]}"
            self.problems.error(
                "duplicate", span, f"`{name}` is already the name of something", hint
            )
        elif name in BUILTIN_NAMES:
            self.problems.error("name", span, f"`{name}` is a word of the language")
