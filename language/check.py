"""Check: names, dimensions, order and completeness of a read automaton, all problems at once."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping

from language.chart_target import mode_paths
from language.check_action import check_assignments, check_mode_transitions
from language.check_balance import check_balances, check_flow
from language.check_chart import check_chart
from language.check_cycle import report_refiring
from language.check_domain import check_domains
from language.check_element import check_elements
from language.check_memory import check_memory
from language.check_number import check_ranges
from language.check_observer import check_observer
from language.check_reached import check_reachability
from language.check_region import check_regions
from language.check_rewind import check_rewind_depth
from language.check_size import check_size
from language.check_truth_table import check_truth_tables
from language.check_unused import check_unused
from language.check_writer import (
    check_outputs,
    check_scaling_ranges,
    check_writers,
)
from language.declaration import Formula, LookupTable
from language.declared import declared_names
from language.dimension import TypeChecker
from language.guards import report_overlaps
from language.inquiry import QueryEngine
from language.kind import EnumType, ExprType, IntType
from language.model import CHART, Automaton, Mode
from language.order import equation_order, report_cycle
from language.problem import Problems
from language.region import attach_regions, equation_formulas
from language.scope import NameEnvironment
from language.syntax import DELAY_FUNCTIONS, SyntaxTree, integer_literal
from language.units import Dimension, Unit, are_compatible, common_dimension, display_unit
from language.wait import check_tunable_waits

WHOLE_KINDS = (IntType, EnumType)


def check_automaton(automaton: Automaton, problems: Problems) -> Automaton:
    """Return a read automaton with the dimensions of its names. Raises SpecError.

    All problems are reported, with those that `problems` holds already.
    """
    if automaton.model:
        automaton = dataclasses.replace(
            automaton, model=_check_declarations(automaton.model, problems)
        )
    checked = _check_declarations(automaton, problems)
    check_ranges(checked, problems)
    problems.raise_if_errors()
    check_memory(checked, problems)
    check_tunable_waits(checked, problems)
    check_rewind_depth(checked, problems)
    check_domains(checked, problems)
    problems.raise_if_errors()
    check_reachability(checked, problems)
    report_overlaps(checked, QueryEngine(checked), problems)
    report_refiring(checked, problems)
    if checked.model:
        check_automaton(checked.model, problems)
    problems.raise_if_errors()
    check_unused(checked, problems)
    return checked


def _check_declarations(automaton: Automaton, problems: Problems) -> Automaton:
    return _AutomatonChecker(automaton, problems).run()


class _AutomatonChecker:
    """One method per rule; the names known at each place are the scopes."""

    def __init__(self, automaton: Automaton, problems: Problems) -> None:
        self.automaton = automaton
        self.problems = problems
        self.kinds: dict[str, ExprType] = {}
        self.literal_kinds: dict[str, ExprType] = {}
        self.is_bare_zero: dict[str, bool] = {}
        modes = reversed(tuple(automaton.modes.values()))
        self.equation_owners = {
            name: mode.name for mode in modes for name in equation_formulas(mode)
        }

    def run(self) -> Automaton:
        automaton = self.automaton
        self.kinds, self.literal_kinds = declared_names(automaton, self.problems)
        self._check_parameters()
        self._check_initial_values()
        check_size(automaton, self.problems)
        check_regions(automaton, self.problems)
        check_chart(automaton, self.problems)
        for mode in automaton.modes.values():
            with self.problems.collect_errors():
                self._check_mode(mode)
        for region in automaton.regions:
            for mode in region.modes.values():
                with self.problems.collect_errors():
                    self._check_parallel_mode(mode)
        for mode in automaton.superstates:
            with self.problems.collect_errors():
                self._check_parallel_mode(mode)
        with self.problems.collect_errors():
            check = self._common_equations_check("in every mode of the chart, for a table")
            check_truth_tables(automaton, check, self.problems)
        check_outputs(automaton, self.problems)
        check_elements(automaton, self.kinds, self.problems)
        check_scaling_ranges(automaton, self.problems)
        known = {name: kind for name, kind in self.kinds.items() if isinstance(kind, Dimension)}
        regions = tuple(
            dataclasses.replace(region, modes=self._mark_whole_modes(region.modes))
            for region in automaton.regions
        )
        return dataclasses.replace(
            automaton,
            modes=attach_regions(self._mark_whole_modes(automaton.modes), regions),
            regions=regions,
            dimensions=known,
            name_types=self.kinds,
        )

    def _mark_whole_modes(self, modes: Mapping[str, Mode]) -> dict[str, Mode]:
        return {name: self._mark_whole_equations(mode) for name, mode in modes.items()}

    def _mark_whole_equations(self, mode: Mode) -> Mode:
        """Mark the equations whose value is a whole number, in whatever mode it is given so."""
        marked = {
            name: dataclasses.replace(formula, is_integer=True)
            for name, formula in mode.equations.items()
            if isinstance(self.kinds.get(name), WHOLE_KINDS)
        }
        return dataclasses.replace(mode, equations={**mode.equations, **marked})

    def _scope(self, groups: Iterable[Iterable[str]], place: str) -> NameEnvironment:
        known = {name: self.kinds[name] for group in groups for name in group}
        known = {**self.literal_kinds, **known}
        return NameEnvironment(
            known, frozenset(), place, self._angle_units(), frozenset(), self._lookup_tables()
        )

    def _memory_functions(self) -> frozenset[str]:
        """Return the functions with memory that are for every expression of a mode."""
        return frozenset(DELAY_FUNCTIONS if self.automaton.is_sampled else ("delay",))

    def _lookup_tables(self) -> dict[str, LookupTable]:
        declared = self.automaton.parameters.items()
        return {name: thing.table for name, thing in declared if thing.table}

    def _angle_units(self) -> dict[str, Unit]:
        """Return the units of the parameters whose value is declared in a unit of angle."""
        declared = self.automaton.parameters.items()
        return {name: thing.unit for name, thing in declared if thing.unit.dimension.angle}

    def _check_parameters(self) -> None:
        automaton = self.automaton
        scope = self._scope([automaton.parameters], "among the parameters")
        check = TypeChecker(scope, self.problems)
        trees: dict[str, SyntaxTree] = {}
        for parameter in automaton.parameters.values():
            if parameter.derived and parameter.name not in _model_parameters(automaton):
                trees[parameter.name] = parameter.derived.tree
                what = f"the unit of {parameter.name}"
                check.check_quantity(parameter.derived.tree, parameter.unit.dimension, what)
        spans = {name: thing.span for name, thing in automaton.parameters.items()}
        report_cycle(trees, spans, "derived", self.problems)

    def _check_initial_values(self) -> None:
        automaton = self.automaton
        groups = [automaton.parameters, automaton.inputs, automaton.state_variables]
        check = TypeChecker(self._scope(groups, "where a state starts"), self.problems)
        for state in automaton.state_variables.values():
            check.check_assignment(state.initial.tree, self.kinds[state.name], state.name)
        trees = {name: state.initial.tree for name, state in automaton.state_variables.items()}
        spans = {name: state.span for name, state in automaton.state_variables.items()}
        report_cycle(trees, spans, "initial", self.problems)

    def _check_mode(self, mode: Mode) -> None:
        automaton = self.automaton
        groups = [automaton.parameters, automaton.inputs, automaton.state_variables]
        known = dict(self._scope(groups, "").types)
        place = "here"
        run = mode.run
        modes = _mode_paths(automaton)
        if run and automaton.model:
            modes |= {f"{automaton.model.name}.{name}" for name in automaton.model.modes}
            modes |= {f"{automaton.model.name}.{path}" for path in _mode_paths(automaton.model)}
        formulas = equation_formulas(mode)
        kept, owners = self._memory_functions(), self.equation_owners
        scope = NameEnvironment(
            known, modes, place, self._angle_units(), kept, self._lookup_tables(), mode.name, owners
        )
        scope = dataclasses.replace(scope, events=_event_names(automaton))
        check = TypeChecker(scope, self.problems)
        for name in equation_order(mode):
            for formula in formulas[name]:
                kind = check.infer_type(formula.tree)
                agreed = self._merge_kinds(name, kind, formula)
                known[name] = kind if isinstance(kind, IntType) else agreed
        check_flow(automaton, mode, check)
        for assignments in (mode.update, mode.entry, mode.exit):
            check_assignments(automaton, assignments, check, self.problems)
        self._check_transitions(mode, check)
        if mode.observer:
            plain = TypeChecker(
                dataclasses.replace(scope, memory_functions=frozenset()), self.problems
            )
            check_observer(automaton, mode.observer, self.kinds, plain)
        check_writers(automaton, mode, self.problems)

    def _common_equations_check(self, place: str, active_modes: Iterable[Mode] = ()) -> TypeChecker:
        """What is beside the chart reads what every mode of it, or each of some of them, has."""
        automaton = self.automaton
        groups = [automaton.parameters, automaton.inputs, automaton.state_variables]
        known = dict(self._scope(groups, "").types)
        modes = [equation_formulas(other) for other in active_modes or automaton.modes.values()]
        everywhere = [name for name in modes[0] if all(name in other for other in modes)]
        known.update({name: self.kinds.get(name) for name in everywhere})
        scope = NameEnvironment(
            known,
            _mode_paths(automaton),
            place,
            self._angle_units(),
            self._memory_functions(),
            self._lookup_tables(),
        )
        scope = dataclasses.replace(scope, events=_event_names(automaton))
        return TypeChecker(scope, self.problems)

    def _check_parallel_mode(self, mode: Mode) -> None:
        automaton = self.automaton
        place = f"beside every mode of the chart, in region `{mode.region}`"
        if automaton.statechart:
            place = f"in every mode of the chart that is active with `{mode.name}`"
        check = self._common_equations_check(place, self._concurrent_modes(mode))
        check_balances(automaton, mode, check)
        for assignments in (mode.update, mode.entry, mode.exit):
            check_assignments(automaton, assignments, check, self.problems)
        self._check_transitions(mode, check)
        check_writers(automaton, mode, self.problems)

    def _concurrent_modes(self, mode: Mode) -> list[Mode]:
        """Return the modes of the chart that may be active together with another."""
        automaton = self.automaton
        found = list(automaton.modes.values())
        if automaton.statechart:
            chart = automaton.statechart
            node = next(node for node in chart.nodes if node.mode_key == mode.key)
            leaves = [n for n in chart.leaves(CHART) if chart.are_nested(n.index, node.index)]
            found = [automaton.modes_by_key[leaf.mode_key] for leaf in leaves] or found
        return found

    def _check_transitions(self, mode: Mode, check: TypeChecker) -> None:
        parameters = self._scope([self.automaton.parameters], "in `wait`: it is a fixed time")
        constant = TypeChecker(parameters, self.problems)
        check_mode_transitions(self.automaton, mode, check, constant, self.problems)

    def _merge_kinds(self, name: str, kind: ExprType | None, formula: Formula) -> ExprType | None:
        """Return what a name is, and report where two modes disagree on it."""
        before = self.kinds.get(name)
        if kind is None:
            return before
        if before is None or getattr(formula.tree, "is_bare_zero", False):
            self.kinds.setdefault(name, kind)
            self.is_bare_zero.setdefault(name, getattr(formula.tree, "is_bare_zero", False))
            return self.kinds[name]
        if self.is_bare_zero.get(name):
            self.kinds[name], self.is_bare_zero[name] = kind, False
            return kind
        if isinstance(before, Dimension) and isinstance(kind, Dimension):
            if are_compatible(before, kind):
                self.kinds[name] = common_dimension(before, kind)
                return self.kinds[name]
        elif before == kind:
            return before
        if isinstance(before, IntType) and isinstance(kind, IntType):
            self.kinds[name] = before.hull(kind)
            return self.kinds[name]
        number = integer_literal(formula.tree)
        if isinstance(before, IntType) and number is not None:
            self.kinds[name] = before.hull(IntType(number, number))
            return self.kinds[name]
        here, there = (display_unit(str(each)) for each in (kind, before))
        label = f"`{name}` is in `{here}` here and in `{there}` in another mode"
        self.problems.error("dimension", formula.span, label)
        return before


def _model_parameters(automaton: Automaton) -> Mapping[str, object]:
    return automaton.model.parameters if automaton.model else {}


def _event_names(automaton: Automaton) -> frozenset[str]:
    return frozenset(automaton.statechart.events if automaton.statechart else ())


def _mode_paths(automaton: Automaton) -> frozenset[str]:
    """Return the modes that `in` may name: of parallel regions, by region and mode."""
    if automaton.statechart:
        return frozenset(mode_paths(automaton.statechart))
    if not automaton.regions:
        return frozenset()
    return frozenset(f"{m.region}.{m.name}" for m in automaton.all_modes)
