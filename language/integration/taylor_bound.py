"""Norms of a linear step, and the number of terms of its Taylor sum (rule 17e)."""

from __future__ import annotations

from collections.abc import Iterable

from language.integration.vector_field import VectorField
from language.ir.number_type import SIGNIFICAND_BITS, NumberType
from language.numerics.matrix import Matrix, abs_sum


def scale_by_ranges(field: VectorField, a: Matrix, h: float) -> Matrix:
    """Return A h (n, n) with each state in units of the width of its range.

    Entry i, j is a_ij h width_j / width_i; `h` is in s. Every state needs a range.
    """
    widths = []
    for state in field.automaton.states.values():
        assert state.range is not None
        widths.append(float(state.range[1] - state.range[0]))
    return tuple(
        tuple(entry * other / width * h for entry, other in zip(row, widths, strict=True))
        for row, width in zip(a, widths, strict=True)
    )


def row_sum_norm(a: Matrix) -> float:
    """Return the largest sum of absolute values of a row.

    The result is NaN if an entry is NaN, and 0 without rows.
    """
    return max_or_nan(abs_sum(row) for row in a)


def max_or_nan(values: Iterable[float]) -> float:
    """Return the largest of some nonnegative values; 0 without any, NaN if one is NaN."""
    largest = 0.0
    for value in values:
        largest = value if not value <= largest else largest
    return largest


def taylor_term_count(step: Matrix, number: NumberType = "float64") -> int:
    """Return the number of terms, at least 1, of a Taylor sum of z = A h (n, n).

    The sum is that of z^k (d0 h) / (k + 1)!, and |d0 h| is at most |z|. From the K-th term on, |
    |z|^K 1 | |z| / (K + 1)! <= 2^-53, or 2^-24 in float32. Powers of the matrix of absolute values
    give a sharper bound than powers of the norm where z is nearly nilpotent.
    """
    norm, tiny = row_sum_norm(step), 2.0 ** -SIGNIFICAND_BITS[number]
    reach = [1.0 for _ in step]
    terms, bound, order = 1, norm, 1
    while bound > tiny:
        if max_or_nan(reach) * norm > tiny:
            terms = order
        order += 1
        bound = bound * norm / order
        reach = [abs_sum(x * y for x, y in zip(row, reach, strict=True)) / order for row in step]
    return terms
