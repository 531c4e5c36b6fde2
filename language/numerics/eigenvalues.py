"""Eigenvalues: the eigenvalues of a small matrix, and the entry that determines one of them.

The arithmetic is that of `language.numerics.matrix` for the same reason: plain loops in a fixed
order (rule 17f).
"""

from __future__ import annotations

import math

from language.numerics.matrix import Matrix, balancing_exponents, require_finite, scale_by_powers

ComplexRow = list[complex]

MAX_QR_SWEEPS = 60
"""Largest number of shifted QR steps per eigenvalue; a few suffice, the bound guarantees an end."""
DEFLATION_TOLERANCE = 2.0**-53
"""Relative size of a subdiagonal entry that counts as rounding (Golub, Van Loan, section 7.5.1)."""
SHIFT_PERTURBATION = 2.0**-40
"""Relative distance of the shift of inverse iteration from the eigenvalue.

A - lambda I itself is singular.
"""


def eigenvalues(a: Matrix) -> tuple[complex, ...]:
    """Return the eigenvalues of A (n, n) with their multiplicities, in no particular order.

    QR steps with Wilkinson's shift on the balanced Hessenberg matrix, with rotations: Golub and Van
    Loan, Matrix Computations (4th ed. 2013), sections 7.4 and 7.5. Raises ValueError if A is not
    square or not finite.
    """
    require_finite("eigenvalues: A", a)
    if len(a[0]) != len(a):
        raise ValueError("eigenvalues: A is not square")
    exponents = balancing_exponents(a)
    balanced = scale_by_powers(a, tuple(-e for e in exponents), exponents)
    rows = _reduce_to_hessenberg([[complex(x) for x in row] for row in balanced])
    values: list[complex] = []
    while rows:
        last = len(rows) - 1
        for _ in range(MAX_QR_SWEEPS):
            start = _active_block_start(rows)
            if start == last:
                break
            _qr_step(rows, start)
        values.append(rows[last][last])
        rows = [row[:last] for row in rows[:last]]
    return tuple(values)


def dominant_entry(a: Matrix, eigenvalue: complex) -> tuple[int, int]:
    """Return row and column of the entry of A (n, n) that contributes most to an eigenvalue.

    With its right eigenvector x and left eigenvector y, lambda is the sum of y_i A_ij x_j / (y' x).
    The entry with the largest summand in size is returned, of equal ones the first by row, then
    column; both count from 0. The choice does not depend on units.
    """
    right = _eigenvector(a, eigenvalue)
    left = _eigenvector(tuple(zip(*a, strict=True)), eigenvalue)
    sizes = {
        (i, j): abs(left[i] * entry * right[j])
        for i, row in enumerate(a)
        for j, entry in enumerate(row)
    }
    return max(sizes, key=lambda place: sizes[place])


def _reduce_to_hessenberg(rows: list[ComplexRow]) -> list[ComplexRow]:
    """Return a similar matrix in Hessenberg form by elimination with pivoting (elmhes of EISPACK).

    `rows` is changed in place and returned.
    """
    n = len(rows)
    for m in range(1, n - 1):
        pivot = max(range(m, n), key=lambda i: abs(rows[i][m - 1]))
        rows[m], rows[pivot] = rows[pivot], rows[m]
        for row in rows:
            row[m], row[pivot] = row[pivot], row[m]
        if rows[m][m - 1] == 0:
            continue
        for i in range(m + 1, n):
            factor = rows[i][m - 1] / rows[m][m - 1]
            for j in range(n):
                rows[i][j] -= factor * rows[m][j]
            for row in rows:
                row[m] += factor * row[i]
    return rows


def _active_block_start(rows: list[ComplexRow]) -> int:
    """Return the first row of the last block that is not split off.

    The negligible subdiagonal entry before that row is set to 0.
    """
    for k in range(len(rows) - 1, 0, -1):
        beside = abs(rows[k][k]) + abs(rows[k - 1][k - 1])
        if abs(rows[k][k - 1]) <= DEFLATION_TOLERANCE * beside or rows[k][k - 1] == 0:
            rows[k][k - 1] = 0j
            return k
    return 0


def _qr_step(rows: list[ComplexRow], start: int) -> None:
    """Replace the active block, from row `start`, in place by R Q + mu I with A - mu I = Q R."""
    n = len(rows)
    mu = _wilkinson_shift(rows)
    for k in range(start, n):
        rows[k][k] -= mu
    rotations: list[tuple[complex, complex]] = []
    for k in range(start, n - 1):
        x, y = rows[k][k], rows[k + 1][k]
        size = math.hypot(abs(x), abs(y))
        c, s = (x / size, y / size) if size else (1 + 0j, 0j)
        rotations.append((c, s))
        for j in range(k, n):
            p, q = rows[k][j], rows[k + 1][j]
            rows[k][j] = c.conjugate() * p + s.conjugate() * q
            rows[k + 1][j] = c * q - s * p
    for k, (c, s) in enumerate(rotations, start=start):
        for i in range(start, min(k + 2, n)):
            p, q = rows[i][k], rows[i][k + 1]
            rows[i][k] = p * c + q * s
            rows[i][k + 1] = q * c.conjugate() - p * s.conjugate()
    for k in range(start, n):
        rows[k][k] += mu


def _wilkinson_shift(rows: list[ComplexRow]) -> complex:
    """Return the eigenvalue of the last 2 x 2 block that is nearer to its last diagonal entry."""
    (a, b), (c, d) = rows[-2][-2:], rows[-1][-2:]
    half = 0.5 * (a - d)
    root = (half * half + b * c) ** 0.5
    plus_root, minus_root = d + half + root, d + half - root
    return plus_root if abs(plus_root - d) <= abs(minus_root - d) else minus_root


def _eigenvector(a: Matrix, eigenvalue: complex) -> ComplexRow:
    """Return the eigenvector of an eigenvalue by two steps of inverse iteration.

    The vector is scaled so that its largest entry has size 1.
    """
    n = len(a)
    scale = max(abs(eigenvalue), max(abs(x) for row in a for x in row), 1e-300)
    shifted = eigenvalue + SHIFT_PERTURBATION * scale
    vector: ComplexRow = [1.0 + 0.1j * i for i in range(n)]
    for _ in range(2):
        vector = _solve_linear(
            [
                [(-shifted if i == j else 0j) + x for j, x in enumerate(row)]
                for i, row in enumerate(a)
            ],
            vector,
        )
        size = max(abs(x) for x in vector)
        vector = [x / size for x in vector]
    return vector


def _solve_linear(rows: list[ComplexRow], rhs: ComplexRow) -> ComplexRow:
    """Return the solution x (n) of A x = b by elimination with partial pivoting.

    A pivot of zero is replaced by SHIFT_PERTURBATION.
    """
    n = len(rows)
    work = [[*row, value] for row, value in zip(rows, rhs, strict=True)]
    for k in range(n):
        pivot = max(range(k, n), key=lambda i: abs(work[i][k]))
        work[k], work[pivot] = work[pivot], work[k]
        if work[k][k] == 0:
            work[k][k] = complex(SHIFT_PERTURBATION)
        for row in work[k + 1 :]:
            factor = row[k] / work[k][k]
            for j in range(k, n + 1):
                row[j] -= factor * work[k][j]
    for k in reversed(range(n)):
        for j in range(k + 1, n):
            work[k][n] -= work[k][j] * work[j][n]
        work[k][n] /= work[k][k]
    return [row[n] for row in work]
