"""Check of function domains: divisors that may be 0, and roots or logarithms of invalid values.

Interval arithmetic decides most cases. Otherwise the solver is asked, with the conditions of the
enclosing `if` branches.
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from typing import Literal

from language.expressions.balance_form import coefficient_of
from language.expressions.syntax_tree import SyntaxTree
from language.ir.ops import Compare, Unary, real
from language.ir.root_region import CHART
from language.lowering.program_parameters import parameter_order
from language.model.automaton import Automaton, Mode
from language.model.evaluation_order import equation_order
from language.model.region_queries import equation_formulas
from language.model.truth_table import truth_table_formulas
from language.model.used_names import action_formulas
from language.smt.query_engine import QueryEngine
from language.smt.symbolic_environment import GuardSnapshot
from language.text.diagnostic import Problems, SpecError
from language.typecheck.interval import UNBOUNDED, Interval
from language.typecheck.range_analysis import RangeAnalysis

HINTS = {
    "divisor": "exclude 0 by an enclosing `if`, or by `max(..., limit)`",
    "root": "`sqrt(max(..., 0))`, or exclude it by an enclosing `if`",
    "log": "`log(max(..., 0.001))`, or exclude it by an enclosing `if`",
    "power": "`pow(max(..., 0), ...)`, or exclude it by an enclosing `if`",
    "inverse power": "`pow(max(..., 0.001), ...)`, or exclude it by an enclosing `if`",
}
"""Hint for each kind of domain."""
LABELS = {
    "divisor": "this divisor may be 0",
    "root": "this may be below 0, which has no square root",
    "log": "this may be 0 or below, which has no logarithm",
    "power": "this may be below 0, and `pow` takes bases of 0 and more",
    "inverse power": "this may be 0 or below, which has no power of a degree below 0",
}
"""Message for each kind of domain."""
OUTSIDE_RELATION: Mapping[str, Literal["==", "<", "<="]] = {
    **{"divisor": "==", "root": "<", "log": "<="},
    **{"power": "<", "inverse power": "<="},
}
"""Relation to 0 that the values outside of each domain have."""


def check_domains(automaton: Automaton, problems: Problems) -> None:
    """Report operands whose ranges exceed the domain of their operation.

    Operands are divisors (not 0), arguments of `sqrt` (>= 0) and `log` (> 0), and bases of `pow`
    (>= 0, or > 0 for a negative degree). Ranges are computed by interval arithmetic from the
    declared ones; an operand is reported if its interval is certain and the solver does not prove
    that enclosing `if` conditions exclude the values outside.

    Also reported are coefficients of `der(x)` that may be 0, and start values that lie outside of
    their range for all values of parameters. Spectral densities that may be negative give a
    warning.
    """
    fixed: dict[str, Interval] = {}
    for mode in automaton.all_modes:
        domains = _ModeDomainChecker(automaton, mode, problems, fixed)
        if not fixed:
            fixed.update({name: domains.interval_of(name) for name in parameter_order(automaton)})
        domains.check()
        if mode is automaton.all_modes[0]:
            domains.check_initial_values()


class _ModeDomainChecker:
    """Intervals of the names of one mode; the interval of each equation is computed once."""

    def __init__(
        self,
        automaton: Automaton,
        mode: Mode,
        problems: Problems,
        fixed: Mapping[str, Interval],
    ) -> None:
        self.automaton = automaton
        self.mode = mode
        self.problems = problems
        self.formulas = equation_formulas(mode)
        self.intervals: dict[str, Interval] = dict(fixed)
        self.range_analysis = RangeAnalysis(self.interval_of, self._table_interval, self._report)
        self.unreported_range_analysis = self.range_analysis.without_reports

    def check(self) -> None:
        """Report the operands of equations, actions, truth tables and balances of the mode.

        A balance needs a coefficient that cannot be 0. Spectral densities of an observer are
        checked for sign.
        """
        ranging = self.range_analysis
        for name in equation_order(self.mode):
            self.interval_of(name)
        tables = self.automaton.tables if self.mode.region == CHART else ()
        for formula in (*action_formulas(self.mode), *truth_table_formulas(tables)):
            ranging.analyse(formula.tree)
        for balance in self.mode.flow.values():
            ranging.analyse(balance.right)
            factor = coefficient_of(balance.left, balance.state)
            if factor is not None and not isinstance(factor, SpecError):
                interval = ranging.analyse(factor)
                if interval.contains_zero:
                    self._report("divisor", factor, interval)
        self._check_densities()

    def _check_densities(self) -> None:
        """Warn of spectral densities of an observer whose interval contains negative values."""
        noise = self.mode.observer.process_noise if self.mode.observer else {}
        for name, formula in noise.items():
            interval = self.unreported_range_analysis.analyse(formula.tree)
            if interval.is_certain and interval.low < 0.0:
                label = f"the density of `{name}` may be negative: from {interval.low:g} on"
                help = "its square, its `abs`, or `max(0, ...)`"
                self.problems.warning("observer", formula.span, label, help)

    def check_initial_values(self) -> None:
        """Report start values outside of their range for all values of tunable parameters."""
        for state in self.automaton.state_variables.values():
            if state.range:
                start, (low, high) = (
                    self.unreported_range_analysis.analyse(state.initial.tree),
                    map(float, state.range),
                )
                if start.high < low or start.low > high:
                    label = f"`{state.name}` starts outside of its range"
                    self.problems.error("range", state.initial.span, label)

    def interval_of(self, name: str) -> Interval:
        """Return the interval of a name; unbounded if the name depends on itself or has no range.

        Operands outside of their domain in the equations of the mode are reported. Names are
        evaluated in the order of equations, so the depth of recursion is small.
        """
        if name not in self.intervals:
            self.intervals[name] = UNBOUNDED
            self.intervals[name] = self._compute_interval(name)
        return self.intervals[name]

    def _compute_interval(self, name: str) -> Interval:
        """Return the interval of a name that is not cached.

        A fixed parameter has its value, a derived one the interval of its formula, a declared
        variable its range, and an equation the hull over its formulas.
        """
        automaton = self.automaton
        parameter = automaton.parameters.get(name)
        if parameter is not None and parameter.derived:
            return self.unreported_range_analysis.analyse(parameter.derived.tree)
        if parameter is not None and parameter.kind == "fixed" and parameter.value is not None:
            return Interval(float(parameter.value), float(parameter.value), True)
        declaration = parameter or automaton.inputs.get(name) or automaton.state_variables.get(name)
        if declaration is not None:
            limits = declaration.range
            return Interval(float(limits[0]), float(limits[1]), True) if limits else UNBOUNDED
        ranging = (
            self.range_analysis if name in self.mode.equations else self.unreported_range_analysis
        )
        parts = [ranging.analyse(formula.tree) for formula in self.formulas.get(name, ())]
        if not parts:
            return UNBOUNDED
        result = parts[0]
        for part in parts[1:]:
            result = result.hull(part)
        return result

    def _table_interval(self, name: str) -> Interval:
        """Return the interval of the values of a table; of a tunable table its range."""
        parameter = self.automaton.parameters[name]
        if parameter.kind == "tunable" or parameter.table is None:
            limits = parameter.range
            return Interval(float(limits[0]), float(limits[1]), True) if limits else UNBOUNDED
        values = parameter.table.values
        return Interval(float(min(values)), float(max(values)), True)

    def _report(self, what: str, tree: SyntaxTree, interval: Interval) -> None:
        """Report an operand outside of its domain.

        Nothing is reported if its interval is uncertain or the solver excludes the values outside.
        """
        if not interval.is_certain:
            return
        if self._is_excluded(what, tree):
            return
        span = f"{interval.low:.4g} to {interval.high:.4g}"
        label = f"{LABELS[what]}: it lies from {span}"
        self.problems.error("domain", tree.span, label, HINTS[what])

    def _is_excluded(self, what: str, tree: SyntaxTree) -> bool:
        """Return whether the enclosing conditions exclude values outside of the domain.

        This is proven by the solver. The result is False if the place cannot be lowered.
        """
        with suppress(KeyError, SpecError):
            snapshot = GuardSnapshot(self.automaton, self.mode)
            branches = [
                (snapshot.lower_expression(part), holds)
                for part, holds in self.range_analysis.branch_path
            ]
            conditions = [part if holds else Unary("not", part) for part, holds in branches]
            value = snapshot.lower_expression(tree)
            conditions.append(Compare(OUTSIDE_RELATION[what], value, real(0)))
            query_engine = QueryEngine(self.automaton)
            query = query_engine.build_query(snapshot.path, conditions)
            return query_engine.is_proven_unsatisfiable(query)
        return False
