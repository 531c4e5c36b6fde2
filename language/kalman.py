"""Kalman: a steady observer as operations - prediction over a period, correction by a gain.

x(k|k-1) = Phi x(k-1) + G (B u(k-1) + f), x(k) = x(k|k-1) + L (y(k) - C x(k|k-1)); Phi = e^(A T),
G its integral, L from the discrete Riccati equation with Van Loan's noise covariance
(Grewal and Andrews 2001, section 4.2; Van Loan 1978).
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field

from language.constants import constant_value
from language.declaration import Formula
from language.derived import with_model
from language.entries import number_diagonal, number_matrix, output_matrix
from language.evaluate import Scalar
from language.limit import stored
from language.lower import Names, expression
from language.matrix import Matrix, exponential, exponential_integral, multiply
from language.model import Automaton, Mode, Observer
from language.operation import (
    Assign,
    Binary,
    Block,
    Expr,
    Op,
    Ref,
    Select,
    add,
    multiply as times,
    real,
    subtract,
    total,
)
from language.parameter import tunables_of
from language.problem import Problems
from language.program import Constant, ObserverInfo, Variable
from language.riccati import discrete_noise, steady_gain
from language.units import per_second


@dataclass(frozen=True)
class Kalman:
    """The operations and numbers of one mode's observer.

    `start` sets its covariance at the first tick, `enter` when its mode is entered; `spreads` are
    blocks that `predict` runs: its covariance over the period.
    """

    predict: Block
    correct: Block
    constants: tuple[Constant, ...]
    info: ObserverInfo
    start: Block = ()
    enter: Block = ()
    spreads: Mapping[str, Block] = field(default_factory=dict)


def kalman(
    automaton: Automaton,
    mode: Mode,
    before: Names,
    now: Names,
    values: Mapping[str, Scalar],
    problems: Problems,
) -> Kalman | None:
    """Return the observer of a mode; None where its numbers cannot be computed (reported).

    `before` says what names are during the prediction: states now, inputs of the tick before;
    `now` what they are during the correction.
    """
    assert mode.observer and automaton.period is not None
    observer = with_model(automaton, mode.name, mode.observer, values, problems)
    if observer is None:
        return None
    period = float(automaton.period)
    with problems.collecting():
        a = number_matrix(automaton, values, observer.a, observer.states, observer.states, "A")
        b = number_matrix(automaton, values, observer.b, observer.states, observer.inputs, "B")
        c = output_matrix(automaton, values, observer)
        q = number_diagonal(automaton, values, observer.process_noise, observer.states)
        r = number_diagonal(automaton, values, observer.measurement_noise, tuple(observer.measures))
        try:
            phi, held = exponential(a, period), exponential_integral(a, period)
            gain, _ = steady_gain(phi, discrete_noise(a, q, period), c, r)
        except ValueError as error:
            problems.error("observer", observer.span, f"the observer has no steady gain: {error}")
            return None
        gamma = multiply(held, b) if observer.inputs else ()
        numbers = {"Phi": phi, "Gamma": gamma, "G": held, "L": gain, "C": c}
        own = {name: Ref(f"solved.{name}") for name in observer.constants}
        known = ({**before, **own}, {**now, **own})
        built = _built(automaton, mode, observer, known, numbers, (a, b, c, q, r))
        more = rest_constants(automaton, observer, values)
        return dataclasses.replace(built, constants=(*built.constants, *more))
    return None


def rest_constants(
    automaton: Automaton, observer: Observer, values: Mapping[str, Scalar]
) -> tuple[Constant, ...]:
    """Return the constant parts of f and g."""
    return tuple(
        Constant(
            f"solved.{name}",
            "solved",
            constant_value(formula, automaton, values, "what remains"),
            depends_on=tunables_of(automaton, [formula]),
        )
        for name, formula in observer.constants.items()
    )


def observer_variables(automaton: Automaton) -> list[Variable]:
    """Return the variables that the observers of an automaton use."""
    found: dict[str, Variable] = {}
    for mode in automaton.modes.values():
        if mode.observer is None:
            continue
        for name in mode.observer.states:
            dimension = automaton.states[name].unit.dimension
            found[f"p{name}"] = Variable(f"work.predicted_{name}", "real", str(dimension))
            found[f"f{name}"] = Variable(f"work.f_{name}", "real", str(per_second(dimension)))
        for name in mode.observer.measures:
            unit = str(automaton.inputs[name].unit.dimension)
            about = f"{name} minus its prediction, 0 where there is no new value"
            found[f"i{name}"] = Variable(f"innovation.{name}", "real", unit, about=about)
    return list(found.values())


def _built(
    automaton: Automaton,
    mode: Mode,
    observer: Observer,
    known: tuple[Names, Names],
    numbers: Mapping[str, Matrix],
    given: tuple[Matrix, Matrix, Matrix, Matrix, Matrix],
) -> Kalman:
    names = SolvedNames(mode.name, observer)
    depends_on = tunables_of(automaton, solved_formulas(observer))
    constants = names.constants(numbers, depends_on)
    prefix = f"{automaton.name} "
    info = ObserverInfo(
        mode=mode.name,
        states=observer.states,
        inputs=observer.inputs,
        measures=tuple(observer.measures),
        a=given[0],
        b=given[1],
        c=given[2],
        process_noise=given[3],
        measurement_noise=given[4],
        period=float(automaton.period or 0),
        solved={constant.name: constant.name for constant in constants},
    )
    predict = mean_ahead(automaton, observer, names, numbers, known[0], prefix)
    correct = _correct(automaton, observer, names, numbers, known[1])
    return Kalman(predict, correct, constants, info)


@dataclass(frozen=True)
class SolvedNames:
    """Names of an observer's solved constants: `solved.<mode>_<letter>.<row>.<column>`."""

    mode: str
    observer: Observer

    def of(self, letter: str, row: str, column: str) -> str:
        """Return the name of an entry."""
        return f"solved.{self.mode}_{letter}.{row}.{column}"

    def sides(self, letter: str) -> tuple[tuple[str, ...], tuple[str, ...]]:
        """Return the names of the rows and columns of a matrix."""
        states, measures = self.observer.states, tuple(self.observer.measures)
        return {
            "Phi": (states, states),
            "Gamma": (states, self.observer.inputs),
            "G": (states, states),
            "L": (states, measures),
            "C": (measures, states),
        }.get(letter, (states, states))

    def constants(
        self, numbers: Mapping[str, Matrix], depends_on: tuple[str, ...]
    ) -> tuple[Constant, ...]:
        """Return the entries of some matrices that are not 0."""
        found = []
        for letter, matrix in numbers.items():
            rows, columns = self.sides(letter)
            for row, entries in zip(rows, matrix, strict=bool(matrix)):
                for column, value in zip(columns, entries, strict=True):
                    if value != 0.0 and not _left_out(letter, column, self.observer):
                        name = self.of(letter, row, column)
                        found.append(Constant(name, "solved", value, depends_on=depends_on))
        return tuple(found)

    def row(self, letter: str, matrix: Matrix, row: str, values: Mapping[str, Expr]) -> list[Expr]:
        """Return the products of a row with values by column; 0 is left out, 1 is no factor."""
        rows, columns = self.sides(letter)
        if not matrix:
            return []
        return [
            values[column]
            if value == 1.0
            else times(Ref(self.of(letter, row, column)), values[column])
            for column, value in zip(columns, matrix[rows.index(row)], strict=True)
            if value != 0.0 and column in values
        ]


