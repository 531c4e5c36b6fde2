"""Stability limits: the largest step with which a method damps each decaying mode of a flow.

A method multiplies a component e^(lambda t) by R(h lambda) in each step; |R| must not exceed 1
(Hairer and Wanner, Solving Ordinary Differential Equations II, IV.2). Growing and undamped
components set no limit.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache

from language.integration.rate_terms import steepest_term
from language.integration.vector_field import VectorField
from language.model.graph_algorithms import strongly_connected_components
from language.numerics.affine_form import AffineForm, coefficient_matrix
from language.numerics.eigenvalues import dominant_entry, eigenvalues
from language.text.diagnostic import Problems, Span

STABILITY_FUNCTIONS: Mapping[str, Callable[[complex], complex]] = {
    "euler": lambda z: 1 + z,
    "midpoint": lambda z: 1 + z + z * z / 2,
    "rk4": lambda z: 1 + z + z * z / 2 + z * z * z / 6 + z * z * z * z / 24,
}
"""The stability function R(z) of each explicit method: the first terms of e^z."""
MIN_DAMPING_RATIO = 1e-6
"""The damping ratio below which a component is undamped; eigenvalues have rounding errors."""
RAY_STEP = 1.0 / 64
"""The step of the search along the ray h lambda; no stability region here is narrower."""
MAX_RADIUS = 8.0
"""The |h lambda| beyond which none of these methods is stable."""
RADIUS_BISECTIONS = 50
"""The number of bisections of the boundary of the stability region."""
MAX_COUPLED_STATES = 64
"""The largest number of coupled states whose eigenvalues are computed."""
GROWTH_TOLERANCE = 2.0**-40
"""The growth per step that is attributed to the rounding of an eigenvalue."""


@dataclass(frozen=True)
class StabilityLimit:
    """The largest stable step [s] of a mode, with the eigenvalue [1/s] and the term that set it."""

    mode: str
    step: float
    eigenvalue: complex
    term: str
    state: str


def stability_limit_of(
    field: VectorField, mode: str, parts: Mapping[str, AffineForm], method: str
) -> StabilityLimit | None:
    """Return the stability limit of a mode from the affine forms of its rates.

    It is the smallest limit over all decaying eigenvalues (damping ratio above MIN_DAMPING_RATIO)
    of the Jacobian, with the term and the state that dominate this eigenvalue. States that are not
    coupled in a cycle are treated in separate groups; a group of more than MAX_COUPLED_STATES is
    skipped. The result is None for an exponential method, for rates that are not finite and if no
    component decays.
    """
    if method not in STABILITY_FUNCTIONS:
        return None
    best: tuple[float, complex, str, str] | None = None
    slopes = {name: parts[f"work.rate_{name}"].coefficients for name in field.states}
    if not all(math.isfinite(x) for row in slopes.values() for x in row.values()):
        return None
    for group in strongly_connected_components(slopes):
        a = coefficient_matrix(parts, tuple(group)) if len(group) <= MAX_COUPLED_STATES else ()
        damped = [v for v in eigenvalues(a) if v.real < -MIN_DAMPING_RATIO * abs(v)] if a else []
        if damped:
            value = min(damped, key=lambda value: largest_stable_step(method, value))
            step = largest_stable_step(method, value)
            if best is None or step < best[0]:
                row, column = (group[k] for k in dominant_entry(a, value))
                best = step, value, row, column
    if best is None:
        return None
    step, fastest, row, column = best
    term = steepest_term(field, field.automaton.modes[mode], row, column, parts)
    return StabilityLimit(mode, step, fastest, term, row)


def largest_stable_step(method: str, eigenvalue: complex) -> float:
    """Return the largest h [s] with |R(h' lambda)| <= 1 for all h' from 0 to h.

    R is that of `STABILITY_FUNCTIONS`; `eigenvalue` is lambda [1/s], not 0. |h lambda| is searched
    in steps of RAY_STEP up to MAX_RADIUS and then bisected.
    """
    size = abs(eigenvalue)
    turn = eigenvalue / size
    return _stability_radius(method, complex(turn.real, abs(turn.imag))) / size


@cache
def _stability_radius(method: str, direction: complex) -> float:
    """Return the distance from 0 along `direction` up to which |R| stays within 1."""
    growth = STABILITY_FUNCTIONS[method]

    def decays(z: float) -> bool:
        """Return whether |R| stays within 1 at the distance z from 0."""
        return abs(growth(z * direction)) <= 1.0 + GROWTH_TOLERANCE

    low = 0.0
    while low < MAX_RADIUS and decays(low + RAY_STEP):
        low += RAY_STEP
    high = low + RAY_STEP
    for _ in range(RADIUS_BISECTIONS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if decays(middle) else (low, middle)
    return low


def check_stability(
    limit: StabilityLimit, method: str, h: float, span: Span, problems: Problems
) -> None:
    """Report an error at `span` if the step h [s] exceeds the stability limit.

    The limit has a relative tolerance of GROWTH_TOLERANCE. The help names the term and the state
    that set it, and how many times as many steps are enough.
    """
    if h <= limit.step * (1.0 + GROWTH_TOLERANCE):
        return
    label = f"`{method}` is not stable in mode `{limit.mode}` with a step of {h:.4g} s: "
    label += f"the largest is {limit.step:.4g} s"
    rate = f"{abs(limit.eigenvalue):.4g} 1/s"
    times = math.ceil(h / limit.step)
    help = f"`{limit.term}` sets the eigenvalue of {rate} in the rate of `{limit.state}`: "
    help += f"{times} times as many steps, or `method: exponential`"
    problems.error("stability", span, label, help)
