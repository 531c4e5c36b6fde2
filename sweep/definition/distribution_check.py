"""Shape: whether a distribution is one that can be drawn from, and how an axis is divided."""

from __future__ import annotations

import math
from fractions import Fraction

from sweep.definition.study import Distribution

MIN_LEVELS_WITHIN = 2.0**20
"""Different shares that `within` leaves at least: with fewer a drawn value has no six digits."""
MAX_RATIO = 2**1000
"""Of the ends of an axis; a larger one is no number, and a smaller inverse has fewer digits."""
FORM_TEXTS = {
    "uniform": "`uniform` is `[low, high]`",
    "log_uniform": "`log_uniform` is `[low, high]`, above zero",
    "normal": "`normal` is `[mean, standard deviation]`",
    "lognormal": "`lognormal` is `[median, sigma of the logarithm]`",
}


def fault_of_distribution(distribution: Distribution) -> tuple[str, str] | None:
    """Return the kind of the problem of a distribution and what is wrong; None: it is fine."""
    if distribution.shape == "choice":
        return _fault_of_choice(distribution)
    if distribution.weights:
        return "form", f"`{distribution.shape}` has no `weights`"
    numbers, is_between = distribution.numbers, distribution.shape in ("uniform", "log_uniform")
    fine = len(numbers) == 2
    if fine:
        fine = numbers[0] < numbers[1] if is_between else numbers[1] > 0.0
    if fine and distribution.shape in ("log_uniform", "lognormal"):
        fine = numbers[0] > 0.0
    if not fine:
        return "range", FORM_TEXTS[distribution.shape]
    if is_between:
        is_log = distribution.shape == "log_uniform"
        width = numbers[1] / numbers[0] if is_log else numbers[1] - numbers[0]
        if not math.isfinite(width):
            return (
                "range",
                f"the ends of `{distribution.shape}` are farther apart than a number can tell",
            )
    elif distribution.within:
        from sweep.definition.truncation import (
            truncation_levels,  # not above: `check` loads no numpy
        )

        low, high = truncation_levels(distribution)
        if not high - low >= MIN_LEVELS_WITHIN * math.ulp(high):
            return (
                "range",
                f"`within` leaves nothing of this `{distribution.shape}` that could be drawn",
            )
    return None


def _fault_of_choice(distribution: Distribution) -> tuple[str, str] | None:
    numbers, weights = distribution.numbers, distribution.weights
    fits_weights = not weights or len(weights) == len(numbers)
    if not numbers or not fits_weights or any(w <= 0 for w in weights):
        return "form", "a `choice` has values, and `weights` above zero, one for each, or none"
    if not math.isfinite(sum(weights)):
        return "range", "the sum of the `weights` is larger than any number"
    return None


def log_spaced(first: Fraction, last: Fraction, count: int) -> tuple[float, ...]:
    """Return numbers above zero with equal ratios from one to the next, the ends among them."""
    start, end = float(first), float(last)
    shares = [k / (count - 1) for k in range(count - 1)]
    if Fraction(1, MAX_RATIO) < last / first < MAX_RATIO:
        ratio = float(last / first)
        return (*(start * ratio**share for share in shares), end)
    return (*(start ** (1.0 - share) * end**share for share in shares), end)
