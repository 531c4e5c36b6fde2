"""Steady Kalman filter: prediction over a period and correction by a constant gain.

x(k|k-1) = Phi x(k-1) + G (B u(k-1) + f), x(k) = x(k|k-1) + L (y(k) - C x(k|k-1) - g). Phi = e^(A
T), G is its integral over the period, and L solves the discrete Riccati equation with the noise
covariance of Van Loan (Grewal and Andrews 2001, section 4.2; Van Loan 1978).
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field

from language.expressions.units import rate_dimension
from language.ir.ops import (
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
    sum_of,
)
from language.ir.program import Constant, ObserverInfo, Variable
from language.lowering.constants import evaluate_constant
from language.lowering.expressions import NameBindings, lower_expression
from language.lowering.observer_matrices import derive_observer_matrices
from language.lowering.program_parameters import tunables_of
from language.lowering.range_saturation import store_saturated
from language.model.automaton import Automaton, Mode, Observer
from language.model.declaration import Formula
from language.numerics.evaluate import Scalar
from language.numerics.matrix import Matrix, expm, expm_integral, multiply
from language.numerics.riccati import discretise_noise, steady_kalman_gain
from language.observers.numeric_matrices import numeric_diagonal, numeric_matrix, output_matrix
from language.text.diagnostic import Problems


@dataclass(frozen=True)
class LoweredObserver:
    """The operations and constants of the observer of one mode.

    `initial_covariance` sets P at the first tick, `entry_covariance` on entry of the mode.
    `covariance_blocks` are blocks that `predict` and `correct` run.
    """

    predict: Block
    correct: Block
    constants: tuple[Constant, ...]
    info: ObserverInfo
    initial_covariance: Block = ()
    entry_covariance: Block = ()
    covariance_blocks: Mapping[str, Block] = field(default_factory=dict)


def lower_steady_observer(
    automaton: Automaton,
    mode: Mode,
    before: NameBindings,
    now: NameBindings,
    values: Mapping[str, Scalar],
    problems: Problems,
) -> LoweredObserver | None:
    """Return the observer of a mode; None if its matrices cannot be computed, which is reported.

    This includes a Riccati equation without a solution. `before` are the bindings during the
    prediction: present states, inputs of the previous tick. `now` are those during the correction.
    `values` are the values of the constants.
    """
    assert mode.observer and automaton.period is not None
    observer = derive_observer_matrices(automaton, mode.name, mode.observer, values, problems)
    if observer is None:
        return None
    period = float(automaton.period)
    with problems.collect_errors():
        a = numeric_matrix(automaton, values, observer.a, observer.states, observer.states, "A")
        b = numeric_matrix(automaton, values, observer.b, observer.states, observer.inputs, "B")
        c = output_matrix(automaton, values, observer)
        q = numeric_diagonal(automaton, values, observer.process_noise, observer.states)
        r = numeric_diagonal(
            automaton, values, observer.measurement_noise, tuple(observer.measures)
        )
        try:
            phi, held = expm(a, period), expm_integral(a, period)
            gain, _ = steady_kalman_gain(phi, discretise_noise(a, q, period), c, r)
        except ValueError as error:
            problems.error("observer", observer.span, f"the observer has no steady gain: {error}")
            return None
        gamma = multiply(held, b) if observer.inputs else ()
        numbers = {"Phi": phi, "Gamma": gamma, "G": held, "L": gain, "C": c}
        own = {name: Ref(f"solved.{name}") for name in observer.constants}
        known = ({**before, **own}, {**now, **own})
        lowered = _assemble_observer(automaton, mode, observer, known, numbers, (a, b, c, q, r))
        more = offset_constants(automaton, observer, values)
        return dataclasses.replace(lowered, constants=(*lowered.constants, *more))
    return None


def offset_constants(
    automaton: Automaton, observer: Observer, values: Mapping[str, Scalar]
) -> tuple[Constant, ...]:
    """Return the constant parts of f and g as constants `solved.<name>`.

    The names are those of `observer.constants`. Raises SpecError if a part reads anything but
    parameters or is not finite.
    """
    return tuple(
        Constant(
            f"solved.{name}",
            "solved",
            evaluate_constant(formula, automaton, values, "what remains"),
            depends_on=tunables_of(automaton, [formula]),
        )
        for name, formula in observer.constants.items()
    )


def observer_variables(automaton: Automaton) -> list[Variable]:
    """Return the variables that the observers of an automaton use, each once.

    Each state has `work.predicted_<state>` and `work.f_<state>`, each measured input
    `innovation.<input>`.
    """
    found: dict[str, Variable] = {}
    for mode in automaton.modes.values():
        if mode.observer is None:
            continue
        for name in mode.observer.states:
            dimension = automaton.states[name].unit.dimension
            found[f"p{name}"] = Variable(f"work.predicted_{name}", "real", str(dimension))
            found[f"f{name}"] = Variable(f"work.f_{name}", "real", str(rate_dimension(dimension)))
        for name in mode.observer.measures:
            unit = str(automaton.inputs[name].unit.dimension)
            about = f"{name} minus its prediction, 0 where there is no new value"
            found[f"i{name}"] = Variable(f"innovation.{name}", "real", unit, about=about)
    return list(found.values())


def _assemble_observer(
    automaton: Automaton,
    mode: Mode,
    observer: Observer,
    known: tuple[NameBindings, NameBindings],
    matrices: Mapping[str, Matrix],
    model_matrices: tuple[Matrix, Matrix, Matrix, Matrix, Matrix],
) -> LoweredObserver:
    """Return the operations, constants and description of an observer with known matrices.

    `known` are the bindings of prediction and correction; `model_matrices` are A, B, C, Q and R.
    """
    names = SolvedNames(mode.name, observer)
    depends_on = tunables_of(automaton, solved_formulas(observer))
    constants = names.nonzero_constants(matrices, depends_on)
    prefix = f"{automaton.name} "
    info = ObserverInfo(
        mode=mode.name,
        states=observer.states,
        inputs=observer.inputs,
        measures=tuple(observer.measures),
        a=model_matrices[0],
        b=model_matrices[1],
        c=model_matrices[2],
        process_noise=model_matrices[3],
        measurement_noise=model_matrices[4],
        period=float(automaton.period or 0),
        solved={constant.name: constant.name for constant in constants},
    )
    predict = predict_mean(automaton, observer, names, matrices, known[0], prefix)
    correct = _correct_mean(automaton, observer, names, matrices, known[1])
    return LoweredObserver(predict, correct, constants, info)


@dataclass(frozen=True)
class SolvedNames:
    """The names of an observer's solved constants: `solved.<mode>_<letter>.<row>.<column>`."""

    mode: str
    observer: Observer

    def entry(self, letter: str, row: str, column: str) -> str:
        """Return the name of an entry of a matrix: `solved.<mode>_<letter>.<row>.<column>`."""
        return f"solved.{self.mode}_{letter}.{row}.{column}"

    def row_and_column_names(self, letter: str) -> tuple[tuple[str, ...], tuple[str, ...]]:
        """Return the names of the rows and of the columns of a matrix.

        Gamma is (states, inputs), L (states, measures), C (measures, states); Phi, G and all other
        letters are (states, states).
        """
        states, measures = self.observer.states, tuple(self.observer.measures)
        return {
            "Phi": (states, states),
            "Gamma": (states, self.observer.inputs),
            "G": (states, states),
            "L": (states, measures),
            "C": (measures, states),
        }.get(letter, (states, states))

    def nonzero_constants(
        self, matrices: Mapping[str, Matrix], depends_on: tuple[str, ...]
    ) -> tuple[Constant, ...]:
        """Return the nonzero entries of matrices as solved constants, row by row.

        Columns of G of states without an offset f are left out. `depends_on` are the tunable
        parameters.
        """
        found = []
        for letter, matrix in matrices.items():
            rows, columns = self.row_and_column_names(letter)
            for row, entries in zip(rows, matrix, strict=bool(matrix)):
                for column, value in zip(columns, entries, strict=True):
                    if value != 0.0 and not _is_omitted(letter, column, self.observer):
                        name = self.entry(letter, row, column)
                        found.append(Constant(name, "solved", value, depends_on=depends_on))
        return tuple(found)

    def row_products(
        self, letter: str, matrix: Matrix, row: str, values: Mapping[str, Expr]
    ) -> list[Expr]:
        """Return the products of a row of a matrix with values by column, without zero entries.

        Columns without a value are left out; a factor of 1 is not written. An empty matrix gives an
        empty list.
        """
        rows, columns = self.row_and_column_names(letter)
        if not matrix:
            return []
        return [
            values[column]
            if value == 1.0
            else times(Ref(self.entry(letter, row, column)), values[column])
            for column, value in zip(columns, matrix[rows.index(row)], strict=True)
            if value != 0.0 and column in values
        ]


