"""Symbolic environment: binds names to symbolic values at one instant in one mode.

Expressions are lowered as for a Program. The equations that an expression reads become assignments
before it. An equation of a parallel region is selected by the mode of that region, which is a
variable. The result of a function with memory is a free variable; an edge additionally requires the
present level of its condition. Applying a transition yields the snapshot after its exit, reset and
entry stages (rule 6).
"""

from __future__ import annotations

import copy
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from fractions import Fraction

from language.expressions.syntax_tree import (
    EDGE_FUNCTIONS,
    MEMORY_FUNCTIONS,
    FunctionCall,
    SyntaxTree,
    memory_key,
    walk,
)
from language.ir.analysis_cache import cache_on_owner
from language.ir.number_type import round_to_type
from language.ir.ops import Binary, Compare, Expr, Ref, Select, Unary, Value, integer
from language.ir.program import mode_variable
from language.lowering.action_stages import Stage, storage_of, transition_stages
from language.lowering.chart_activity import is_active, is_complete
from language.lowering.constants import evaluate_exactly
from language.lowering.delay_buffers import evaluate_ticks, expression_type
from language.lowering.expressions import WHOLE_TYPES, lower_assigned_value, lower_expression
from language.lowering.program_parameters import constant_bindings
from language.model.automaton import Automaton, Mode, Transition
from language.model.chart_paths import mode_paths
from language.model.declaration import Formula
from language.model.graph_algorithms import post_order
from language.model.statechart import Chart, ChartNode
from language.model.transition_precedence import node_of
from language.smt.query import SymbolicAssignment, VariableDomain

TIME_IN_MODE = "memory.elapsed"
"""Variable of the time since the entry of the mode: in ticks if sampled, else in seconds."""


@dataclass
class SymbolicPath:
    """Assignments along a sequence of snapshots, in order, with assumptions and domains.

    `domains` are those of the variables that the path introduces.
    """

    assignments: list[SymbolicAssignment] = field(default_factory=list)
    assumptions: list[Expr] = field(default_factory=list)
    domains: dict[str, VariableDomain] = field(default_factory=dict)
    snapshot_count: int = 0


