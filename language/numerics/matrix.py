"""Small matrices of floats: arithmetic, linear solve, exponential and its integral (rule 17f).

The results are printed into ECU C code, so their bits must not depend on the processor or on a
library. Each operation is rounded once to IEEE 754 binary64, products are summed from left to right
by plain loops (`sum` compensates since Python 3.12), and scaling by powers of two is exact.
Arithmetic passes inf and nan through; solvers raise ValueError for them. A matrix is a tuple of
rows, a vector is (n, 1).
"""

from __future__ import annotations

import math
from collections.abc import Iterable

Matrix = tuple[tuple[float, ...], ...]

SERIES_TERMS = 19
"""Terms of the Taylor sum of (e^z - 1)/z, |z| <= 1.

The remainder is below 2^-60, less than the rounding.
"""
MAX_SWEEPS = 50
"""Largest number of sweeps of balancing; a few suffice, and any exponents are admissible."""
MAX_SCALE_EXPONENT = 256
"""Largest exponent of a state's scale.

Beyond it a covariance, which is scaled twice, would overflow.
"""
BALANCE_FACTOR = 0.95
"""A state is scaled if its row plus column sum shrinks by 5 % (gamma of Parlett and Reinsch)."""


def multiply(a: Matrix, b: Matrix) -> Matrix:
    """Return A B, (n, k) times (k, m) -> (n, m), summed from left to right.

    Raises ValueError if the shapes do not match.
    """
    if len(a[0]) != len(b):
        raise ValueError(f"multiply: {format_shape(a)} times {format_shape(b)}")
    columns = transpose(b)
    return tuple(tuple(_dot(row, column) for column in columns) for row in a)


def add(a: Matrix, b: Matrix) -> Matrix:
    """Return A + B, both (n, m). Raises ValueError if the shapes differ."""
    if format_shape(a) != format_shape(b):
        raise ValueError(f"add: {format_shape(a)} and {format_shape(b)}")
    return tuple(tuple(x + y for x, y in zip(p, q, strict=True)) for p, q in zip(a, b, strict=True))


def subtract(a: Matrix, b: Matrix) -> Matrix:
    """Return A - B, both (n, m), computed as A + (-1) B. Raises ValueError if the shapes differ."""
    return add(a, scale(-1.0, b))


def scale(factor: float, a: Matrix) -> Matrix:
    """Return factor * A, (n, m) -> (n, m)."""
    return tuple(tuple(factor * x for x in row) for row in a)


def transpose(a: Matrix) -> Matrix:
    """Return A', (n, m) -> (m, n)."""
    return tuple(zip(*a, strict=True))


def identity(n: int) -> Matrix:
    """Return the identity matrix (n, n)."""
    return tuple(tuple(1.0 if i == j else 0.0 for j in range(n)) for i in range(n))


def symmetrise(a: Matrix) -> Matrix:
    """Return (A + A')/2, (n, n), symmetric to the last bit because float addition commutes.

    Raises ValueError if A is not square.
    """
    return scale(0.5, add(a, transpose(a)))


def solve(a: Matrix, b: Matrix) -> Matrix:
    """Return X with A X = B, (n, n) and (n, m) -> (n, m), by elimination with partial pivoting.

    Golub and Van Loan, Matrix Computations (4th ed. 2013), section 3.4. Raises ValueError for wrong
    shapes, an entry that is not finite, overflow, or a pivot that is exactly zero. A nearly
    singular A is not detected.
    """
    require_finite("solve: A", a)
    require_finite("solve: B", b)
    n = len(a)
    if len(a[0]) != n or len(b) != n:
        raise ValueError(f"solve: A is {format_shape(a)}, B is {format_shape(b)}")
    rows = [[*p, *q] for p, q in zip(a, b, strict=True)]
    for k in range(n):
        _eliminate(rows, k)
    for k in reversed(range(n)):
        for column in range(n, len(rows[k])):
            total = rows[k][column]
            for j in range(k + 1, n):
                total -= rows[k][j] * rows[j][column]
            rows[k][column] = total / rows[k][k]
    return require_finite("solve: X", tuple(tuple(row[n:]) for row in rows))


