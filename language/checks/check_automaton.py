"""Check of an automaton: names, dimensions, order and completeness, with all problems in one pass.

The input is the automaton that the reader built; the result has the types of all names. The other
modules of this package are called from here or from check_warnings.py.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping

from language.checks.check_action import check_assignments, check_mode_transitions
from language.checks.check_chart import check_chart
from language.checks.check_domain import check_domains
from language.checks.check_guard_overlap import check_guard_overlap
from language.checks.check_instant_cycles import check_short_cycles
from language.checks.check_number_range import check_ranges
from language.checks.check_observer import check_observer
from language.checks.check_reachability import check_reachability
from language.checks.check_region import check_regions
from language.checks.check_rewind import check_rewind_depth
from language.checks.check_single_writer import check_outputs, check_scaling_ranges, check_writers
from language.checks.check_stateful_functions import check_memory
from language.checks.check_truth_table import check_truth_tables
from language.checks.check_unused import check_unused
from language.checks.declared_names import collect_declared_names
from language.expressions.balance_form import coefficient_of
from language.expressions.syntax_tree import DELAY_FUNCTIONS, ErrorNode, SyntaxTree, integer_literal
from language.expressions.units import (
    SECOND,
    Dimension,
    Unit,
    are_compatible,
    common_dimension,
    dimension_product,
    display_unit,
)
from language.ir.root_region import CHART
from language.lowering.wait_ticks import check_tunable_waits
from language.model.automaton import Automaton, Mode
from language.model.chart_paths import mode_paths
from language.model.declaration import Formula
from language.model.evaluation_order import equation_order, report_cycle
from language.model.region_queries import attach_regions, equation_formulas
from language.smt.query_engine import QueryEngine
from language.text.diagnostic import Problems, SpecError, suggest_name
from language.typecheck.infer import TypeChecker
from language.typecheck.lookup_table import LookupTable
from language.typecheck.name_environment import NameEnvironment
from language.typecheck.types import EnumType, ExprType, IntType


def check_flow(automaton: Automaton, mode: Mode, check: TypeChecker) -> None:
    """Report states without a balance in a mode of a continuous automaton, then check its balances.

    A state that any mode of a parallel region balances needs none. A sampled automaton is skipped.
    `check` knows the names of the mode and holds the problems.
    """
    problems = check.problems
    if automaton.is_sampled:
        return
    beside = {
        balance.state
        for region in mode.parallel_regions
        for m in region.modes.values()
        for balance in m.flow.values()
    }
    for name, state in automaton.states.items():
        if name not in mode.flow and name not in beside:
            label = f"state `{name}` has no balance in mode `{mode.name}`"
            problems.error("missing", state.span, label, f"`der({name}) = 0` keeps it")
    check_balances(automaton, mode, check)


def check_balances(automaton: Automaton, mode: Mode, check: TypeChecker) -> None:
    """Report balances of names that are not states, and sides of different dimension.

    The left side must be `der(x)` or a product with it; another form is reported, too. A side that
    did not parse is skipped.
    """
    problems = check.problems
    for name, balance in mode.flow.items():
        if name not in automaton.states:
            hint = suggest_name(name, automaton.states)
            problems.error("name", balance.left.span, f"`{name}` is not a state", hint)
            continue
        with problems.collect_errors():
            if isinstance(balance.left, ErrorNode):
                continue
            factor = coefficient_of(balance.left, name)
            if isinstance(factor, SpecError):
                raise factor
            rate = dimension_product(automaton.states[name].unit.dimension, SECOND, -1)
            rate = Dimension(rate.powers, automaton.states[name].unit.dimension.angle)
            kind: ExprType | None = rate if factor is None else check.infer_type(factor)
            if factor is not None and isinstance(kind, Dimension):
                kind = dimension_product(kind, rate)
            if isinstance(kind, Dimension):
                check.check_quantity(balance.right, kind, f"the left side for {name}")


def check_elements(automaton: Automaton, names: Mapping[str, ExprType], problems: Problems) -> None:
    """Report unknown names in elements and places, and mistakes in their formulas.

    `names` are the types of the names that formulas may read. Names of `far` must be among them.
    The name of a place must be a state with a balance in a mode of the chart, an input or an
    output.
    """
    check = TypeChecker(NameEnvironment(names), problems)
    for element in automaton.elements.values():
        for formula in element.parts.values():
            check.infer_type(formula.tree)
        for name, span in element.far.items():
            if name not in names:
                label = f"`{name}` is not known here"
                problems.error("name", span, label, suggest_name(name, names))
    balanced = {name for mode in automaton.modes.values() for name in mode.flow}
    known = {*balanced, *automaton.inputs, *automaton.outputs}
    for name, formulas in automaton.places.items():
        for formula in formulas.values():
            check.infer_type(formula.tree)
            if name not in known:
                label = f"`{name}` is not a balance, an input or an output"
                problems.error("name", formula.span, label, suggest_name(name, known))


MAX_EQUATIONS = 100_000
"""Largest number of equations and balances in all modes: half of the keys and values of a spec."""
MAX_TRANSITIONS = 200
"""Largest number of transitions that leave a mode: the Program and the C code nest them."""


def check_size(automaton: Automaton, problems: Problems) -> None:
    """Report an automaton with too many equations or transitions; raises SpecError then.

    The limits are MAX_EQUATIONS equations and balances in all modes, and MAX_TRANSITIONS
    transitions of one mode. Equations at the root count once for each mode, because the Program
    repeats them.
    """
    modes = automaton.all_modes
    before = len(problems.reported)
    count = sum(len(mode.equations) + len(mode.flow) for mode in modes)
    if count > MAX_EQUATIONS:
        label = f"the modes have {count} equations and balances, those of the root in each of them"
        problems.error("huge", automaton.span, label, f"at most {MAX_EQUATIONS} are checked")
    for mode in modes:
        if len(mode.transitions) > MAX_TRANSITIONS:
            label = f"mode `{mode.name}` has {len(mode.transitions)} transitions"
            problems.error("huge", mode.span, label, f"a mode has at most {MAX_TRANSITIONS}")
    if len(problems.reported) > before:
        problems.raise_if_errors()


WHOLE_KINDS = (IntType, EnumType)
"""Types with integer values."""


def check_automaton(automaton: Automaton, problems: Problems) -> Automaton:
    """Return the automaton with the types and dimensions of its names. Raises SpecError.

    Integer equations are marked (`is_integer`). The error contains all problems, including those
    that `problems` has before; names and types are checked first, ranges, memory and domains next,
    reachability and overlaps of guards only without errors. The model of a sampled automaton is
    checked too. Warnings of these checks, such as unused names and unreachable modes, are added;
    the others are in `check_warnings`.
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
    check_guard_overlap(checked, QueryEngine(checked), problems)
    check_short_cycles(checked, problems)
    if checked.model:
        check_automaton(checked.model, problems)
    problems.raise_if_errors()
    check_unused(checked, problems)
    return checked


