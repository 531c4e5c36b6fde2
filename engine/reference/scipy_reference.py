"""Reference simulation: runs a system with the numerics of scipy and filterpy.

Continuous instances are integrated by scipy (engine/reference/scipy_stepper.py). Elementary
functions are those of numpy (engine/reference/numpy_functions.py), except in constant expressions,
which a Program contains as numbers. For sampled instances the solved numbers of observers are
recomputed; models that a mode `runs` inside a tick keep the methods of the Program. The loop over
instants is that of the engine, which accepts other steppers by the `Stepper` protocol.
"""

from __future__ import annotations

import dataclasses
from functools import partial

import numpy as np
from filterpy.common import van_loan_discretization
from scipy import linalg

from engine.interpreter.interpreter import Interpreter, Stepper
from engine.reference.numpy_functions import numpy_functions
from engine.reference.scipy_stepper import ScipyMethod, ScipyStepper
from engine.results.array_types import Reals
from engine.results.trajectory import Trajectory
from engine.simulation.simulate import simulate
from language.ir.program import ObserverInfo, Program
from language.model.system import Scenario, System
from language.text.diagnostic import DataError

NEGLIGIBLE_RATIO = 1e-9
"""Largest ratio to its matrix of an entry that the Program omits as 0 (rule 17f)."""


def simulate_reference(
    system: System, scenario: Scenario, method: ScipyMethod = "DOP853"
) -> Trajectory:
    """Return the trajectory of a system through a scenario by scipy and filterpy.

    It is `simulate` with the steppers of `reference_stepper`; `method` integrates continuous
    instances.
    """
    return simulate(system, scenario, partial(reference_stepper, method=method))


def simulate_with_scipy(system: System, scenario: Scenario, method: ScipyMethod) -> Trajectory:
    """Return the trajectory with continuous instances integrated by a scipy method.

    Sampled instances are interpreted with the solved numbers of the Program.
    """
    return simulate(system, scenario, partial(_scipy_integrated_stepper, method=method))


def reference_stepper(program: Program, method: ScipyMethod = "DOP853") -> Stepper:
    """Return a `ScipyStepper` for a continuous Program, else an interpreter with reference numbers.

    The numbers are those of `with_reference_numbers`, which may raise ValueError. Elementary
    functions are those of numpy.
    """
    if program.period is None:
        return ScipyStepper(program, method)
    return Interpreter(with_reference_numbers(program), numpy_functions(program.number_type))


def _scipy_integrated_stepper(program: Program, method: ScipyMethod) -> Stepper:
    """Return a scipy stepper for a continuous Program, else the interpreter."""
    return ScipyStepper(program, method) if program.period is None else Interpreter(program)


def with_reference_numbers(program: Program) -> Program:
    """Return a sampled Program with the numbers of its steady-gain observers recomputed.

    Constants of the same names get the values of `reference_numbers`; all others are unchanged.
    Raises ValueError if the Program omits an entry as 0 that is not negligible.
    """
    numbers: dict[str, float] = {}
    for info in program.observers:
        if info.gain == "steady":
            numbers.update(reference_numbers(info))
    constants = tuple(
        dataclasses.replace(constant, value=numbers.get(constant.name, constant.value))
        for constant in program.constants
    )
    return dataclasses.replace(program, constants=constants)


def reference_numbers(info: ObserverInfo) -> dict[str, float]:
    """Return the solved numbers of an observer by the names of their constants.

    A name is `solved.<mode>_<matrix>.<row>.<column>`. The matrices are Phi, G (n, n), Gamma (n,
    inputs), L (n, measures), C (measures, n). Entries that the Program omits as 0 are left out.
    Raises ValueError if such an entry is above `NEGLIGIBLE_RATIO` times the largest entry of its
    matrix; G is not checked.
    """
    states, measures = info.states, info.measures
    sides = {
        "Phi": (states, states),
        "Gamma": (states, info.inputs),
        "G": (states, states),
        "L": (states, measures),
        "C": (measures, states),
    }
    numbers = {}
    for letter, matrix in _observer_matrices(info).items():
        rows, columns = sides[letter]
        largest = float(np.max(np.abs(matrix), initial=0.0))
        for i, row in enumerate(rows):
            for j, column in enumerate(columns):
                name, value = f"solved.{info.mode}_{letter}.{row}.{column}", float(matrix[i, j])
                if name in info.solved:
                    numbers[name] = value
                elif letter != "G" and abs(value) > NEGLIGIBLE_RATIO * largest:
                    raise DataError(f"{name} is 0 in the Program, {value!r} by the libraries")
    return numbers


def _observer_matrices(info: ObserverInfo) -> dict[str, Reals]:
    """Return the matrices of an observer; G is the integral of e^(A s) over a period T [s].

    Phi and the noise covariance follow from Van Loan (1978); `van_loan_discretization` takes the
    noise as a factor, here the square root of the diagonal spectral density. L = P C' (C P C' +
    R)^-1, where P is the covariance before the correction and solves the discrete algebraic Riccati
    equation of (Phi', C').
    """
    n = len(info.states)
    a, c = np.array(info.a, dtype=float), np.array(info.c, dtype=float)
    b = np.array(info.b, dtype=float).reshape(n, len(info.inputs))
    r = np.array(info.measurement_noise, dtype=float)
    density = np.diag(np.array(info.process_noise, dtype=float))
    phi, noise = van_loan_discretization(a, np.diag(np.sqrt(density)), info.period)
    augmented = np.block([[a, np.eye(n)], [np.zeros((n, 2 * n))]])
    integral = linalg.expm(augmented * info.period)[:n, n:]
    p = linalg.solve_discrete_are(phi.T, c.T, noise, r)
    gain = linalg.solve(c @ p @ c.T + r, c @ p).T
    return {"Phi": phi, "Gamma": integral @ b, "G": integral, "L": gain, "C": c}
