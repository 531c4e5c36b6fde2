"""Operations on the covariance P of a recursive observer: prediction, correction and limits.

P is stored once per pair of states, as `memory.P_<row>__<column>`, so rounding cannot make it
asymmetric.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from language.ir.ops import (
    Assign,
    Binary,
    Block,
    Branch,
    Call,
    Compare,
    Expr,
    FaultBit,
    Op,
    Ref,
    Unary,
    add,
    divide,
    multiply as times,
    real,
    subtract,
    sum_of,
)
from language.ir.program import Variable
from language.lowering.constants import evaluate_constant
from language.lowering.program_parameters import tunables_of
from language.lowering.range_saturation import store_saturated
from language.model.automaton import Automaton, Mode, Observer
from language.numerics.evaluate import Scalar
from language.numerics.matrix import Matrix
from language.observers.steady_kalman import SolvedNames
from language.text.diagnostic import Problems

COVARIANCE_RANGE = "covariance_range"
"""The fault bit of a covariance that leaves its limits."""
StateNames = tuple[str, ...]


@dataclass(frozen=True)
class PredictionMatrices:
    """The matrices of a prediction: Phi, Qd, and N_<state> for each density that is not constant.

    `name_prefix` opens the names of the solved constants. `a` is A (n, n) [unit_i/(unit_j s)]. Qd
    is the noise of the constant densities, N_<state> that of a unit density of one state.
    """

    name_prefix: str
    a: Matrix
    matrices: Mapping[str, Matrix]


def covariance_variables(automaton: Automaton) -> list[Variable]:
    """Return the variables of the recursive observers of an automaton, each once.

    They are the covariances of the upper triangle (`memory.P_<row>__<column>`), the products
    `work.t_<row>__<column>`, `work.pc_`, `work.gain_` and `work.density_` of each state,
    `work.spread` and `work.residual`. Without a recursive observer the list is empty.
    """
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
                    name = covariance_entry(row, column)
                    about = f"covariance of {row} and {column}"
                    found[name] = Variable(name, "real", unit, about=about)
            for what in ("pc", "gain", "density"):
                found[f"{what}{row}"] = Variable(f"work.{what}_{row}", "real")
        for name in ("spread", "residual"):
            found[name] = Variable(f"work.{name}", "real")
    return list(found.values())


def covariance_entry(row: str, column: str) -> str:
    """Return the variable `memory.P_<row>__<column>` of a covariance.

    `row` must not come after `column` in the order of the states.
    """
    return f"memory.P_{row}__{column}"


def state_pairs(states: StateNames) -> Iterator[tuple[str, str]]:
    """Yield the pairs (row, column) of the upper triangle, diagonal included, row by row."""
    for i, row in enumerate(states):
        for column in states[i:]:
            yield row, column


def covariance_rows_block(solved: SolvedNames, prediction: PredictionMatrices) -> Block:
    """Return the operations T = Phi P, the first half of P = Phi P Phi' + Qd.

    T is `work.t_<row>__<column>`; products with zero entries of Phi are left out.
    """
    states, phi = solved.observer.states, prediction.matrices["Phi"]
    ops: list[Op] = []
    for row in states:
        for column in states:
            old: dict[str, Expr] = {name: _symmetric_entry(states, name, column) for name in states}
            parts = solved.row_products("Phi", phi, row, old)
            ops.append(Assign(f"work.t_{row}__{column}", sum_of(parts)))
    return tuple(ops)


def covariance_columns_block(solved: SolvedNames, prediction: PredictionMatrices) -> Block:
    """Return the operations P = T Phi' + Qd for the upper triangle of P.

    Qd is that of constant densities plus N_<state> times `work.density_<state>` for varying ones.
    """
    states, phi = solved.observer.states, prediction.matrices["Phi"]
    ops: list[Op] = []
    for row, column in state_pairs(states):
        half: dict[str, Expr] = {name: Ref(f"work.t_{row}__{name}") for name in states}
        parts = solved.row_products("Phi", phi, column, half)
        parts += _process_noise_terms(solved, prediction, row, column)
        ops.append(Assign(covariance_entry(row, column), sum_of(parts)))
    return tuple(ops)


def correct_by_measurement(
    automaton: Automaton, solved: SolvedNames, c: Matrix, measure: str, residual: Expr
) -> Block:
    """Return the operations that correct states and P by one measurement.

    `residual` is the measured minus the expected value, `c` is C (measures, states), `measure` the
    row. The innovation variance is s = max(c P c' + r, r), since rounding may bring the sum below
    r; k = P c'/s; x + k residual, saturated; P - k c P (Bierman 1977, section II.6).
    """
    states = solved.observer.states
    variance = Ref(f"solved.{solved.mode}_R.{measure}")
    ops: list[Op] = [Assign("work.residual", residual)]
    for row in states:
        old: dict[str, Expr] = {column: _symmetric_entry(states, row, column) for column in states}
        ops.append(Assign(f"work.pc_{row}", sum_of(solved.row_products("C", c, measure, old))))
    pc: dict[str, Expr] = {row: Ref(f"work.pc_{row}") for row in states}
    size = add(sum_of(solved.row_products("C", c, measure, pc)), variance)
    ops.append(Assign("work.spread", Call("max", (size, variance))))
    for row in states:
        ops.append(Assign(f"work.gain_{row}", divide(pc[row], Ref("work.spread"))))
        moved = times(Ref(f"work.gain_{row}"), Ref("work.residual"))
        ops += store_saturated(automaton, row, add(Ref(f"state.{row}"), moved))
    for row, column in state_pairs(states):
        before = Ref(covariance_entry(row, column))
        less = times(Ref(f"work.gain_{row}"), pc[column])
        ops.append(Assign(before.name, subtract(before, less)))
    return tuple(ops)


def covariance_limit_blocks(
    automaton: Automaton, mode: Mode, values: Mapping[str, Scalar], problems: Problems
) -> dict[str, Block]:
    """Return the block `bound_<mode>` that limits P at the end of a tick, by its name.

    The dict is empty if the observer has no limits. Modes with the same limits share one block,
    named after the first of them. Wrong limits are reported (`variance_limits`).
    """
    observer = mode.observer
    assert observer
    if not observer.variance_limits:
        return {}
    limits = variance_limits(automaton, observer, values, problems)
    observers = {m.name: m.observer for m in automaton.modes.values() if m.observer}
    first = next(
        n for n, other in observers.items() if _limit_forms(other) == _limit_forms(observer)
    )
    return {f"bound_{first}": limit_covariance(observer.states, limits)}


def _limit_forms(observer: Observer) -> dict[str, object]:
    """Return the variance limits of an observer as comparable keys, by state."""
    return {n: (low.tree, high.tree) for n, (low, high) in observer.variance_limits.items()}


def variance_limits(
    automaton: Automaton, observer: Observer, values: Mapping[str, Scalar], problems: Problems
) -> dict[str, tuple[float, float]]:
    """Return the variance limits (low, high) of an observer, by state.

    A limit that reads a tunable parameter, or a pair without 0 <= low < high, is reported and still
    returned. Raises SpecError for a limit that is not made of parameters or not finite.
    """
    found = {}
    for name, pair in observer.variance_limits.items():
        if tunables_of(automaton, pair):
            label = "the limits of a variance are made of fixed values"
            problems.error("observer", pair[0].span, label)
        low, high = (evaluate_constant(limit, automaton, values, "a limit") for limit in pair)
        if not 0.0 <= low < high:
            label = f"the variance of `{name}` is kept from {low:g} to {high:g}"
            problems.error("observer", pair[0].span, label, "`[low, high]` with 0 <= low < high")
        found[name] = (low, high)
    return found


def limit_covariance(states: StateNames, limits: Mapping[str, tuple[float, float]]) -> Block:
    """Return the operations that clip P to its limits and set the fault bit `covariance_range`.

    A variance is clipped to (low, high), a covariance to +-sqrt(high_i high_j); the bit is set only
    if a value is outside. States without limits are left out.
    """
    ops: list[Op] = []
    for row, column in state_pairs(states):
        if row not in limits or column not in limits:
            continue
        low, high = limits[row]
        if row != column:
            high = math.sqrt(limits[row][1]) * math.sqrt(limits[column][1])
            low = -high
        value = Ref(covariance_entry(row, column))
        inside = Binary("and", Compare(">=", value, real(low)), Compare("<=", value, real(high)))
        clipped = Assign(value.name, Call("clip", (value, real(low), real(high))))
        ops.append(Branch(Unary("not", inside), (FaultBit(COVARIANCE_RANGE), clipped)))
    return tuple(ops)


def _symmetric_entry(states: StateNames, row: str, column: str) -> Ref:
    """Return the variable of P[row, column] in either order of the two states."""
    i, j = states.index(row), states.index(column)
    return Ref(covariance_entry(row, column) if i <= j else covariance_entry(column, row))


def _process_noise_terms(
    solved: SolvedNames, prediction: PredictionMatrices, row: str, column: str
) -> list[Expr]:
    """Return the terms of entry (row, column) of the process noise of a period."""
    states = solved.observer.states
    i, j = states.index(row), states.index(column)
    parts: list[Expr] = []
    if prediction.matrices["Qd"][i][j] != 0.0:
        parts.append(Ref(solved.entry("Qd", row, column)))
    for name in states:
        if f"N_{name}" in prediction.matrices and prediction.matrices[f"N_{name}"][i][j] != 0.0:
            unit = Ref(solved.entry(f"N_{name}", row, column))
            parts.append(times(Ref(f"work.density_{name}"), unit))
    return parts