class GuardSnapshot:
    """Symbolic values of all names in one mode of one region at an instant."""

    def __init__(
        self,
        automaton: Automaton,
        mode: Mode,
        path: SymbolicPath | None = None,
        values: Mapping[str, Expr] | None = None,
    ) -> None:
        """Start a path, or continue one with the values that a transition left.

        Inputs and states are variables, unless `values` gives the symbolic value of a state by
        name. In a later snapshot of a path the mode is just entered: edges and `every` are false.
        """
        self.automaton = automaton
        self.mode = mode
        self.path = path or SymbolicPath()
        self.suffix = f" {self.path.snapshot_count}" if self.path.snapshot_count else ""
        self.time_in_mode = TIME_IN_MODE
        self.path.snapshot_count += 1
        self.bindings: dict[str, Expr] = dict(constant_bindings(automaton))
        for name, thing in automaton.inputs.items():
            self.bindings[name] = Ref(f"input.{name}", thing.type in WHOLE_TYPES)
        for name, variable in automaton.state_variables.items():
            self.bindings[name] = Ref(storage_of(automaton, name), variable.type in WHOLE_TYPES)
        self.bindings.update(values or {})
        self.bindings.update(self._mode_bindings())

    def lower_expression(self, tree: SyntaxTree) -> Expr:
        """Return a lowered expression; the equations that it reads are assigned first.

        The assignments are appended to the path, each equation once for a snapshot. Functions with
        memory become variables (see the module). Raises KeyError if a name has no value in this
        snapshot, SpecError if the expression cannot be lowered.
        """
        self._define_equations([tree])
        return lower_expression(tree, self.bindings)

    def lower_guard(self, transition: Transition) -> Expr:
        """Return the condition under which a transition is enabled, without its events and wait.

        For a completion transition of a chart, this is the condition that its source is complete.
        Raises KeyError or SpecError like `lower_expression`.
        """
        chart = self.automaton.statechart
        node = node_of(self.automaton, self.automaton.source_mode(transition))
        if transition.is_completion and chart and node:
            return is_complete(chart, node, "mode")
        return self.lower_expression(transition.when.tree)

    def in_enclosing_mode(self, outer: Mode) -> GuardSnapshot:
        """Return a copy of the snapshot for a mode that encloses this one; both share the path.

        Only the time in the mode differs: it is a new variable, `after(...)` is bound anew, and the
        mode, its equations and all other values are still those of this mode. The path, and with it
        this snapshot, gets the domains of both times, ticks of at least 0, and the assumption that
        the time in the enclosing mode is not below that in this mode.
        """
        result = copy.copy(self)
        result.bindings = {
            key: value for key, value in self.bindings.items() if key[:6] != "after "
        }
        result.time_in_mode = f"{TIME_IN_MODE} {outer.key}"
        ages = Ref(result.time_in_mode, True), Ref(TIME_IN_MODE, True)
        self.path.domains.update(
            (age.name, VariableDomain("whole", low=Fraction(0))) for age in ages
        )
        self.path.assumptions.append(Compare(">=", *ages))
        return result

    def apply_transition(self, transition: Transition) -> GuardSnapshot:
        """Return the snapshot of the target mode after exit, reset and entry (rule 6).

        Assignments are appended to the path; those of a stage read the values before the stage
        (rule 5). Guard, wait and events are not required here, and modes around source and target
        are not entered or left. Raises KeyError or SpecError like `lower_expression`.
        """
        stages = transition_stages(self.automaton, transition)
        values: dict[str, Expr] = {}
        for stage in stages.before:
            values = self._apply_stage(stage, values)
        result = self._in_target(transition, values)
        for stage in stages.after:
            result = result._in_target(transition, result._apply_stage(stage, {}))
        return result

    def _in_target(self, transition: Transition, values: Mapping[str, Expr]) -> GuardSnapshot:
        """Return the snapshot of the target mode, with some new values of variables."""
        carried = {name: self.bindings[name] for name in self.automaton.state_variables}
        target = self.automaton.target_mode(transition)
        return GuardSnapshot(self.automaton, target, self.path, {**carried, **values})

    def _apply_stage(self, stage: Stage, values: Mapping[str, Expr]) -> dict[str, Expr]:
        """Return `values` updated with the assignments of one stage.

        The formulas read `values` and the equations of this snapshot. Each assignment gets a new
        name in the path.
        """
        formulas = {n: formula for action in stage for n, formula in action.assignments.items()}
        self._define_equations(formula.tree for formula in formulas.values())
        known = {**self.bindings, **values}
        result = dict(values)
        for name, formula in formulas.items():
            is_whole = self.automaton.state_variables[name].type in WHOLE_TYPES
            target = f"{storage_of(self.automaton, name)} {len(self.path.assignments)}"
            value = lower_assigned_value(formula.tree, known, is_whole)
            self.path.assignments.append((target, value))
            result[name] = Ref(target, is_whole)
        return result

    def _mode_bindings(self) -> dict[str, Expr]:
        """Return the values of `in(...)`: constants for this region, comparisons for other regions.

        The mode variables of other regions are added to the domains of the path.
        """
        model = self.automaton.model
        bindings = _run_mode_bindings(model, self.path.domains) if model else {}
        if self.automaton.statechart:
            return {**bindings, **self._chart_mode_bindings(self.automaton.statechart)}
        for region in self.automaton.all_regions:
            is_own = region.name == self.mode.region
            selector = Ref(f"mode.{region.name}", True)
            if not is_own:
                self.path.domains[selector.name] = _mode_domain(region.modes.values())
            for name, mode in region.modes.items():
                is_in: Expr = Compare("==", selector, integer(mode.number))
                bindings[f"in {region.name}.{name}"] = (
                    Value(name == self.mode.name) if is_own else is_in
                )
        return bindings

    def _chart_mode_bindings(self, chart: Chart) -> dict[str, Expr]:
        """Return the values of `in(...)` in a chart and restrict the mode variables of its regions.

        A region that contains the mode can have only modes that are nested with it. A region
        elsewhere can also be inactive.
        """
        own_node = next(node for node in chart.nodes if node.mode_key == self.mode.key)
        for region in self.automaton.all_regions:
            leaves = chart.leaves(region.name)
            is_enclosing = chart.region_node(region.name).contains(own_node.index)
            nested = [
                leaf
                for leaf in leaves
                if leaf.contains(own_node.index) or own_node.contains(leaf.index)
            ]
            numbers = [
                leaf.number
                for leaf in (nested if is_enclosing else leaves)
                if leaf.number is not None
            ]
            if not is_enclosing and region.inactive is not None:
                numbers.append(region.inactive)
            name = mode_variable("mode", region.name)
            self.path.domains[name] = VariableDomain("whole", numbers=tuple(numbers))
        bindings: dict[str, Expr] = {}
        for path, (node, active) in _mode_activity(chart).items():
            bindings[f"in {path}"] = Value(True) if node.contains(own_node.index) else active
        return bindings

    def _define_equations(self, trees: Iterable[SyntaxTree]) -> None:
        """Assign the equations that expressions need, each after the equations that it reads.

        Functions with memory in the expressions are bound too.
        """
        trees = list(trees)
        needed: dict[str, list[tuple[int | None, str, Formula]]] = {}
        stack = [name for tree in trees for name in Formula(tree, "").reads]
        while stack:
            name = stack.pop()
            if name in needed or name in self.bindings:
                continue
            needed[name] = list(self._alternatives(name))
            stack += [read for _, _, formula in needed[name] for read in formula.reads]
        reads = {
            n: [r for _, _, f in alternatives for r in f.reads]
            for n, alternatives in needed.items()
        }
        for name in post_order(reads):
            if needed[name]:
                self._define_equation(name, needed[name])
        for tree in trees:
            self.define_memory(tree)

    def _alternatives(self, name: str) -> Iterator[tuple[int | None, str, Formula]]:
        """Yield the formulas of an equation as mode number, region and formula.

        A formula of this mode is the only one, with mode number None; otherwise each mode of the
        other regions that defines the name contributes one.
        """
        if name in self.mode.equations:
            yield None, self.mode.region, self.mode.equations[name]
            return
        for region in self.automaton.all_regions:
            for mode in region.modes.values() if region.name != self.mode.region else ():
                if name in mode.equations:
                    yield mode.number, region.name, mode.equations[name]

    def _define_equation(
        self, name: str, alternatives: list[tuple[int | None, str, Formula]]
    ) -> None:
        """Assign an equation: its only formula, or a selection by the mode variable of its region.

        The last alternative is the value if no other mode is active.
        """
        is_whole = alternatives[0][2].is_integer
        value: Expr | None = None
        for number, region, formula in reversed(alternatives):
            self.define_memory(formula.tree)
            lowered = lower_assigned_value(formula.tree, self.bindings, formula.is_integer)
            if value is None or number is None:
                value = lowered
            else:
                is_in = Compare("==", Ref(f"mode.{region}", True), integer(number))
                value = Select(is_in, lowered, value)
        assert value is not None
        target = f"equation.{name}{self.suffix}"
        self.path.assignments.append((target, value))
        self.bindings[name] = Ref(target, is_whole)

    def define_memory(self, tree: SyntaxTree) -> None:
        """Bind the functions with memory in a tree to symbolic values; inner calls come first.

        Calls that are bound already are kept. New variables and assumptions are added to the path.
        Raises KeyError if an argument reads a name without a value.
        """
        for part in reversed(walk(tree)):
            if isinstance(part, FunctionCall) and part.function in MEMORY_FUNCTIONS:
                key = memory_key(part)
                if key not in self.bindings:
                    self.bindings[key] = self._memory_value(part)

    def _memory_value(self, call: FunctionCall) -> Expr:
        """Return the symbolic result of a function with memory.

        `after` compares the time in the mode with its argument. `rising` and `falling` are a free
        change and the present level. All others are free variables. After a transition, edges and
        `every` are false because the activation is new.
        """
        automaton = self.automaton
        if self.suffix and call.function in (*EDGE_FUNCTIONS, "every"):
            return Value(False)  # there is no earlier instant in this activation
        if call.function == "after":
            if self.suffix:
                return Value(evaluate_exactly(Formula(call.arguments[0], ""), automaton) <= 0)
            if automaton.is_sampled:
                return self._is_in_mode_for(call)
            self.path.domains[TIME_IN_MODE] = VariableDomain(low=Fraction(0))
            time = lower_expression(call.arguments[0], constant_bindings(automaton))
            return Compare(">=", Ref(TIME_IN_MODE), time)
        if call.function in ("rising", "falling"):
            level = lower_expression(call.arguments[0], self.bindings)
            now = level if call.function == "rising" else Unary("not", level)
            return Binary("and", self._changed_value(call), now)
        name = f"memory.{call.function}_{len(self.path.domains)}{self.suffix}"
        if call.function in ("changed", "every"):
            self.path.domains[name] = VariableDomain("truth")
            if call.function == "every" and automaton.is_sampled:
                aged = self._is_in_mode_for(call)
                if evaluate_ticks(automaton, call.arguments[0]) == 1:
                    return aged  # true at each tick after the first
                self.path.assumptions.append(Binary("or", Unary("not", Ref(name)), aged))
            return Ref(name)
        kind = expression_type(automaton, call.arguments[0])
        self.path.domains[name] = replace(self._domain_of(call.arguments[0]), type=kind)
        return Ref(name, kind == "whole")

    def _changed_value(self, call: FunctionCall) -> Expr:
        """Return whether a condition changed, as a variable that `rising` and `falling` share."""
        change = FunctionCall("changed", call.arguments, call.span)
        key = memory_key(change)
        if key not in self.bindings:
            self.bindings[key] = self._memory_value(change)
        return self.bindings[key]

    def _is_in_mode_for(self, call: FunctionCall) -> Expr:
        """Return the condition that the mode has been active for a number of ticks.

        The number is the first argument of the call in ticks.
        """
        self.path.domains[self.time_in_mode] = VariableDomain("whole", low=Fraction(0))
        ticks = integer(evaluate_ticks(self.automaton, call.arguments[0]))
        return Compare(">=", Ref(self.time_in_mode, True), ticks)

    def _domain_of(self, tree: SyntaxTree) -> VariableDomain:
        """Return the domain of a delayed input or state: its range.

        Unbounded for other expressions.
        """
        path = getattr(tree, "path", "")
        declaration = self.automaton.inputs.get(path) or self.automaton.state_variables.get(path)
        if declaration is None or declaration.range is None:
            return VariableDomain()
        low, high = (
            Fraction(round_to_type(bound, self.automaton.numbers)) for bound in declaration.range
        )
        return VariableDomain(low=low, high=high)


