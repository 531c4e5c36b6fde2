"""Correction of an observer for an input that changes at an unknown instant within a tick.

A sampled input took its new value at an instant of the last t seconds that is uniformly
distributed. A change by d that was s seconds ago has moved the states by d g(s), with dg/ds = A g +
b, g(0) = 0. The prediction, which used the previous value, is therefore corrected by the mean of d
g over s in [0, t], and P by its covariance. Both are solved numbers: z = (g, 1) has a linear flow,
so the integral of z z' is that of Van Loan 1978 with Q = z(0) z(0)'.
"""

from __future__ import annotations

from collections.abc import Mapping

from language.ir.ops import (
    Assign,
    Binary,
    Block,
    Branch,
    Compare,
    Op,
    Ref,
    add,
    multiply as times,
    real,
    subtract,
)
from language.ir.program import Constant, Variable
from language.lowering.constants import evaluate_constant
from language.lowering.expressions import NameBindings
from language.lowering.program_parameters import tunables_of
from language.lowering.range_saturation import store_saturated
from language.model.automaton import Automaton, Observer
from language.numerics.evaluate import Scalar
from language.numerics.matrix import Matrix
from language.numerics.riccati import discretise_noise
from language.observers.covariance_update import covariance_entry, state_pairs
from language.observers.numeric_matrices import numeric_matrix
from language.observers.steady_kalman import SolvedNames, solved_formulas
from language.text.diagnostic import Problems

CHANGE_VARIABLE = "work.change_{}"
"""The variable of the change of an input, as a format."""


def input_change_variables(automaton: Automaton) -> list[Variable]:
    """Return `work.change_<input>` for each input that changes at an unknown instant, each once."""
    modes = automaton.modes.values()
    observed = [mode.observer for mode in modes if mode.observer]
    named = dict.fromkeys(name for observer in observed for name in observer.unknown_instant)
    return [
        Variable(
            CHANGE_VARIABLE.format(name),
            "real",
            str(automaton.inputs[name].unit.dimension),
            about=f"by how much {name} has changed within this tick",
        )
        for name in named
    ]


def input_change_matrices(
    automaton: Automaton, values: Mapping[str, Scalar], observer: Observer, problems: Problems
) -> dict[str, Matrix]:
    """Return M_<input> (n, 1) and V_<input> (n, n), the moments of the effect of a change by 1.

    M is the mean and V the covariance over an instant that is uniform in the time of the input. An
    input without an entry in B, or with a time that is not positive, is reported and left out.
    Raises SpecError if a formula reads anything but parameters or is not finite.
    """
    states, found = observer.states, {}
    a = numeric_matrix(automaton, values, observer.a, states, states, "A")
    for name, formula in observer.unknown_instant.items():
        time = evaluate_constant(formula, automaton, values, "unknown_instant")
        if name not in observer.inputs or not time > 0.0:
            label = f"`{name}` enters no balance of the observer in a linear way"
            if not time > 0.0:
                label = f"the time within which `{name}` changed must be above zero"
            problems.error("observer", formula.span, label)
            continue
        b = numeric_matrix(automaton, values, observer.b, states, (name,), "B")
        found[f"M_{name}"], found[f"V_{name}"] = change_moments(a, b, time)
    return found


def change_moments(a: Matrix, b: Matrix, time: float) -> tuple[Matrix, Matrix]:
    """Return mean (n, 1) and covariance (n, n) of g(s) with s uniform in [0, time].

    dg/ds = A g + b, g(0) = 0. A (n, n) [unit_i/(unit_j s)], b (n, 1) [unit_i/(unit_u s)], time [s]
    > 0.
    """
    n = len(a)
    flow = (*((*a[i], b[i][0]) for i in range(n)), (0.0,) * (n + 1))
    one = tuple(tuple(float(i == j == n) for j in range(n + 1)) for i in range(n + 1))
    total = discretise_noise(flow, one, time)
    mean = tuple((total[i][n] / time,) for i in range(n))
    spread = tuple(
        tuple(total[i][j] / time - mean[i][0] * mean[j][0] for j in range(n)) for i in range(n)
    )
    return mean, spread


def correct_input_change(
    automaton: Automaton,
    solved: SolvedNames,
    known: tuple[NameBindings, NameBindings],
    values: Mapping[str, Scalar],
    problems: Problems,
) -> tuple[Block, tuple[Constant, ...]]:
    """Return the operations that correct states and P for changed inputs, and their constants.

    For each input of `unknown_instant` they set `work.change_<input>` to present minus previous
    value and, if it is not 0, add M times the change to the states and V times its square to P.
    `known` are the bindings of the previous and of the present tick. Faulty inputs are reported and
    left out (`input_change_matrices`).
    """
    numbers = input_change_matrices(automaton, values, solved.observer, problems)
    ops: list[Op] = []
    before, now = known
    for name in solved.observer.unknown_instant:
        if f"M_{name}" not in numbers:
            continue
        change = Ref(CHANGE_VARIABLE.format(name))
        ops.append(Assign(change.name, subtract(now[name], before[name])))
        differs = Binary("or", Compare("<", change, real(0.0)), Compare(">", change, real(0.0)))
        ops.append(Branch(differs, _apply_change(automaton, solved, numbers, name)))
    return tuple(ops), _solved_constants(automaton, solved, numbers)


def _solved_constants(
    automaton: Automaton, solved: SolvedNames, matrices: Mapping[str, Matrix]
) -> tuple[Constant, ...]:
    """Return the nonzero entries of the matrices M and V as solved constants."""
    found, states = [], solved.observer.states
    depends_on = tunables_of(automaton, solved_formulas(solved.observer))
    for letter, matrix in matrices.items():
        columns = (letter[2:],) if letter.startswith("M_") else states
        for row, entries in zip(states, matrix, strict=True):
            for column, value in zip(columns, entries, strict=True):
                if value != 0.0:
                    name = solved.entry(letter, row, column)
                    found.append(Constant(name, "solved", value, depends_on=depends_on))
    return tuple(found)


def _apply_change(
    automaton: Automaton, solved: SolvedNames, matrices: Mapping[str, Matrix], name: str
) -> Block:
    """Return x + M d and P + V d^2 for the change d of one input, without zero entries."""
    states, change = solved.observer.states, Ref(CHANGE_VARIABLE.format(name))
    ops: list[Op] = []
    for row, (mean,) in zip(states, matrices[f"M_{name}"], strict=True):
        if mean != 0.0:
            part = times(Ref(solved.entry(f"M_{name}", row, name)), change)
            ops += store_saturated(automaton, row, add(Ref(f"state.{row}"), part))
    for row, column in state_pairs(states):
        if matrices[f"V_{name}"][states.index(row)][states.index(column)] != 0.0:
            unit = times(Ref(solved.entry(f"V_{name}", row, column)), change)
            old = Ref(covariance_entry(row, column))
            ops.append(Assign(old.name, add(old, times(unit, change))))
    return tuple(ops)