def _left_out(letter: str, column: str, observer: Observer) -> bool:
    return letter == "G" and column not in observer.f


def mean_ahead(
    automaton: Automaton,
    observer: Observer,
    names: SolvedNames,
    numbers: Mapping[str, Matrix],
    before: Names,
    prefix: str,
) -> Block:
    """Return the prediction of the states over a period."""
    state: dict[str, Expr] = {name: Ref(f"state.{name}") for name in observer.states}
    held = {name: before[name] for name in observer.inputs}
    ops: list[Op] = []
    free: dict[str, Expr] = {}
    for row, formula in observer.f.items():
        ops.append(Assign(f"work.f_{row}", expression(formula.tree, before), prefix + formula.key))
        free[row] = Ref(f"work.f_{row}")
    for row in observer.states:
        parts = names.row("Phi", numbers["Phi"], row, state)
        parts += names.row("Gamma", numbers["Gamma"], row, held)
        parts += names.row("G", numbers["G"], row, free)
        ops.append(Assign(f"work.predicted_{row}", total(parts), prefix + observer.key))
    for row in observer.states:
        ops += stored(automaton, row, Ref(f"work.predicted_{row}"))
    return tuple(ops)


def _correct(
    automaton: Automaton,
    observer: Observer,
    names: SolvedNames,
    numbers: Mapping[str, Matrix],
    now: Names,
) -> Block:
    state: dict[str, Expr] = {name: Ref(f"state.{name}") for name in observer.states}
    error: dict[str, Expr] = {name: Ref(f"innovation.{name}") for name in observer.measures}
    ops: list[Op] = []
    for name in observer.measures:
        parts = names.row("C", numbers["C"], name, state)
        if name in observer.g:
            parts.append(expression(observer.g[name].tree, now))
        seen = total(parts)
        fresh = is_fresh(observer, name)
        value = Select(fresh, subtract(now[name], seen), real(0.0))
        ops.append(Assign(f"innovation.{name}", value))
    for row in observer.states:
        parts = names.row("L", numbers["L"], row, error)
        if parts:
            ops += stored(automaton, row, add(Ref(f"state.{row}"), total(parts)))
    return tuple(ops)


def is_fresh(observer: Observer, measure: str) -> Expr:
    """Return whether a tick has a new value of a measurement."""
    fresh = Ref(f"is_new.{measure}")
    if observer.correct is None:
        return fresh
    return Binary("and", fresh, Ref(f"input.{observer.correct}"))


def solved_formulas(observer: Observer) -> list[Formula]:
    """Return the formulas that the solved numbers of an observer come from."""
    rows = [*observer.a.values(), *observer.b.values(), *observer.c.values()]
    noise = [observer.process_noise, observer.measurement_noise, observer.unknown_instant]
    return [formula for row in [*rows, *noise] for formula in row.values()]
