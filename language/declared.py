"""Declared: the kinds of value that declarations say, and each name once."""

from __future__ import annotations

from language.check_writer import equations_of
from language.declaration import Input, Parameter, State
from language.experiment import SystemInput
from language.kind import Enumeration, Kind, Whole
from language.model import Automaton
from language.names import report_case_twins
from language.problem import Problems, Span

RESERVED = ("mode", "faults")


def declared_kind(thing: Parameter | Input | State | SystemInput) -> Kind:
    """Return the kind that a declaration says; a whole number lies in its range."""
    if thing.type == "bool":
        return "truth"
    if thing.type == "enum":
        return Enumeration(thing.values)
    if thing.type == "int":
        if isinstance(thing, Parameter) and thing.kind == "fixed" and thing.value is not None:
            return Whole(int(thing.value), int(thing.value))
        limits = getattr(thing, "range", None)
        return Whole(int(limits[0]), int(limits[1])) if limits else Whole()
    return thing.unit.dimension


def declared_names(
    automaton: Automaton, problems: Problems
) -> tuple[dict[str, Kind], dict[str, Kind]]:
    """Return the kinds of all names that are declared, and of the names in enumerations."""
    declared = _Declared(automaton, problems)
    declared.declare()
    return declared.names, declared.literals


class _Declared:
    """What was declared so far, and where each name was given first."""

    def __init__(self, automaton: Automaton, problems: Problems) -> None:
        self.automaton = automaton
        self.problems = problems
        self.names: dict[str, Kind] = {}
        self.literals: dict[str, Kind] = {}
        self.first: dict[str, Span] = {}

    def declare(self) -> None:
        automaton = self.automaton
        groups = (automaton.parameters, automaton.inputs, automaton.carried)
        for group in groups:
            for name, thing in group.items():
                self._new(name, declared_kind(thing), thing.span)
        for group in groups:
            for thing in group.values():
                if thing.values:
                    self._literals(thing)
        for name in equations_of(automaton.all_modes):
            for mode in automaton.all_modes:
                if name in mode.equations:
                    self._clash(name, mode.equations[name].span)
                    break
        for region in automaton.regions:
            self._clash(region.name, region.span)
        self._case_twins()

    def _case_twins(self) -> None:
        automaton = self.automaton
        named = list(self.first.items())
        for mode in automaton.all_modes:
            named += [(name, formula.span) for name, formula in mode.equations.items()]
        report_case_twins(named, self.problems)
        report_case_twins([(m.name, m.span) for m in automaton.all_modes], self.problems)

    def _new(self, name: str, kind: Kind, span: Span) -> None:
        self._clash(name, span)
        self.names[name] = kind
        self.first.setdefault(name, span)

    def _literals(self, thing: Parameter | Input | State) -> None:
        """The names of an enumeration are known; two that share a name have the same list."""
        kind = Enumeration(thing.values)
        for value in thing.values:
            known = self.names.get(value)
            if known is None:
                self.names[value] = kind
                self.first[value] = thing.span
                self.literals[value] = kind
            elif known != kind or value not in self.literals:
                self._clash(value, thing.span)

    def _clash(self, name: str, span: Span) -> None:
        if name in self.first:
            hint = f"it is given first at {self.first[name]}"
            self.problems.error(
                "duplicate", span, f"`{name}` is already the name of something", hint
            )
        elif name in RESERVED:
            self.problems.error("name", span, f"`{name}` is a word of the language")
