"""Distribution check: find invalid parameters of distributions; space axes logarithmically."""

from __future__ import annotations

import math
from fractions import Fraction

from sweep.definition.study import Distribution

MIN_LEVELS_WITHIN = 2.0**20
"""Smallest number of representable quantile levels that a truncation must leave.

With fewer levels a drawn value has less than six digits.
"""
MAX_RATIO = 2**1000
"""Largest ratio of the ends of an axis that is computed exactly; larger ones overflow a float."""
FORM_TEXTS = {
    "uniform": "`uniform` is `[low, high]`",
    "log_uniform": "`log_uniform` is `[low, high]`, above zero",
    "normal": "`normal` is `[mean, standard deviation]`",
    "lognormal": "`lognormal` is `[median, sigma of the logarithm]`",
}
"""The form of each distribution, as an error message states it."""


def fault_of_distribution(distribution: Distribution) -> tuple[str, str] | None:
    """Return the code and the text of the problem of a distribution; None if it is valid.

    The code is `form` for misplaced weights and an invalid choice, else `range`: FORM_TEXTS for a
    wrong number or order of parameters, ends too far apart, a truncation that leaves fewer than
    MIN_LEVELS_WITHIN levels.
    """
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
    """Return the code and the text of the problem of a choice; None if it is valid."""
    numbers, weights = distribution.numbers, distribution.weights
    fits_weights = not weights or len(weights) == len(numbers)
    if not numbers or not fits_weights or any(w <= 0 for w in weights):
        return "form", "a `choice` has values, and `weights` above zero, one for each, or none"
    if not math.isfinite(sum(weights)):
        return "range", "the sum of the `weights` is larger than any number"
    return None


def log_spaced(first: Fraction, last: Fraction, count: int) -> tuple[float, ...]:
    """Return `count` numbers from `first` to `last` with a constant ratio; the ends are included.

    Both ends are positive, in any order, and `count` is at least 2. A ratio beyond MAX_RATIO is
    computed from powers of the ends.
    """
    start, end = float(first), float(last)
    shares = [k / (count - 1) for k in range(count - 1)]
    if Fraction(1, MAX_RATIO) < last / first < MAX_RATIO:
        ratio = float(last / first)
        return (*(start * ratio**share for share in shares), end)
    return (*(start ** (1.0 - share) * end**share for share in shares), end)