def expm(a: Matrix, h: float) -> Matrix:
    """Return the transition matrix e^(A h), (n, n), of x' = A x over h [s]; h may have any sign.

    Entry i, j of A (n, n) has the unit unit_i/(unit_j s). Scaling and squaring (Higham 2005, SIAM
    J. Matrix Anal. Appl. 26, section 2) of the balanced A h, with a Taylor sum instead of the Pade
    quotient. Raises ValueError if A is not square, for an entry that is not finite, and on
    overflow.
    """
    return _expm_and_integral("expm", a, h)[0]


def expm_integral(a: Matrix, h: float) -> Matrix:
    """Return the integral of e^(A s) over s from 0 to h [s], (n, n), which is h phi_1(A h).

    Its product with B is the input matrix for an input that is held. Block H of Van Loan 1978 (IEEE
    Trans. Autom. Control 23, 395-404), with his doubling F(2t) = F(t) + Phi(t) F(t). A and errors
    are as for `expm`.
    """
    return _expm_and_integral("expm_integral", a, h)[1]


def balance_and_scale(name: str, a: Matrix, h: float) -> tuple[Matrix, tuple[int, ...], int]:
    """Return X = D^-1 A D h / 2^halvings with row sums below 1/2, the exponents of D, and halvings.

    A (n, n) in 1/s, h in s, X (n, n) without unit. Raises ValueError, with a text that begins with
    `name`, if A is not square, or if an entry of A or A h is not finite.
    """
    require_finite(f"{name}: A", a)
    if len(a[0]) != len(a):
        raise ValueError(f"{name}: A is {format_shape(a)}, not square")
    step = require_finite(f"{name}: A h", scale(h, a))
    exponents = balancing_exponents(step)
    balanced = scale_by_powers(step, tuple(-e for e in exponents), exponents)
    halvings = max(0, math.frexp(max(abs_sum(row) for row in balanced))[1] + 1)
    return scale_by_powers(balanced, (-halvings,) * len(a), (0,) * len(a)), exponents, halvings


def balancing_exponents(a: Matrix) -> tuple[int, ...]:
    """Return the exponents e of D = diag(2^e) for which D^-1 A D has rows as large as its columns.

    A (n, n), finite; its diagonal does not count. Parlett and Reinsch 1969 (Numer. Math. 13,
    293-304), radix 2, no permutation, MAX_SWEEPS sweeps at most. Exponents are limited to
    +-MAX_SCALE_EXPONENT. A state with an empty row or column cannot be balanced: it is scaled until
    the sum of the other one is below 1.
    """
    work = [[abs(x) for x in row] for row in a]
    exponents = [0] * len(a)
    for _ in range(MAX_SWEEPS):
        before = tuple(exponents)
        for i in range(len(a)):
            unbounded_exponent = exponents[i] + _balancing_exponent(work, i)
            step = (
                max(-MAX_SCALE_EXPONENT, min(MAX_SCALE_EXPONENT, unbounded_exponent)) - exponents[i]
            )
            exponents[i] += step
            for j in range(len(a)):
                if j != i:
                    work[j][i] = ldexp_or_inf(work[j][i], step)
                    work[i][j] = ldexp_or_inf(work[i][j], -step)
        if tuple(exponents) == before:
            break
    return tuple(exponents)


def scale_by_powers(
    a: Matrix, row_exponents: tuple[int, ...], column_exponents: tuple[int, ...]
) -> Matrix:
    """Return diag(2^rows) A diag(2^columns), (n, m); exact unless an entry over- or underflows.

    Overflow gives an infinity. Raises ValueError if the numbers of exponents do not match A.
    """
    return tuple(
        tuple(ldexp_or_inf(x, r + c) for x, c in zip(row, column_exponents, strict=True))
        for row, r in zip(a, row_exponents, strict=True)
    )