def _is_omitted(letter: str, column: str, observer: Observer) -> bool:
    """Return whether no operation reads a column of a matrix: one of G without an offset f."""
    return letter == "G" and column not in observer.f


def predict_mean(
    automaton: Automaton,
    observer: Observer,
    names: SolvedNames,
    matrices: Mapping[str, Matrix],
    before: NameBindings,
    prefix: str,
) -> Block:
    """Return the operations that predict the states over a period and store them, saturated.

    x = Phi x + Gamma u + G f, with `matrices` by these letters. f is evaluated first as
    `work.f_<state>`, with the names in `before`; all predictions are evaluated before the first one
    is stored. `prefix` opens the key paths.
    """
    state: dict[str, Expr] = {name: Ref(f"state.{name}") for name in observer.states}
    held = {name: before[name] for name in observer.inputs}
    ops: list[Op] = []
    free: dict[str, Expr] = {}
    for row, formula in observer.f.items():
        ops.append(
            Assign(f"work.f_{row}", lower_expression(formula.tree, before), prefix + formula.key)
        )
        free[row] = Ref(f"work.f_{row}")
    for row in observer.states:
        parts = names.row_products("Phi", matrices["Phi"], row, state)
        parts += names.row_products("Gamma", matrices["Gamma"], row, held)
        parts += names.row_products("G", matrices["G"], row, free)
        ops.append(Assign(f"work.predicted_{row}", sum_of(parts), prefix + observer.key))
    for row in observer.states:
        ops += store_saturated(automaton, row, Ref(f"work.predicted_{row}"))
    return tuple(ops)


