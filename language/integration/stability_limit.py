"""Stability: the largest step with which a method lets the decaying parts of a flow decay.

A method makes x R(h lambda) of a part that decays as e^(lambda t): that must not grow. Hairer and
Wanner, Solving Ordinary Differential Equations II, IV.2. Growing and undamped parts set no limit.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache

from language.integration.rate_terms import steepest_term
from language.integration.vector_field import VectorField
from language.model.graphs import strongly_connected_components
from language.numerics.affine_form import AffineForm, coefficient_matrix
from language.numerics.eigenvalues import dominant_entry, eigenvalues
from language.text.diagnostic import Problems, Span

STABILITY_FUNCTIONS: Mapping[str, Callable[[complex], complex]] = {
    "euler": lambda z: 1 + z,
    "midpoint": lambda z: 1 + z + z * z / 2,
    "rk4": lambda z: 1 + z + z * z / 2 + z * z * z / 6 + z * z * z * z / 24,
}
"""R(z) of each method: the first terms of e^z."""
MIN_DAMPING_RATIO = 1e-6
"""Damping ratio below which a part counts as undamped: an eigenvalue has rounding errors."""
RAY_STEP = 1.0 / 64
"""Step of the walk along the ray h lambda: no method here has a region narrower than that."""
MAX_RADIUS = 8.0
"""|h lambda| beyond which none of these methods is stable."""
RADIUS_BISECTIONS = 50
MAX_COUPLED_STATES = 64
"""States that act on each other whose eigenvalues are found; of more no limit is told."""
GROWTH_TOLERANCE = 2.0**-40
"""Growth per step that is rounding of an eigenvalue."""


@dataclass(frozen=True)
class StabilityLimit:
    """The largest stable step [s] in a mode, the eigenvalue [1/s] and the term that set it."""

    mode: str
    step: float
    eigenvalue: complex
    term: str
    state: str


def stability_limit_of(
    field: VectorField, mode: str, parts: Mapping[str, AffineForm], method: str
) -> StabilityLimit | None:
    """Return the limit of a mode whose rates have these affine parts; None where there is none.

    The states that do not act on each other in a circle have eigenvalues of their own.
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
    """Return the largest h [s] with |R(h' lambda)| <= 1 for all h' up to h."""
    size = abs(eigenvalue)
    turn = eigenvalue / size
    return _stability_radius(method, complex(turn.real, abs(turn.imag))) / size


@cache
def _stability_radius(method: str, direction: complex) -> float:
    """Return how far from 0 along a direction `direction` the values of |R| stay within 1."""
    growth = STABILITY_FUNCTIONS[method]

    def decays(z: float) -> bool:
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
    """Report a step h [s] above the limit."""
    if h <= limit.step * (1.0 + GROWTH_TOLERANCE):
        return
    label = f"`{method}` is not stable in mode `{limit.mode}` with a step of {h:.4g} s: "
    label += f"the largest is {limit.step:.4g} s"
    rate = f"{abs(limit.eigenvalue):.4g} 1/s"
    times = math.ceil(h / limit.step)
    help = f"`{limit.term}` sets the eigenvalue of {rate} in the rate of `{limit.state}`: "
    help += f"{times} times as many steps, or `method: exponential`"
    problems.error("stability", span, label, help)
