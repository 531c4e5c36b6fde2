"""Stability: the largest step with which a method lets the decaying parts of a flow decay.

A method makes x R(h lambda) of a part that decays as e^(lambda t): that must not grow. Hairer and
Wanner, Solving Ordinary Differential Equations II, IV.2. Growing and undamped parts set no limit.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache

from language.affine import Affine, matrix_of
from language.eigen import eigenvalues, governing_entry
from language.field import Field
from language.graph import components
from language.problem import Problems, Span
from language.terms import strongest

GROWTH: Mapping[str, Callable[[complex], complex]] = {
    "euler": lambda z: 1 + z,
    "midpoint": lambda z: 1 + z + z * z / 2,
    "rk4": lambda z: 1 + z + z * z / 2 + z * z * z / 6 + z * z * z * z / 24,
}
"""R(z) of each method: the first terms of e^z."""
UNDAMPED = 1e-6
"""Damping ratio below which a part counts as undamped: an eigenvalue has rounding errors."""
LOOK = 1.0 / 64
"""Step of the walk along the ray h lambda: no method here has a region narrower than that."""
FARTHEST = 8.0
"""|h lambda| beyond which none of these methods is stable."""
HALVINGS = 50
MOST_COUPLED = 64
"""States that act on each other whose eigenvalues are found; of more no limit is told."""
ROUNDING = 2.0**-40
"""Growth per step that is rounding of an eigenvalue."""


@dataclass(frozen=True)
class Limit:
    """The largest stable step [s] in a mode, the eigenvalue [1/s] and the term that set it."""

    mode: str
    step: float
    eigenvalue: complex
    term: str
    state: str


def limit_of(field: Field, mode: str, parts: Mapping[str, Affine], method: str) -> Limit | None:
    """Return the limit of a mode whose rates have these affine parts; None where there is none.

    The states that do not act on each other in a circle have eigenvalues of their own.
    """
    if method not in GROWTH:
        return None
    best: tuple[float, complex, str, str] | None = None
    slopes = {name: parts[f"work.rate_{name}"].slopes for name in field.states}
    if not all(math.isfinite(x) for row in slopes.values() for x in row.values()):
        return None
    for group in components(slopes):
        a = matrix_of(parts, tuple(group)) if len(group) <= MOST_COUPLED else ()
        damped = [v for v in eigenvalues(a) if v.real < -UNDAMPED * abs(v)] if a else []
        if damped:
            value = min(damped, key=lambda value: largest_step(method, value))
            step = largest_step(method, value)
            if best is None or step < best[0]:
                row, column = (group[k] for k in governing_entry(a, value))
                best = step, value, row, column
    if best is None:
        return None
    step, fastest, row, column = best
    term = strongest(field, field.automaton.modes[mode], row, column, parts)
    return Limit(mode, step, fastest, term, row)


def largest_step(method: str, eigenvalue: complex) -> float:
    """Return the largest h [s] with |R(h' lambda)| <= 1 for all h' up to h."""
    size = abs(eigenvalue)
    turn = eigenvalue / size
    return _reach(method, complex(turn.real, abs(turn.imag))) / size


@cache
def _reach(method: str, turn: complex) -> float:
    """Return how far from 0 along a direction `turn` the values of |R| stay within 1."""
    growth = GROWTH[method]

    def decays(z: float) -> bool:
        return abs(growth(z * turn)) <= 1.0 + ROUNDING

    low = 0.0
    while low < FARTHEST and decays(low + LOOK):
        low += LOOK
    high = low + LOOK
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if decays(middle) else (low, middle)
    return low


def check_step(limit: Limit, method: str, h: float, span: Span, problems: Problems) -> None:
    """Report a step h [s] above the limit."""
    if h <= limit.step * (1.0 + ROUNDING):
        return
    label = f"`{method}` is not stable in mode `{limit.mode}` with a step of {h:.4g} s: "
    label += f"the largest is {limit.step:.4g} s"
    rate = f"{abs(limit.eigenvalue):.4g} 1/s"
    times = math.ceil(h / limit.step)
    help = f"`{limit.term}` sets the eigenvalue of {rate} in the rate of `{limit.state}`: "
    help += f"{times} times as many steps, or `method: exponential`"
    problems.error("stability", span, label, help)
