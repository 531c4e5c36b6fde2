"""Recursive Kalman filter: P is part of the state, and measurements are processed one by one.

Prediction P = Phi P Phi' + Qd. For each measurement y = c x + v of variance r: s = c P c' + r, k =
P c'/s, x + k (y - c x), P - k c P (Bierman 1977, Factorization Methods for Discrete Sequential
Estimation, section II.6). P is stored once per pair of states, so rounding cannot make it
asymmetric. Qd is linear in the spectral densities; a density that is not constant is evaluated each
tick.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping

from language.expressions.syntax_tree import FunctionCall, memory_key, names as names_of, walk
from language.ir.ops import (
    Assign,
    Block,
    Branch,
    Expr,
    Op,
    Ref,
    RunBlock,
    Switch,
    real,
    subtract,
    sum_of,
)
from language.ir.program import Constant, ObserverInfo
from language.lowering.expressions import NameBindings, lower_expression
from language.lowering.observer_matrices import derive_observer_matrices
from language.lowering.program_parameters import constant_bindings, tunables_of
from language.model.automaton import Automaton, Mode, ModelRun, Observer
from language.model.declaration import Formula
from language.numerics.evaluate import Scalar, evaluate
from language.numerics.matrix import (
    Matrix,
    expm,
    expm_integral,
    identity,
    multiply,
    subtract as less,
)
from language.numerics.riccati import discretise_noise, steady_kalman_gain
from language.observers.covariance_update import (
    PredictionMatrices,
    correct_by_measurement,
    covariance_columns_block,
    covariance_entry,
    covariance_limit_blocks,
    covariance_rows_block,
    state_pairs,
)
from language.observers.input_change import correct_input_change
from language.observers.numeric_matrices import numeric_diagonal, numeric_matrix, output_matrix
from language.observers.steady_kalman import (
    LoweredObserver,
    SolvedNames,
    has_new_measurement,
    offset_constants,
    predict_mean,
    solved_formulas,
)
from language.text.diagnostic import Problems


def is_time_varying(automaton: Automaton, formula: Formula) -> bool:
    """Return whether a spectral density reads a name that is no parameter, or calls `previous`."""
    memory = any(isinstance(part, FunctionCall) and part.function == "previous"
                 for part in walk(formula.tree))  # fmt: skip
    reads = {read.path for read in names_of(formula.tree)}
    return memory or not reads <= set(automaton.parameters)


def density_at_rest(formula: Formula, automaton: Automaton, values: Mapping[str, Scalar]) -> float:
    """Return the value of a spectral density while all inputs, states and `previous` values are 0.

    `values` are those of the constants by name in the Program.
    """
    known: dict[str, Expr] = {n: real(0.0) for n in (*automaton.inputs, *automaton.states)}
    known.update(constant_bindings(automaton))
    for part in walk(formula.tree):
        if isinstance(part, FunctionCall) and part.function == "previous":
            known[memory_key(part)] = real(0.0)
    return float(evaluate(lower_expression(formula.tree, known), values))


def lower_recursive_observer(
    automaton: Automaton,
    mode: Mode,
    before: NameBindings,
    now: NameBindings,
    values: Mapping[str, Scalar],
    problems: Problems,
) -> LoweredObserver | None:
    """Return the observer of a mode; None if its matrices cannot be computed, which is reported.

    `before` are the bindings during the prediction, `now` those during the correction, `values` the
    values of the constants. The states are predicted by the matrices, or by the run of the mode if
    the observer says so. Also reported are states that differ from those of the first recursive
    observer, a missing steady covariance and wrong limits.
    """
    assert mode.observer and automaton.period is not None
    with problems.collect_errors():
        try:
            return _RecursiveObserverBuilder(
                automaton, mode, (before, now), values, problems
            ).build()
        except ValueError as error:
            label = f"the observer has no solution: {error}"
            problems.error("observer", mode.observer.span, label)
    return None


class _RecursiveObserverBuilder:
    """Builder of the operations and constants of the observer of one mode."""

    def __init__(
        self,
        automaton: Automaton,
        mode: Mode,
        known: tuple[NameBindings, NameBindings],
        values: Mapping[str, Scalar],
        problems: Problems,
    ) -> None:
        assert mode.observer
        self.automaton, self.mode, self.values, self.problems = automaton, mode, values, problems
        self.before, self.now = known
        self.period = float(automaton.period or 0)
        self.states = mode.observer.states
        noise = mode.observer.process_noise
        self.varying_densities = {n: f for n, f in noise.items() if is_time_varying(automaton, f)}
        self.depends_on: tuple[str, ...] = ()

    def build(self) -> LoweredObserver | None:
        """Return the lowered observer; None if the derivation of its matrices was reported."""
        written = self.mode.observer
        assert written
        if written.predicts_by_run and self.mode.run:
            written = dataclasses.replace(written, of=self.mode.run.mode)
        observer = derive_observer_matrices(
            self.automaton, self.mode.name, written, self.values, self.problems
        )
        if observer is None:
            return None
        self._check_same_states()
        self.depends_on = tunables_of(self.automaton, solved_formulas(observer))
        c = output_matrix(self.automaton, self.values, observer)
        measured = tuple(observer.measures)
        r = numeric_diagonal(self.automaton, self.values, observer.measurement_noise, measured)
        own = self._prediction_matrices(observer, self.mode.name)
        constants = self._solved_constants(observer, own, c, r)
        constants += offset_constants(self.automaton, observer, self.values)
        start, enter, more = self._steady_covariance(observer, own, c, r)
        constants += more
        if observer.predicts_by_run:
            predict, extra, spreads = self._predict_by_run(written)
            constants += extra
        else:
            mean, extra = self._predict_mean(observer, own)
            spreads = self._covariance_blocks(observer, own)
            late, more = self._correct_input_change(observer, self.mode.name)
            predict = (RunBlock(f"propagate_{self.mode.name}"), *mean, *late)
            constants += extra + more
        info = ObserverInfo(
            self.mode.name, self.states, observer.inputs, measured, own.a, (), c,
            (), r, self.period, {}, "recursive",
        )  # fmt: skip
        bounds = covariance_limit_blocks(self.automaton, self.mode, self.values, self.problems)
        correct = (*self._correct_block(observer, c), *map(RunBlock, bounds))
        return LoweredObserver(
            predict, correct, tuple(constants), info, start, enter, {**spreads, **bounds}
        )

    def _check_same_states(self) -> None:
        """Report an observer whose states differ from those of the first one: they share P."""
        observers = (mode.observer for mode in self.automaton.modes.values())
        first = next(o for o in observers if o and o.gain == "recursive")
        if self.states != first.states:
            label = "recursive observers of an automaton have the same states in the same order"
            assert self.mode.observer
            self.problems.error("observer", self.mode.observer.span, label)

    def _prediction_matrices(self, observer: Observer, tag: str) -> PredictionMatrices:
        """Return Phi, Qd and N_<state> of an observer over a period; `tag` opens the names."""
        states, h = self.states, self.period
        a = numeric_matrix(self.automaton, self.values, observer.a, states, states, "A")
        fixed = {n: f for n, f in observer.process_noise.items() if n not in self.varying_densities}
        q = numeric_diagonal(self.automaton, self.values, fixed, states)
        numbers = {"Phi": expm(a, h), "Qd": discretise_noise(a, q, h)}
        for name in self.varying_densities:
            one = tuple(
                tuple(1.0 if row == column == name else 0.0 for column in states) for row in states
            )
            numbers[f"N_{name}"] = discretise_noise(a, one, h)
        return PredictionMatrices(tag, a, numbers)

    def _solved_constants(
        self, observer: Observer, prediction: PredictionMatrices, c: Matrix, r: Matrix
    ) -> tuple[Constant, ...]:
        """Return the constants of a prediction, of C and of the measurement variances R."""
        measured = {"C": c} if c else {}
        found = SolvedNames(prediction.name_prefix, observer).nonzero_constants(
            {**prediction.matrices, **measured}, self.depends_on
        )
        variances = []
        for k, name in enumerate(observer.measures):
            solved = f"solved.{prediction.name_prefix}_R.{name}"
            variances.append(Constant(solved, "solved", r[k][k], depends_on=self.depends_on))
        return (*found, *variances)

    def _steady_covariance(
        self, observer: Observer, prediction: PredictionMatrices, c: Matrix, r: Matrix
    ) -> tuple[Block, Block, tuple[Constant, ...]]:
        """Return the assignments of the steady P before and after a correction, and constants.

        The first block initialises P at the start; the second one sets P on entry and is empty
        unless `covariance: steady`. Densities that are not constant have their value at rest.
        Without a steady covariance a problem is reported, except for `covariance: keep` outside the
        initial mode.
        """
        noise = prediction.matrices["Qd"]
        for name, formula in self.varying_densities.items():
            size = density_at_rest(formula, self.automaton, self.values)
            part = prediction.matrices[f"N_{name}"]
            noise = tuple(
                tuple(x + size * y for x, y in zip(p, q, strict=True))
                for p, q in zip(noise, part, strict=True)
            )
        try:
            gain, ahead = steady_kalman_gain(prediction.matrices["Phi"], noise, c, r)
        except ValueError as error:
            if observer.covariance == "keep" and self.mode.name != self.automaton.initial:
                return (), (), ()
            label = f"the observer has no steady covariance to start with: {error}"
            self.problems.error("observer", observer.span, label)
            return (), (), ()
        after = multiply(less(identity(len(self.states)), multiply(gain, c)), ahead)
        solved = SolvedNames(self.mode.name, observer)
        numbers = {"P": ahead} | ({"Pe": after} if observer.covariance == "steady" else {})
        constants = solved.nonzero_constants(numbers, self.depends_on)
        known = {constant.name for constant in constants}
        start, enter = (
            tuple(
                Assign(covariance_entry(i, j), Ref(name) if name in known else real(0.0))
                for i, j in state_pairs(self.states)
                for name in [solved.entry(letter, i, j)]
            )
            for letter in ("P", "Pe")
        )
        return start, enter if observer.covariance == "steady" else (), constants

    def _predict_mean(
        self, observer: Observer, prediction: PredictionMatrices
    ) -> tuple[Block, tuple[Constant, ...]]:
        """Return the prediction of the states by Phi and the inputs, with its constants."""
        states = self.states
        b = numeric_matrix(self.automaton, self.values, observer.b, states, observer.inputs, "B")
        held = expm_integral(prediction.a, self.period)
        numbers = {"G": held, "Gamma": multiply(held, b) if observer.inputs else ()}
        solved = SolvedNames(self.mode.name, observer)
        more = {name: Ref(f"solved.{name}") for name in observer.constants}
        known = {**self.before, **more}
        prefix = f"{self.automaton.name} "
        mean = predict_mean(
            self.automaton, observer, solved, {**prediction.matrices, **numbers}, known, prefix
        )
        return mean, solved.nonzero_constants(numbers, self.depends_on)

    def _predict_by_run(
        self, written: Observer
    ) -> tuple[Block, tuple[Constant, ...], Mapping[str, Block]]:
        """Return the prediction by a run, its constants and its blocks.

        P is predicted by the mode of the model in which the run begins the period, the states by
        the run.
        """
        run, model = self.mode.run, self.automaton.model
        assert run and model
        modes = model.modes.values() if run.follow else [model.modes[run.mode]]
        cases: list[tuple[int, Block]] = []
        after: list[tuple[int, Block]] = []
        spreads: dict[str, Block] = {}
        constants: tuple[Constant, ...] = ()
        for mode in modes:
            there = dataclasses.replace(written, of=mode.name)
            tag = f"{self.mode.name}_{mode.name}"
            observer = derive_observer_matrices(
                self.automaton, tag, there, self.values, self.problems
            )
            if observer:
                ahead = self._prediction_matrices(observer, tag)
                solved = SolvedNames(tag, observer)
                depends_on = tunables_of(self.automaton, solved_formulas(observer))
                constants += solved.nonzero_constants(ahead.matrices, depends_on)
                spreads |= self._covariance_blocks(observer, ahead)
                cases.append((mode.number, (RunBlock(f"propagate_{tag}"),)))
                late, more = self._correct_input_change(observer, tag)
                constants += more
                if late:
                    spreads[f"input_change_{tag}"] = late
                    after.append((mode.number, (RunBlock(f"input_change_{tag}"),)))
        chosen = self._choose_by_run_mode(run, cases)
        predict = (
            *chosen,
            RunBlock(f"run_{self.mode.name}"),
            *self._choose_by_run_mode(run, after),
        )
        return predict, constants, spreads

    def _choose_by_run_mode(self, run: ModelRun, cases: list[tuple[int, Block]]) -> Block:
        """Return the block of the model's mode; a run without `follow` has only one."""
        if run.follow and cases:
            return (Switch("memory.run_mode", tuple(cases)),)
        return cases[0][1] if cases else ()

    def _correct_input_change(
        self, observer: Observer, tag: str
    ) -> tuple[Block, tuple[Constant, ...]]:
        """Return the correction for inputs that changed at an unknown instant, and constants."""
        solved, known = SolvedNames(tag, observer), (self.before, self.now)
        ops, constants = correct_input_change(
            self.automaton, solved, known, self.values, self.problems
        )
        return ops, constants

    def _covariance_blocks(
        self, observer: Observer, prediction: PredictionMatrices
    ) -> dict[str, Block]:
        """Return the blocks of the prediction of P: densities, then its rows, then its columns."""
        ops: list[Op] = []
        for name, formula in self.varying_densities.items():
            key = f"{self.automaton.name} {formula.key}"
            ops.append(
                Assign(f"work.density_{name}", lower_expression(formula.tree, self.now), key)
            )
        solved, tag = SolvedNames(prediction.name_prefix, observer), prediction.name_prefix
        return {
            f"propagate_{tag}": (*ops, RunBlock(f"rows_{tag}"), RunBlock(f"columns_{tag}")),
            f"rows_{tag}": covariance_rows_block(solved, prediction),
            f"columns_{tag}": covariance_columns_block(solved, prediction),
        }

    def _correct_block(self, observer: Observer, c: Matrix) -> Block:
        """Return the innovations against the prediction, then the corrections in their order."""
        solved = SolvedNames(self.mode.name, observer)
        more = {name: Ref(f"solved.{name}") for name in observer.constants}
        known = {**self.now, **more}
        first: list[Op] = []
        second: list[Op] = []
        for name in observer.measures:
            fresh = has_new_measurement(observer, name)
            seen = self._expected_measurement(observer, solved, c, name, known)
            error = subtract(known[name], seen)
            first.append(Branch(fresh, (Assign(f"innovation.{name}", error),)))
            second.append(
                Branch(fresh, correct_by_measurement(self.automaton, solved, c, name, error))
            )
        return (*first, *second)

    def _expected_measurement(
        self, observer: Observer, solved: SolvedNames, c: Matrix, name: str, known: NameBindings
    ) -> Expr:
        """Return the expected value of a measurement: its row of C times x, plus g."""
        state: dict[str, Expr] = {name: Ref(f"state.{name}") for name in self.states}
        parts = solved.row_products("C", c, name, state)
        if name in observer.g:
            parts.append(lower_expression(observer.g[name].tree, known))
        return sum_of(parts)