def ldexp_or_inf(x: float, exponent: int) -> float:
    """Return x 2^exponent, or an infinity of the sign of x on overflow."""
    try:
        return math.ldexp(x, exponent)
    except OverflowError:
        return math.copysign(math.inf, x)


def require_finite(name: str, a: Matrix) -> Matrix:
    """Return A. Raises ValueError if A is empty or ragged or has an entry that is not finite."""
    if not a or not a[0] or any(len(row) != len(a[0]) for row in a):
        raise ValueError(f"{name} is empty or its rows differ in length: {a!r}")
    for i, row in enumerate(a):
        for j, x in enumerate(row):
            if not math.isfinite(x):
                raise ValueError(f"{name}[{i}][{j}] is {x!r}")
    return a


def abs_sum(values: Iterable[float]) -> float:
    """Return |x_0| + |x_1| + ..., added from left to right."""
    total = 0.0
    for x in values:
        total += abs(x)
    return total


def format_shape(a: Matrix) -> str:
    """Return the shape of a matrix for messages: `(2, 3)`."""
    return f"({len(a)}, {len(a[0]) if a else 0})"


def _expm_and_integral(name: str, a: Matrix, h: float) -> tuple[Matrix, Matrix]:
    """Return e^(A h) and its integral, both (n, n): Horner's rule for phi_1, then doubling."""
    x, exponents, halvings = balance_and_scale(name, a, h)
    unit = identity(len(a))
    series = unit
    for k in range(SERIES_TERMS, 1, -1):
        series = add(unit, scale(1.0 / k, multiply(x, series)))
    phi = add(unit, multiply(x, series))
    integral = scale(ldexp_or_inf(h, -halvings), series)
    for _ in range(halvings):
        integral = add(integral, multiply(phi, integral))
        phi = multiply(phi, phi)
    down = tuple(-e for e in exponents)
    return (
        require_finite(f"{name}: result", scale_by_powers(phi, exponents, down)),
        require_finite(f"{name}: result", scale_by_powers(integral, exponents, down)),
    )


def _balancing_exponent(work: list[list[float]], i: int) -> int:
    """Return the change of the exponent of state i.

    `work` (n, n) holds sizes, the diagonal is ignored.
    """
    row = abs_sum(x for j, x in enumerate(work[i]) if j != i)
    column = abs_sum(other[i] for j, other in enumerate(work) if j != i)
    if row == 0.0 or column == 0.0:
        return max(0, math.frexp(row)[1]) - max(0, math.frexp(column)[1])
    step = (math.frexp(row)[1] - math.frexp(column)[1]) // 2
    scaled = ldexp_or_inf(column, step) + ldexp_or_inf(row, -step)
    return step if scaled < BALANCE_FACTOR * (column + row) else 0


def _eliminate(rows: list[list[float]], k: int) -> None:
    """Bring the row with the largest entry of column k to row k, then clear column k below it.

    `rows` is changed in place. Raises ValueError if that entry is zero.
    """
    best = k
    for i in range(k + 1, len(rows)):
        if abs(rows[i][k]) > abs(rows[best][k]):
            best = i
    rows[k], rows[best] = rows[best], rows[k]
    pivot = rows[k][k]
    if pivot == 0.0:
        raise ValueError(f"solve: A is singular, no pivot is left in column {k}")
    for row in rows[k + 1 :]:
        factor = row[k] / pivot
        for j in range(k, len(row)):
            row[j] -= factor * rows[k][j]


def _dot(row: tuple[float, ...], column: tuple[float, ...]) -> float:
    """Return the sum of the products, added from left to right."""
    total = 0.0
    for x, y in zip(row, column, strict=True):
        total += x * y
    return total
