"""Check: names, dimensions, order and completeness of a read automaton, all problems at once."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping

from language.chart_target import mode_paths
from language.check_action import check_assignments, check_ways
from language.check_balance import check_balances, check_flow
from language.check_chart import check_chart
from language.check_cycle import report_refiring
from language.check_domain import check_domains
from language.check_element import check_laid_on
from language.check_memory import check_memory
from language.check_number import check_ranges
from language.check_observer import check_observer
from language.check_reached import check_reached
from language.check_region import check_regions
from language.check_rewind import check_reach
from language.check_size import check_size
from language.check_truth_table import check_truth_tables
from language.check_unused import check_unused
from language.check_writer import (
    check_outputs,
    check_scaled,
    check_writers,
)
from language.declaration import Formula, LookupTable
from language.declared import declared_names
from language.dimension import DimensionCheck
from language.guards import report_overlaps
from language.inquiry import Inquiry
from language.kind import Enumeration, Kind, Whole
from language.model import CHART, Automaton, Mode
from language.order import equation_order, report_circle
from language.problem import Problems
from language.region import sources, with_regions
from language.scope import Scope
from language.syntax import KEPT, Tree, whole_literal
from language.units import Dimension, Unit, common, fits, shown_unit
from language.wait import check_tunable_waits

WHOLES = (Whole, Enumeration)


def check_automaton(automaton: Automaton, problems: Problems) -> Automaton:
    """Return a read automaton with the dimensions of its names. Raises SpecError.

    All problems are reported, with those that `problems` holds already.
    """
    if automaton.model:
        automaton = dataclasses.replace(automaton, model=_declared(automaton.model, problems))
    checked = _declared(automaton, problems)
    check_ranges(checked, problems)
    problems.stop_if_any()
    check_memory(checked, problems)
    check_tunable_waits(checked, problems)
    check_reach(checked, problems)
    check_domains(checked, problems)
    problems.stop_if_any()
    check_reached(checked, problems)
    report_overlaps(checked, Inquiry(checked), problems)
    report_refiring(checked, problems)
    if checked.model:
        check_automaton(checked.model, problems)
    problems.stop_if_any()
    check_unused(checked, problems)
    return checked


def _declared(automaton: Automaton, problems: Problems) -> Automaton:
    return _Check(automaton, problems).run()


class _Check:
    """One method per rule; the names known at each place are the scopes."""

    def __init__(self, automaton: Automaton, problems: Problems) -> None:
        self.automaton = automaton
        self.problems = problems
        self.names: dict[str, Kind] = {}
        self.literals: dict[str, Kind] = {}
        self.bare: dict[str, bool] = {}
        modes = reversed(tuple(automaton.modes.values()))
        self.owners = {name: mode.name for mode in modes for name in sources(mode)}

    def run(self) -> Automaton:
        automaton = self.automaton
        self.names, self.literals = declared_names(automaton, self.problems)
        self._parameters()
        self._initials()
        check_size(automaton, self.problems)
        check_regions(automaton, self.problems)
        check_chart(automaton, self.problems)
        for mode in automaton.modes.values():
            with self.problems.collecting():
                self._mode(mode)
        for region in automaton.regions:
            for mode in region.modes.values():
                with self.problems.collecting():
                    self._beside(mode)
        for mode in automaton.superstates:
            with self.problems.collecting():
                self._beside(mode)
        with self.problems.collecting():
            check = self._everywhere("in every mode of the chart, for a table")
            check_truth_tables(automaton, check, self.problems)
        check_outputs(automaton, self.problems)
        check_laid_on(automaton, self.names, self.problems)
        check_scaled(automaton, self.problems)
        known = {name: kind for name, kind in self.names.items() if isinstance(kind, Dimension)}
        regions = tuple(
            dataclasses.replace(region, modes=self._all_with_wholes(region.modes))
            for region in automaton.regions
        )
        return dataclasses.replace(
            automaton,
            modes=with_regions(self._all_with_wholes(automaton.modes), regions),
            regions=regions,
            dimensions=known,
            kinds=self.names,
        )

    def _all_with_wholes(self, modes: Mapping[str, Mode]) -> dict[str, Mode]:
        return {name: self._with_wholes(mode) for name, mode in modes.items()}

    def _with_wholes(self, mode: Mode) -> Mode:
        """Mark the equations whose value is a whole number, in whatever mode it is given so."""
        marked = {
            name: dataclasses.replace(formula, whole=True)
            for name, formula in mode.equations.items()
            if isinstance(self.names.get(name), WHOLES)
        }
        return dataclasses.replace(mode, equations={**mode.equations, **marked})

    def _scope(self, groups: Iterable[Iterable[str]], place: str) -> Scope:
        known = {name: self.names[name] for group in groups for name in group}
        known = {**self.literals, **known}
        return Scope(known, frozenset(), place, self._angles(), frozenset(), self._tables())

    def _kept(self) -> frozenset[str]:
        """Return the functions with memory that are for every expression of a mode."""
        return frozenset(KEPT if self.automaton.is_sampled else ("delay",))

    def _tables(self) -> dict[str, LookupTable]:
        declared = self.automaton.parameters.items()
        return {name: thing.table for name, thing in declared if thing.table}

    def _angles(self) -> dict[str, Unit]:
        """Return the units of the parameters whose value is declared in a unit of angle."""
        declared = self.automaton.parameters.items()
        return {name: thing.unit for name, thing in declared if thing.unit.dimension.angle}

    def _parameters(self) -> None:
        automaton = self.automaton
        scope = self._scope([automaton.parameters], "among the parameters")
        check = DimensionCheck(scope, self.problems)
        trees: dict[str, Tree] = {}
        for parameter in automaton.parameters.values():
            if parameter.derived and parameter.name not in _of_model(automaton):
                trees[parameter.name] = parameter.derived.tree
                what = f"the unit of {parameter.name}"
                check.quantity(parameter.derived.tree, parameter.unit.dimension, what)
        spans = {name: thing.span for name, thing in automaton.parameters.items()}
        report_circle(trees, spans, "derived", self.problems)

    def _initials(self) -> None:
        automaton = self.automaton
        groups = [automaton.parameters, automaton.inputs, automaton.carried]
        check = DimensionCheck(self._scope(groups, "where a state starts"), self.problems)
        for state in automaton.carried.values():
            check.assigned(state.initial.tree, self.names[state.name], state.name)
        trees = {name: state.initial.tree for name, state in automaton.carried.items()}
        spans = {name: state.span for name, state in automaton.carried.items()}
        report_circle(trees, spans, "initial", self.problems)

    def _mode(self, mode: Mode) -> None:
        automaton = self.automaton
        groups = [automaton.parameters, automaton.inputs, automaton.carried]
        known = dict(self._scope(groups, "").names)
        place = "here"
        run = mode.run
        modes = _mode_paths(automaton)
        if run and automaton.model:
            modes |= {f"{automaton.model.name}.{name}" for name in automaton.model.modes}
            modes |= {f"{automaton.model.name}.{path}" for path in _mode_paths(automaton.model)}
        formulas = sources(mode)
        kept, owners = self._kept(), self.owners
        scope = Scope(known, modes, place, self._angles(), kept, self._tables(), mode.name, owners)
        scope = dataclasses.replace(scope, events=_events(automaton))
        check = DimensionCheck(scope, self.problems)
        for name in equation_order(mode):
            for formula in formulas[name]:
                kind = check.kind(formula.tree)
                agreed = self._agreed(name, kind, formula)
                known[name] = kind if isinstance(kind, Whole) else agreed
        check_flow(automaton, mode, check)
        for assignments in (mode.update, mode.entry, mode.exit):
            check_assignments(automaton, assignments, check, self.problems)
        self._ways(mode, check)
        if mode.observer:
            plain = DimensionCheck(dataclasses.replace(scope, memory=frozenset()), self.problems)
            check_observer(automaton, mode.observer, self.names, plain)
        check_writers(automaton, mode, self.problems)

    def _everywhere(self, place: str, beside: Iterable[Mode] = ()) -> DimensionCheck:
        """What is beside the chart reads what every mode of it, or each of some of them, has."""
        automaton = self.automaton
        groups = [automaton.parameters, automaton.inputs, automaton.carried]
        known = dict(self._scope(groups, "").names)
        modes = [sources(other) for other in beside or automaton.modes.values()]
        everywhere = [name for name in modes[0] if all(name in other for other in modes)]
        known.update({name: self.names.get(name) for name in everywhere})
        scope = Scope(
            known, _mode_paths(automaton), place, self._angles(), self._kept(), self._tables()
        )
        scope = dataclasses.replace(scope, events=_events(automaton))
        return DimensionCheck(scope, self.problems)

    def _beside(self, mode: Mode) -> None:
        automaton = self.automaton
        place = f"beside every mode of the chart, in region `{mode.region}`"
        if automaton.tree:
            place = f"in every mode of the chart that is active with `{mode.name}`"
        check = self._everywhere(place, self._with(mode))
        check_balances(automaton, mode, check)
        for assignments in (mode.update, mode.entry, mode.exit):
            check_assignments(automaton, assignments, check, self.problems)
        self._ways(mode, check)
        check_writers(automaton, mode, self.problems)

    def _with(self, mode: Mode) -> list[Mode]:
        """Return the modes of the chart that may be active together with another."""
        automaton = self.automaton
        found = list(automaton.modes.values())
        if automaton.tree:
            chart = automaton.tree
            node = next(node for node in chart.nodes if node.mode == mode.key)
            leaves = [n for n in chart.leaves(CHART) if chart.nested(n.index, node.index)]
            found = [automaton.by_key[leaf.mode] for leaf in leaves] or found
        return found

    def _ways(self, mode: Mode, check: DimensionCheck) -> None:
        parameters = self._scope([self.automaton.parameters], "in `wait`: it is a fixed time")
        constant = DimensionCheck(parameters, self.problems)
        check_ways(self.automaton, mode, check, constant, self.problems)

    def _agreed(self, name: str, kind: Kind | None, formula: Formula) -> Kind | None:
        """Return what a name is, and report where two modes disagree on it."""
        before = self.names.get(name)
        if kind is None:
            return before
        if before is None or getattr(formula.tree, "is_bare_zero", False):
            self.names.setdefault(name, kind)
            self.bare.setdefault(name, getattr(formula.tree, "is_bare_zero", False))
            return self.names[name]
        if self.bare.get(name):
            self.names[name], self.bare[name] = kind, False
            return kind
        if isinstance(before, Dimension) and isinstance(kind, Dimension):
            if fits(before, kind):
                self.names[name] = common(before, kind)
                return self.names[name]
        elif before == kind:
            return before
        if isinstance(before, Whole) and isinstance(kind, Whole):
            self.names[name] = before.joined(kind)
            return self.names[name]
        number = whole_literal(formula.tree)
        if isinstance(before, Whole) and number is not None:
            self.names[name] = before.joined(Whole(number, number))
            return self.names[name]
        here, there = (shown_unit(str(each)) for each in (kind, before))
        label = f"`{name}` is in `{here}` here and in `{there}` in another mode"
        self.problems.error("dimension", formula.span, label)
        return before


def _of_model(automaton: Automaton) -> Mapping[str, object]:
    return automaton.model.parameters if automaton.model else {}


def _events(automaton: Automaton) -> frozenset[str]:
    return frozenset(automaton.tree.signals if automaton.tree else ())


def _mode_paths(automaton: Automaton) -> frozenset[str]:
    """Return the modes that `in` may name: of parallel regions, by region and mode."""
    if automaton.tree:
        return frozenset(mode_paths(automaton.tree))
    if not automaton.regions:
        return frozenset()
    return frozenset(f"{m.region}.{m.name}" for m in automaton.all_modes)
