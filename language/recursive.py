"""Recursive: a Kalman filter that carries its covariance, corrected by one measurement at a time.

Prediction P = Phi P Phi' + Qd; for each measurement y = c x + v of variance r: s = c P c' + r,
k = P c' / s, x + k (y - c x), P - k c P (Bierman 1977, Factorization Methods for Discrete
Sequential Estimation, section II.6). P is stored once per pair, so it is symmetric whatever the
rounding. Qd is linear in the spectral densities: a density that is not constant is read each tick.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator, Mapping

from language.constants import constant_value
from language.derived import with_model
from language.evaluate import Scalar, evaluate
from language.kalman import (
    Kalman,
    SolvedNames,
    is_fresh,
    mean_ahead,
    number_diagonal,
    number_matrix,
    output_matrix,
    rest_constants,
    solved_formulas,
)
from language.limit import stored
from language.lower import Names, constant_names, expression, tunables_of
from language.matrix import (
    Matrix,
    exponential,
    exponential_integral,
    identity,
    multiply,
    subtract as less,
)
from language.model import Automaton, Formula, Mode, Observer
from language.operation import (
    Assign,
    Binary,
    Block,
    Branch,
    Call,
    Choose,
    Compare,
    Expr,
    FaultBit,
    Op,
    Ref,
    Run,
    Unary,
    add,
    divide,
    multiply as times,
    real,
    subtract,
    total,
)
from language.problem import Problems
from language.program import Constant, ObserverInfo, Variable
from language.riccati import discrete_noise, steady_gain
from language.syntax import Application, memory_key, names as names_of, walk

COVARIANCE_RANGE = "covariance_range"


@dataclasses.dataclass(frozen=True)
class _Ahead:
    """The numbers of one prediction: Phi, Qd of the constant densities, Qd per unit of others."""

    tag: str
    a: Matrix
    numbers: Mapping[str, Matrix]


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
        made = _Recursive(automaton, mode, (before, now), values, problems)
        return made.kalman()
    return None


def covariance_variables(automaton: Automaton) -> list[Variable]:
    """Return the variables of the recursive observers of an automaton."""
    found: dict[str, Variable] = {}
    for mode in automaton.modes.values():
        observer = mode.observer
        if observer is None or observer.gain != "recursive":
            continue
        units = {name: str(automaton.states[name].unit.dimension) for name in observer.states}
        for i, row in enumerate(observer.states):
            for j, column in enumerate(observer.states):
                unit = f"({units[row]})*({units[column]})"
                name = f"work.t_{row}__{column}"
                found[name] = Variable(name, "real", unit)
                if i <= j:
                    name = _entry(row, column)
                    about = f"covariance of {row} and {column}"
                    found[name] = Variable(name, "real", unit, about=about)
            for what in ("pc", "gain", "density"):
                found[f"{what}{row}"] = Variable(f"work.{what}_{row}", "real")
        for name in ("spread", "residual"):
            found[name] = Variable(f"work.{name}", "real")
    return list(found.values())


def _entry(row: str, column: str) -> str:
    return f"memory.P_{row}__{column}"


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
        self.varying = {n: f for n, f in noise.items() if _varies(automaton, f)}
        self.depends_on: tuple[str, ...] = ()

    def kalman(self) -> Kalman | None:
        given = self.mode.observer
        assert given
        if given.runs and self.mode.run:
            given = dataclasses.replace(given, of=self.mode.run.mode)
        observer = with_model(self.automaton, self.mode.name, given, self.values, self.problems)
        if observer is None:
            return None
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
            predict, extra = self._by_run(given)
            constants += extra
        else:
            mean, extra = self._mean(observer, own)
            predict = (*self._spread(observer, own), *mean)
            constants += extra
        info = ObserverInfo(
            self.mode.name, self.states, observer.inputs, measured, own.a, (), c,
            (), r, self.period, {}, "recursive",
        )  # fmt: skip
        correct = self._correct(observer, c)
        return Kalman(predict, correct, tuple(constants), info, start, enter)

    def _ahead(self, observer: Observer, tag: str) -> _Ahead:
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
        return _Ahead(tag, a, numbers)

    def _constants(
        self, observer: Observer, ahead: _Ahead, c: Matrix, r: Matrix
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
        self, observer: Observer, own: _Ahead, c: Matrix, r: Matrix
    ) -> tuple[Block, Block, tuple[Constant, ...]]:
        """Return what sets the steady covariance: before a correction, and after one.

        Densities that are not constant count here as they are while all inputs are 0.
        """
        noise = own.numbers["Qd"]
        for name, formula in self.varying.items():
            size = _at_rest(formula, self.automaton, self.values)
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
                Assign(_entry(i, j), Ref(name) if name in known else real(0.0))
                for i, j in self._pairs()
                for name in [solved.of(letter, i, j)]
            )
            for letter in ("P", "Pe")
        )
        return start, enter if observer.covariance == "steady" else (), constants

    def _mean(self, observer: Observer, own: _Ahead) -> tuple[Block, tuple[Constant, ...]]:
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

    def _by_run(self, given: Observer) -> tuple[Block, tuple[Constant, ...]]:
        """The covariance by the mode in which the run begins the period; the states by the run."""
        run, model = self.mode.run, self.automaton.model
        assert run and model
        modes = model.modes.values() if run.follow else [model.modes[run.mode]]
        cases: list[tuple[int, Block]] = []
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
                cases.append((mode.number, self._spread(observer, ahead)))
        chosen: Block = (Choose("memory.run_mode", tuple(cases)),)
        if not run.follow:
            chosen = cases[0][1] if cases else ()
        return (*chosen, Run(f"run_{self.mode.name}")), constants

    def _pairs(self) -> Iterator[tuple[str, str]]:
        for i, row in enumerate(self.states):
            for column in self.states[i:]:
                yield row, column

    def _covariance(self, row: str, column: str) -> Ref:
        i, j = self.states.index(row), self.states.index(column)
        return Ref(_entry(row, column) if i <= j else _entry(column, row))

    def _spread(self, observer: Observer, ahead: _Ahead) -> Block:
        """P = Phi P Phi' + Qd, through T = Phi P."""
        solved, states = SolvedNames(ahead.tag, observer), self.states
        ops: list[Op] = []
        for name, formula in self.varying.items():
            key = f"{self.automaton.name} {formula.key}"
            ops.append(Assign(f"work.density_{name}", expression(formula.tree, self.now), key))
        phi = ahead.numbers["Phi"]
        for row in states:
            for column in states:
                old: dict[str, Expr] = {name: self._covariance(name, column) for name in states}
                parts = solved.row("Phi", phi, row, old)
                ops.append(Assign(f"work.t_{row}__{column}", total(parts)))
        for row, column in self._pairs():
            half: dict[str, Expr] = {name: Ref(f"work.t_{row}__{name}") for name in states}
            parts = solved.row("Phi", phi, column, half)
            parts += self._noise(solved, ahead, row, column)
            ops.append(Assign(_entry(row, column), total(parts)))
        return (*ops, *self._bounded(observer))

    def _noise(self, solved: SolvedNames, ahead: _Ahead, row: str, column: str) -> list[Expr]:
        i, j = self.states.index(row), self.states.index(column)
        parts: list[Expr] = []
        if ahead.numbers["Qd"][i][j] != 0.0:
            parts.append(Ref(solved.of("Qd", row, column)))
        for name in self.varying:
            if ahead.numbers[f"N_{name}"][i][j] != 0.0:
                unit = Ref(solved.of(f"N_{name}", row, column))
                parts.append(times(Ref(f"work.density_{name}"), unit))
        return parts

    def _correct(self, observer: Observer, c: Matrix) -> Block:
        """Innovations against the prediction, then one measurement at a time in their order."""
        solved = SolvedNames(self.mode.name, observer)
        more = {name: Ref(f"solved.{name}") for name in observer.constants}
        known = {**self.now, **more}
        first: list[Op] = []
        second: list[Op] = []
        for k, name in enumerate(observer.measures):
            fresh = is_fresh(observer, name)
            seen = self._seen(observer, solved, c, name, known)
            error = subtract(known[name], seen)
            first.append(Branch(fresh, (Assign(f"innovation.{name}", error),)))
            second.append(Branch(fresh, self._one(observer, solved, c, k, error)))
        return (*first, *second)

    def _seen(
        self, observer: Observer, solved: SolvedNames, c: Matrix, name: str, known: Names
    ) -> Expr:
        state: dict[str, Expr] = {name: Ref(f"state.{name}") for name in self.states}
        parts = solved.row("C", c, name, state)
        if name in observer.g:
            parts.append(expression(observer.g[name].tree, known))
        return total(parts)

    def _one(
        self, observer: Observer, solved: SolvedNames, c: Matrix, k: int, error: Expr
    ) -> Block:
        name = tuple(observer.measures)[k]
        states = self.states
        variance = Ref(solved.of("R", name, "").rstrip("."))
        ops: list[Op] = [Assign("work.residual", error)]
        for row in states:
            old: dict[str, Expr] = {column: self._covariance(row, column) for column in states}
            ops.append(Assign(f"work.pc_{row}", total(solved.row("C", c, name, old))))
        pc: dict[str, Expr] = {row: Ref(f"work.pc_{row}") for row in states}
        spread = add(total(solved.row("C", c, name, pc)), variance)
        ops.append(Assign("work.spread", Call("max", (spread, variance))))
        for row in states:
            ops.append(Assign(f"work.gain_{row}", divide(pc[row], Ref("work.spread"))))
            moved = times(Ref(f"work.gain_{row}"), Ref("work.residual"))
            ops += stored(self.automaton, row, add(Ref(f"state.{row}"), moved))
        for row, column in self._pairs():
            less_by = times(Ref(f"work.gain_{row}"), pc[column])
            old_entry = Ref(_entry(row, column))
            ops.append(Assign(old_entry.name, subtract(old_entry, less_by)))
        return (*ops, *self._bounded(observer))

    def _bounded(self, observer: Observer) -> list[Op]:
        """Variances within their limits, covariances within what these allow; else a fault bit."""
        limits = {}
        for name, pair in observer.limits.items():
            low, high = (constant_value(f, self.automaton, self.values, "a limit") for f in pair)
            limits[name] = (low, high)
        ops: list[Op] = []
        for row, column in self._pairs():
            if row not in limits or column not in limits:
                continue
            high = math.sqrt(limits[row][1]) * math.sqrt(limits[column][1])
            low = limits[row][0] if row == column else -high
            if row == column:
                high = limits[row][1]
            entry = Ref(_entry(row, column))
            inside = Binary(
                "and", Compare(">=", entry, real(low)), Compare("<=", entry, real(high))
            )
            clipped = Assign(entry.name, Call("clip", (entry, real(low), real(high))))
            ops.append(Branch(Unary("not", inside), (FaultBit(COVARIANCE_RANGE), clipped)))
        return ops


def _varies(automaton: Automaton, formula: Formula) -> bool:
    memory = any(isinstance(part, Application) and part.function == "previous"
                 for part in walk(formula.tree))  # fmt: skip
    reads = {read.path for read in names_of(formula.tree)}
    return memory or not reads <= set(automaton.parameters)


def _at_rest(formula: Formula, automaton: Automaton, values: Mapping[str, Scalar]) -> float:
    """Return a density while all inputs and states are 0."""
    known: dict[str, Expr] = {n: real(0.0) for n in (*automaton.inputs, *automaton.states)}
    known.update(constant_names(automaton))
    for part in walk(formula.tree):
        if isinstance(part, Application) and part.function == "previous":
            known[memory_key(part)] = real(0.0)
    return float(evaluate(expression(formula.tree, known), values))
