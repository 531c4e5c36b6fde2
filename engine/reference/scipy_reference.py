"""Reference: the same system through scipy and filterpy instead of our own numerics.

Of a continuous Program only its field and its instants are kept, scipy integrates: see
engine/reference/scipy_stepper.py. Of a sampled Program the numbers of its observers are computed anew; what
a mode `runs` inside a tick stays ours. The loop over instants is the engine's, through the Stepper
protocol.
"""

from __future__ import annotations

import dataclasses
from functools import partial

import numpy as np
from filterpy.common import van_loan_discretization
from numpy.typing import NDArray
from scipy import linalg

from engine.interpreter.interpreter import Interpreter, Stepper
from engine.reference.scipy_stepper import ScipyMethod, ScipyStepper
from engine.results.trajectory import Trajectory
from engine.simulation.simulate import simulate
from language.ir.program import ObserverInfo, Program
from language.model.system import Scenario, System

Reals = NDArray[np.float64]

NEGLIGIBLE_RATIO = 1e-9
"""Most that a number taken as 0 may be of its matrix: the agreement promised (rule 17f)."""


def simulate_reference(
    system: System, scenario: Scenario, method: ScipyMethod = "DOP853"
) -> Trajectory:
    """Return the trajectory of a system through a scenario, by independent libraries."""
    return simulate(system, scenario, partial(reference_stepper, method=method))


def simulate_with_scipy(system: System, scenario: Scenario, method: ScipyMethod) -> Trajectory:
    """Return a trajectory for which scipy integrates; sampled automata keep our numbers."""
    return simulate(system, scenario, partial(_scipy_integrated_stepper, method=method))


def reference_stepper(program: Program, method: ScipyMethod = "DOP853") -> Stepper:
    """Return what runs a Program with the numerics of scipy and filterpy."""
    if program.period is None:
        return ScipyStepper(program, method)
    return Interpreter(with_reference_numbers(program))


def _scipy_integrated_stepper(program: Program, method: ScipyMethod) -> Stepper:
    return ScipyStepper(program, method) if program.period is None else Interpreter(program)


def with_reference_numbers(program: Program) -> Program:
    """Return a sampled Program with the solved numbers of its observers by scipy and filterpy.

    ValueError: a number that is not negligible was taken as 0, so that nothing can be replaced.
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
    """Return an observer's solved numbers by the name of their constant; its zeros have none.

    Phi, G (n, n), Gamma (n, inputs), L (n, measures), C (measures, n).
    """
    states, measures = info.states, info.measures
    sides = {
        "Phi": (states, states),
        "Gamma": (states, info.inputs),
        "G": (states, states),
        "L": (states, measures),
        "C": (measures, states),
    }
    found = {}
    for letter, matrix in _observer_matrices(info).items():
        rows, columns = sides[letter]
        largest = float(np.max(np.abs(matrix), initial=0.0))
        for i, row in enumerate(rows):
            for j, column in enumerate(columns):
                name, value = f"solved.{info.mode}_{letter}.{row}.{column}", float(matrix[i, j])
                if name in info.solved:
                    found[name] = value
                elif letter != "G" and abs(value) > NEGLIGIBLE_RATIO * largest:
                    raise ValueError(f"{name} is 0 in the Program, {value!r} by the libraries")
    return found


def _observer_matrices(info: ObserverInfo) -> dict[str, Reals]:
    """Return the matrices of an observer; G = integral of e^(A s) over a period T [s].

    Noise enters van_loan_discretization as G G' (n, n): the root of the diagonal spectral density.
    L = P C'(C P C' + R)^-1 with P before the correction: scipy's equation for (Phi', C').
    """
    n = len(info.states)
    a, c = np.array(info.a, dtype=float), np.array(info.c, dtype=float)
    b = np.array(info.b, dtype=float).reshape(n, len(info.inputs))
    r = np.array(info.measurement_noise, dtype=float)
    density = np.diag(np.array(info.process_noise, dtype=float))
    phi, noise = van_loan_discretization(a, np.diag(np.sqrt(density)), info.period)
    augmented = np.block([[a, np.eye(n)], [np.zeros((n, 2 * n))]])
    held = linalg.expm(augmented * info.period)[:n, n:]
    p = linalg.solve_discrete_are(phi.T, c.T, noise, r)
    gain = linalg.solve(c @ p @ c.T + r, c @ p).T
    return {"Phi": phi, "Gamma": held @ b, "G": held, "L": gain, "C": c}