@cache_on_owner
def _mode_activity(chart: Chart) -> dict[str, tuple[ChartNode, Expr]]:
    """Return the nodes of a chart by mode path, each with the condition that it is active."""
    paths = mode_paths(chart).items()
    return {path: (node, is_active(chart, node, "mode")) for path, node in paths}


def _run_mode_bindings(model: Automaton, domains: dict[str, VariableDomain]) -> dict[str, Expr]:
    """Return the values of `in(model.mode)`: a run can be in any mode of its model.

    The mode variables of the run are added to `domains`.
    """
    bindings: dict[str, Expr] = {}
    for region in model.all_regions:
        selector = Ref(f"run.{region.name}", True)
        domains[selector.name] = _mode_domain(region.modes.values())
        for name, mode in region.modes.items():
            is_in = Compare("==", selector, integer(mode.number))
            bindings[f"in {model.name}.{region.name}.{name}"] = is_in
            if region.name == model.root_region.name:
                bindings[f"in {model.name}.{name}"] = is_in
    return bindings


def _mode_domain(modes: Iterable[Mode]) -> VariableDomain:
    """Return the domain of a mode variable: the mode numbers, and the names for witnesses.

    There are no names if a number is negative.
    """
    by_number = {mode.number: mode.name for mode in modes}
    names: tuple[str, ...] = ()
    if min(by_number) >= 0:
        names = tuple(by_number.get(number, "") for number in range(max(by_number) + 1))
    return VariableDomain("whole", numbers=tuple(by_number), names=names)