def _correct_mean(
    automaton: Automaton,
    observer: Observer,
    names: SolvedNames,
    matrices: Mapping[str, Matrix],
    now: NameBindings,
) -> Block:
    """Return the operations that set the innovations and correct the states by the gain.

    The innovation of a measurement without a new value is 0.
    """
    state: dict[str, Expr] = {name: Ref(f"state.{name}") for name in observer.states}
    error: dict[str, Expr] = {name: Ref(f"innovation.{name}") for name in observer.measures}
    ops: list[Op] = []
    for name in observer.measures:
        parts = names.row_products("C", matrices["C"], name, state)
        if name in observer.g:
            parts.append(lower_expression(observer.g[name].tree, now))
        seen = sum_of(parts)
        fresh = has_new_measurement(observer, name)
        value = Select(fresh, subtract(now[name], seen), real(0.0))
        ops.append(Assign(f"innovation.{name}", value))
    for row in observer.states:
        parts = names.row_products("L", matrices["L"], row, error)
        if parts:
            ops += store_saturated(automaton, row, add(Ref(f"state.{row}"), sum_of(parts)))
    return tuple(ops)


def has_new_measurement(observer: Observer, measure: str) -> Expr:
    """Return the condition that a tick has a new value of a measurement to correct with.

    It is `is_new.<measure>`, and the input `correct` of the observer if that is declared.
    """
    fresh = Ref(f"is_new.{measure}")
    if observer.correct is None:
        return fresh
    return Binary("and", fresh, Ref(f"input.{observer.correct}"))


def solved_formulas(observer: Observer) -> list[Formula]:
    """Return the formulas that the solved numbers of an observer depend on.

    They are the entries of A, B and C, then process noise, measurement noise and unknown instants;
    f and g are not included.
    """
    rows = [*observer.a.values(), *observer.b.values(), *observer.c.values()]
    noise = [observer.process_noise, observer.measurement_noise, observer.unknown_instant]
    return [formula for row in [*rows, *noise] for formula in row.values()]