def _check_declarations(automaton: Automaton, problems: Problems) -> Automaton:
    """Return the automaton with types after the checks of names and dimensions."""
    return _AutomatonChecker(automaton, problems).run()


class _AutomatonChecker:
    """Checks of names and dimensions; each part of a spec has a name environment."""

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
        """Run all checks and return the automaton with dimensions, types and marked equations."""
        automaton = self.automaton
        self.kinds, self.literal_kinds = collect_declared_names(automaton, self.problems)
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
        """Return the modes with their integer equations marked."""
        return {name: self._mark_whole_equations(mode) for name, mode in modes.items()}

    def _mark_whole_equations(self, mode: Mode) -> Mode:
        """Return the mode with `is_integer` set on equations whose name has an integer type."""
        marked = {
            name: dataclasses.replace(formula, is_integer=True)
            for name, formula in mode.equations.items()
            if isinstance(self.kinds.get(name), WHOLE_KINDS)
        }
        return dataclasses.replace(mode, equations={**mode.equations, **marked})

    def _scope(self, groups: Iterable[Iterable[str]], place: str) -> NameEnvironment:
        """Return the environment of the names in some groups and of enumeration values.

        `place` describes it in messages.
        """
        known = {name: self.kinds[name] for group in groups for name in group}
        known = {**self.literal_kinds, **known}
        return NameEnvironment(
            known, frozenset(), place, self._angle_units(), frozenset(), self._lookup_tables()
        )

    def _memory_functions(self) -> frozenset[str]:
        """Return the functions with memory that any expression of a mode may call."""
        return frozenset(DELAY_FUNCTIONS if self.automaton.is_sampled else ("delay",))

    def _lookup_tables(self) -> dict[str, LookupTable]:
        """Return the tables of parameters by name."""
        declared = self.automaton.parameters.items()
        return {name: thing.table for name, thing in declared if thing.table}

    def _angle_units(self) -> dict[str, Unit]:
        """Return the units of the parameters that are declared in a unit of angle."""
        declared = self.automaton.parameters.items()
        return {name: thing.unit for name, thing in declared if thing.unit.dimension.angle}

    def _check_parameters(self) -> None:
        """Report derived parameters of a wrong dimension and cycles among them.

        Parameters of the model are checked with the model.
        """
        automaton = self.automaton
        scope = self._scope([automaton.parameters], "among the parameters")
        check = TypeChecker(scope, self.problems)
        trees: dict[str, SyntaxTree] = {}
        of_model = automaton.model.parameters if automaton.model else {}
        for parameter in automaton.parameters.values():
            if parameter.derived and parameter.name not in of_model:
                trees[parameter.name] = parameter.derived.tree
                what = f"the unit of {parameter.name}"
                check.check_quantity(parameter.derived.tree, parameter.unit.dimension, what)
        spans = {name: thing.span for name, thing in automaton.parameters.items()}
        report_cycle(trees, spans, "derived", self.problems)

    def _check_initial_values(self) -> None:
        """Report initial values of a wrong type and cycles among them."""
        automaton = self.automaton
        groups = [automaton.parameters, automaton.inputs, automaton.state_variables]
        check = TypeChecker(self._scope(groups, "where a state starts"), self.problems)
        for state in automaton.state_variables.values():
            check.check_assignment(state.initial.tree, self.kinds[state.name], state.name)
        trees = {name: state.initial.tree for name, state in automaton.state_variables.items()}
        spans = {name: state.span for name, state in automaton.state_variables.items()}
        report_cycle(trees, spans, "initial", self.problems)

    def _check_mode(self, mode: Mode) -> None:
        """Check a mode of the chart: equations in order, flow, actions, transitions, observer."""
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
        memory, owners = self._memory_functions(), self.equation_owners
        scope = NameEnvironment(
            known,
            modes,
            place,
            self._angle_units(),
            memory,
            self._lookup_tables(),
            mode.name,
            owners,
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
            memoryless = TypeChecker(
                dataclasses.replace(scope, memory_functions=frozenset()), self.problems
            )
            check_observer(automaton, mode.observer, self.kinds, memoryless)
        check_writers(automaton, mode, self.problems)

    def _common_equations_check(self, place: str, active_modes: Iterable[Mode] = ()) -> TypeChecker:
        """Return a type checker that knows the equations of all modes in `active_modes`.

        If `active_modes` is empty, these are the equations that every mode of the chart has.
        """
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
        """Check a mode of a parallel region or a superstate: balances, actions, transitions."""
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
        """Return the modes that can be active together with a mode.

        These are the nested leaves of the chart, or all modes if there is no such leaf.
        """
        automaton = self.automaton
        modes = list(automaton.modes.values())
        if automaton.statechart:
            chart = automaton.statechart
            node = next(node for node in chart.nodes if node.mode_key == mode.key)
            leaves = [n for n in chart.leaves(CHART) if chart.are_nested(n.index, node.index)]
            modes = [automaton.modes_by_key[leaf.mode_key] for leaf in leaves] or modes
        return modes

    def _check_transitions(self, mode: Mode, check: TypeChecker) -> None:
        """Check the transitions of a mode; waits may read parameters only."""
        parameters = self._scope([self.automaton.parameters], "in `wait`: it is a fixed time")
        constant = TypeChecker(parameters, self.problems)
        check_mode_transitions(self.automaton, mode, check, constant, self.problems)

    def _merge_kinds(self, name: str, kind: ExprType | None, formula: Formula) -> ExprType | None:
        """Return the type of an equation after a formula of type `kind` is added.

        Integer types are merged to their hull; a bare 0 accepts any dimension. Contradicting types
        of two modes are reported, and the earlier type is returned.
        """
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


def _event_names(automaton: Automaton) -> frozenset[str]:
    """Return the names of the events of the chart."""
    return frozenset(automaton.statechart.events if automaton.statechart else ())


def _mode_paths(automaton: Automaton) -> frozenset[str]:
    """Return the names that `in(...)` accepts: mode paths of a chart, or `region.mode`.

    There are none for an automaton with one region.
    """
    if automaton.statechart:
        return frozenset(mode_paths(automaton.statechart))
    if not automaton.regions:
        return frozenset()
    return frozenset(f"{m.region}.{m.name}" for m in automaton.all_modes)
