"""Recursive: a Kalman filter that carries its covariance, corrected by one measurement at a time.

Prediction P = Phi P Phi' + Qd; for each measurement y = c x + v of variance r: s = c P c' + r,
k = P c' / s, x + k (y - c x), P - k c P (Bierman 1977, Factorization Methods for Discrete
Sequential Estimation, section II.6). P is stored once per pair, so it is symmetric whatever the
rounding. Qd is linear in the spectral densities: a density that is not constant is read each tick.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping

from language.covariance import Ahead, bounding, columns, corrected, entry, pairs, rows
from language.density import at_rest, varies
from language.derived import with_model
from language.entries import number_diagonal, number_matrix, output_matrix
from language.evaluate import Scalar
from language.instant import changed
from language.kalman import (
    Kalman,
    SolvedNames,
    is_fresh,
    mean_ahead,
    rest_constants,
    solved_formulas,
)
from language.lower import Names, expression
from language.matrix import (
    Matrix,
    exponential,
    exponential_integral,
    identity,
    multiply,
    subtract as less,
)
from language.model import Automaton, Mode, Observer, Run as ModelRun
from language.operation import (
    Assign,
    Block,
    Branch,
    Choose,
    Expr,
    Op,
    Ref,
    Run,
    real,
    subtract,
    total,
)
from language.parameter import tunables_of
from language.problem import Problems
from language.program import Constant, ObserverInfo
from language.riccati import discrete_noise, steady_gain


def recursive(
    automaton: Automaton,
    mode: Mode,
    before: Names,
    now: Names,
    values: Mapping[str, Scalar],
    problems: Problems,
) -> Kalman | None:
    """Return the observer of a mode; None where its numbers cannot be computed (reported)."""
    assert mode.observer and automaton.period is not None
    with problems.collecting():
        try:
            return _Recursive(automaton, mode, (before, now), values, problems).kalman()
        except ValueError as error:
            problems.error("observer", mode.observer.span, f"it cannot be solved: {error}")
    return None


class _Recursive:
    """Builds the operations and numbers of one mode's observer."""

    def __init__(
        self,
        automaton: Automaton,
        mode: Mode,
        known: tuple[Names, Names],
        values: Mapping[str, Scalar],
        problems: Problems,
    ) -> None:
        assert mode.observer
        self.automaton, self.mode, self.values, self.problems = automaton, mode, values, problems
        self.before, self.now = known
        self.period = float(automaton.period or 0)
        self.states = mode.observer.states
        noise = mode.observer.process_noise
        self.varying = {n: f for n, f in noise.items() if varies(automaton, f)}
        self.depends_on: tuple[str, ...] = ()

    def kalman(self) -> Kalman | None:
        given = self.mode.observer
        assert given
        if given.runs and self.mode.run:
            given = dataclasses.replace(given, of=self.mode.run.mode)
        observer = with_model(self.automaton, self.mode.name, given, self.values, self.problems)
        if observer is None:
            return None
        self._same_states()
        self.depends_on = tunables_of(self.automaton, solved_formulas(observer))
        c = output_matrix(self.automaton, self.values, observer)
        measured = tuple(observer.measures)
        r = number_diagonal(self.automaton, self.values, observer.measurement_noise, measured)
        own = self._ahead(observer, self.mode.name)
        constants = self._constants(observer, own, c, r)
        constants += rest_constants(self.automaton, observer, self.values)
        start, enter, more = self._steady(observer, own, c, r)
        constants += more
        if observer.runs:
            predict, extra, spreads = self._by_run(given)
            constants += extra
        else:
            mean, extra = self._mean(observer, own)
            spreads = self._spreads(observer, own)
            late, more = self._late(observer, self.mode.name)
            predict = (Run(f"spread_{self.mode.name}"), *mean, *late)
            constants += extra + more
        info = ObserverInfo(
            self.mode.name, self.states, observer.inputs, measured, own.a, (), c,
            (), r, self.period, {}, "recursive",
        )  # fmt: skip
        bounds = bounding(self.automaton, self.mode, self.values, self.problems)
        correct = (*self._correct(observer, c), *map(Run, bounds))
        return Kalman(predict, correct, tuple(constants), info, start, enter, {**spreads, **bounds})

    def _same_states(self) -> None:
        """The covariance belongs to the automaton, as its states do."""
        observers = (mode.observer for mode in self.automaton.modes.values())
        first = next(o for o in observers if o and o.gain == "recursive")
        if self.states != first.states:
            label = "recursive observers of an automaton have the same states in the same order"
            assert self.mode.observer
            self.problems.error("observer", self.mode.observer.span, label)

    def _ahead(self, observer: Observer, tag: str) -> Ahead:
        """Return the numbers of a prediction by the matrix of an observer."""
        states, h = self.states, self.period
        a = number_matrix(self.automaton, self.values, observer.a, states, states, "A")
        fixed = {n: f for n, f in observer.process_noise.items() if n not in self.varying}
        q = number_diagonal(self.automaton, self.values, fixed, states)
        numbers = {"Phi": exponential(a, h), "Qd": discrete_noise(a, q, h)}
        for name in self.varying:
            one = tuple(
                tuple(1.0 if row == column == name else 0.0 for column in states) for row in states
            )
            numbers[f"N_{name}"] = discrete_noise(a, one, h)
        return Ahead(tag, a, numbers)

    def _constants(
        self, observer: Observer, ahead: Ahead, c: Matrix, r: Matrix
    ) -> tuple[Constant, ...]:
        measured = {"C": c} if c else {}
        found = SolvedNames(ahead.tag, observer).constants(
            {**ahead.numbers, **measured}, self.depends_on
        )
        variances = []
        for k, name in enumerate(observer.measures):
            solved = f"solved.{ahead.tag}_R.{name}"
            variances.append(Constant(solved, "solved", r[k][k], depends_on=self.depends_on))
        return (*found, *variances)

    def _steady(
        self, observer: Observer, own: Ahead, c: Matrix, r: Matrix
    ) -> tuple[Block, Block, tuple[Constant, ...]]:
        """Return what sets the steady covariance: before a correction, and after one.

        Densities that are not constant count here as they are while all inputs are 0.
        """
        noise = own.numbers["Qd"]
        for name, formula in self.varying.items():
            size = at_rest(formula, self.automaton, self.values)
            part = own.numbers[f"N_{name}"]
            noise = tuple(
                tuple(x + size * y for x, y in zip(p, q, strict=True))
                for p, q in zip(noise, part, strict=True)
            )
        try:
            gain, ahead = steady_gain(own.numbers["Phi"], noise, c, r)
        except ValueError as error:
            if observer.covariance == "keep" and self.mode.name != self.automaton.initial:
                return (), (), ()
            label = f"the observer has no steady covariance to start with: {error}"
            self.problems.error("observer", observer.span, label)
            return (), (), ()
        after = multiply(less(identity(len(self.states)), multiply(gain, c)), ahead)
        solved = SolvedNames(self.mode.name, observer)
        numbers = {"P": ahead} | ({"Pe": after} if observer.covariance == "steady" else {})
        constants = solved.constants(numbers, self.depends_on)
        known = {constant.name for constant in constants}
        start, enter = (
            tuple(
                Assign(entry(i, j), Ref(name) if name in known else real(0.0))
                for i, j in pairs(self.states)
                for name in [solved.of(letter, i, j)]
            )
            for letter in ("P", "Pe")
        )
        return start, enter if observer.covariance == "steady" else (), constants

    def _mean(self, observer: Observer, own: Ahead) -> tuple[Block, tuple[Constant, ...]]:
        states = self.states
        b = number_matrix(self.automaton, self.values, observer.b, states, observer.inputs, "B")
        held = exponential_integral(own.a, self.period)
        numbers = {"G": held, "Gamma": multiply(held, b) if observer.inputs else ()}
        solved = SolvedNames(self.mode.name, observer)
        more = {name: Ref(f"solved.{name}") for name in observer.constants}
        known = {**self.before, **more}
        prefix = f"{self.automaton.name} "
        mean = mean_ahead(
            self.automaton, observer, solved, {**own.numbers, **numbers}, known, prefix
        )
        return mean, solved.constants(numbers, self.depends_on)

    def _by_run(self, given: Observer) -> tuple[Block, tuple[Constant, ...], Mapping[str, Block]]:
        """The covariance by the mode in which the run begins the period; the states by the run."""
        run, model = self.mode.run, self.automaton.model
        assert run and model
        modes = model.modes.values() if run.follow else [model.modes[run.mode]]
        cases: list[tuple[int, Block]] = []
        after: list[tuple[int, Block]] = []
        spreads: dict[str, Block] = {}
        constants: tuple[Constant, ...] = ()
        for mode in modes:
            there = dataclasses.replace(given, of=mode.name)
            tag = f"{self.mode.name}_{mode.name}"
            observer = with_model(self.automaton, tag, there, self.values, self.problems)
            if observer:
                ahead = self._ahead(observer, tag)
                solved = SolvedNames(tag, observer)
                depends_on = tunables_of(self.automaton, solved_formulas(observer))
                constants += solved.constants(ahead.numbers, depends_on)
                spreads |= self._spreads(observer, ahead)
                cases.append((mode.number, (Run(f"spread_{tag}"),)))
                late, more = self._late(observer, tag)
                constants += more
                if late:
                    spreads[f"late_{tag}"] = late
                    after.append((mode.number, (Run(f"late_{tag}"),)))
        chosen = self._chosen(run, cases)
        predict = (*chosen, Run(f"run_{self.mode.name}"), *self._chosen(run, after))
        return predict, constants, spreads

    def _chosen(self, run: ModelRun, cases: list[tuple[int, Block]]) -> Block:
        """The block of the mode in which the model is; a run that keeps its flow has one."""
        if run.follow and cases:
            return (Choose("memory.run_mode", tuple(cases)),)
        return cases[0][1] if cases else ()

    def _late(self, observer: Observer, tag: str) -> tuple[Block, tuple[Constant, ...]]:
        """What inputs do that changed within this tick, at an instant that is not known."""
        solved, known = SolvedNames(tag, observer), (self.before, self.now)
        ops, constants = changed(self.automaton, solved, known, self.values, self.problems)
        return ops, constants

    def _spreads(self, observer: Observer, ahead: Ahead) -> dict[str, Block]:
        """The densities of now, then the covariance over the period: its rows, its columns."""
        ops: list[Op] = []
        for name, formula in self.varying.items():
            key = f"{self.automaton.name} {formula.key}"
            ops.append(Assign(f"work.density_{name}", expression(formula.tree, self.now), key))
        solved, tag = SolvedNames(ahead.tag, observer), ahead.tag
        return {
            f"spread_{tag}": (*ops, Run(f"rows_{tag}"), Run(f"columns_{tag}")),
            f"rows_{tag}": rows(solved, ahead),
            f"columns_{tag}": columns(solved, ahead),
        }

    def _correct(self, observer: Observer, c: Matrix) -> Block:
        """Innovations against the prediction, then one measurement at a time in their order."""
        solved = SolvedNames(self.mode.name, observer)
        more = {name: Ref(f"solved.{name}") for name in observer.constants}
        known = {**self.now, **more}
        first: list[Op] = []
        second: list[Op] = []
        for name in observer.measures:
            fresh = is_fresh(observer, name)
            seen = self._seen(observer, solved, c, name, known)
            error = subtract(known[name], seen)
            first.append(Branch(fresh, (Assign(f"innovation.{name}", error),)))
            second.append(Branch(fresh, corrected(self.automaton, solved, c, name, error)))
        return (*first, *second)

    def _seen(
        self, observer: Observer, solved: SolvedNames, c: Matrix, name: str, known: Names
    ) -> Expr:
        state: dict[str, Expr] = {name: Ref(f"state.{name}") for name in self.states}
        parts = solved.row("C", c, name, state)
        if name in observer.g:
            parts.append(expression(observer.g[name].tree, known))
        return total(parts)
