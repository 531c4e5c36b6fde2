"""Covariances of a sampled observer: noise of a period, steady gain by a Riccati equation.

The arithmetic is that of `language.numerics.matrix` for the same reason (rule 17f).
"""

from __future__ import annotations

import math

from language.numerics.matrix import (
    SERIES_TERMS,
    Matrix,
    abs_sum,
    add,
    balance_and_scale,
    balancing_exponents,
    expm,
    format_shape,
    identity,
    ldexp_or_inf,
    multiply,
    require_finite,
    scale,
    scale_by_powers,
    solve,
    subtract,
    symmetrise,
    transpose,
)

MAX_DOUBLINGS = 32
"""Largest number of doublings: 2^32 periods, five days at 10 kHz."""
DECAY_TOLERANCE = math.ldexp(1.0, -54)
"""Largest row sum of A_k at which doubling stops.

The next step would add 2^-108 of P's largest entry.
"""


def discretise_noise(a: Matrix, q: Matrix, h: float) -> Matrix:
    """Return Qd, the integral of e^(A s) Q e^(A' s) over s from 0 to h [s], (n, n).

    dx = A x dt + w, with white noise w of spectral density Q (n, n) [unit_i unit_j/s]; Qd [unit_i
    unit_j] is exactly symmetric. Block Q of Van Loan 1978 (IEEE Trans. Autom. Control 23, 395-404),
    with his doubling Qd(2t) = Qd(t) + Phi(t) Qd(t) Phi(t)'. The short step is the Taylor sum of t
    phi_1(t L) Q with L(Q) = A Q + Q A' instead of his block matrix, so that e^(-A t) is not needed.
    Raises ValueError if A is not square, h <= 0, Q is not a covariance, an entry is not finite, and
    on overflow.
    """
    require_covariance("discretise_noise: Q", q)
    if len(q) != len(a) or not h > 0.0:
        raise ValueError(
            f"discretise_noise: A is {format_shape(a)}, Q is {format_shape(q)}, h is {h!r}"
        )
    x, exponents, halvings = balance_and_scale("discretise_noise", a, h)
    down = tuple(-e for e in exponents)
    rate = scale(ldexp_or_inf(h, -halvings), scale_by_powers(q, down, down))
    noise = rate
    for k in range(SERIES_TERMS, 1, -1):
        half = multiply(x, noise)
        noise = add(rate, scale(1.0 / k, add(half, transpose(half))))
    phi = expm(x, 1.0)
    for _ in range(halvings):
        propagated = multiply(multiply(phi, noise), transpose(phi))
        noise = add(noise, symmetrise(propagated))
        phi = multiply(phi, phi)
    return require_finite("discretise_noise: result", scale_by_powers(noise, exponents, exponents))


def steady_kalman_gain(phi: Matrix, qd: Matrix, c: Matrix, r: Matrix) -> tuple[Matrix, Matrix]:
    """Return the gain L = P C'(C P C' + R)^-1, (n, m), and the a-priori covariance P, (n, n).

    x(k+1) = Phi x(k) + w, y = C x + v. Phi (n, n) per period, Qd (n, n) [unit_i unit_j] of w, C (m,
    n), R (m, m) of v per sample. L corrects the prediction: x + L (y - C x). P is symmetric and
    solves P = Phi P (I + G P)^-1 Phi' + Qd, G = C' R^-1 C. The method is structure-preserving
    doubling, which may lose digits where P is much larger than Qd, followed by one step of Newton's
    method, which restores them. Raises ValueError for wrong shapes, an entry that is not finite, Qd
    that is not a covariance, R that is not positive definite, and if there is no steady gain
    because a mode that does not decay is not observed through C or not driven by Qd.
    """
    _check_shapes(phi, qd, c, r)
    information = symmetrise(multiply(transpose(c), solve(r, c)))
    exponents = balancing_exponents(_coupling(phi, multiply(qd, information)))
    down = tuple(-e for e in exponents)
    phi_b, qd_b = scale_by_powers(phi, down, exponents), scale_by_powers(qd, down, down)
    c_b = scale_by_powers(c, (0,) * len(r), exponents)
    memory, p = _solve_by_doubling(
        transpose(phi_b), scale_by_powers(information, exponents, exponents), qd_b
    )
    _require_converged(memory, scale_by_powers(p, exponents, exponents))
    memory, p = _refine_covariance(phi_b, qd_b, c_b, r, _kalman_gain(p, c_b, r))
    _require_converged(memory, scale_by_powers(p, exponents, exponents))
    gain = scale_by_powers(_kalman_gain(p, c_b, r), exponents, (0,) * len(r))
    return (
        require_finite("steady_gain: L", gain),
        require_finite("steady_gain: P", scale_by_powers(p, exponents, exponents)),
    )


def require_covariance(name: str, a: Matrix) -> Matrix:
    """Return A. Raises ValueError unless A is finite, square, exactly symmetric, diagonal >= 0.

    Whether A is positive semidefinite is not checked. The message begins with `name`.
    """
    require_finite(name, a)
    if len(a[0]) != len(a):
        raise ValueError(f"{name} is {format_shape(a)}, not square")
    for i, row in enumerate(a):
        if row[i] < 0.0:
            raise ValueError(f"{name}[{i}][{i}] is {row[i]!r}, a negative variance")
        for j in range(i):
            if row[j] != a[j][i]:
                pair = f"[{i}][{j}] is {row[j]!r}, [{j}][{i}] is {a[j][i]!r}"
                raise ValueError(f"{name} is not symmetric: {pair}")
    return a


def _check_shapes(phi: Matrix, qd: Matrix, c: Matrix, r: Matrix) -> None:
    """Raise ValueError unless the arguments of `steady_kalman_gain` are valid."""
    require_finite("steady_gain: Phi", phi)
    require_finite("steady_gain: C", c)
    require_covariance("steady_gain: Qd", qd)
    require_covariance("steady_gain: R", r)
    n, m = len(qd), len(r)
    if (format_shape(phi), format_shape(c)) != (f"({n}, {n})", f"({m}, {n})"):
        named = {"Phi": phi, "Qd": qd, "C": c, "R": r}
        shapes = ", ".join(f"{name} {format_shape(a)}" for name, a in named.items())
        raise ValueError(f"steady_gain: {shapes}")
    _require_positive_definite("steady_gain: R", r)


def _require_positive_definite(name: str, a: Matrix) -> None:
    """Raise ValueError unless the symmetric A (n, n) is positive definite: every pivot is > 0."""
    rows = [list(row) for row in a]
    for k, row in enumerate(rows):
        if not row[k] > 0.0:
            raise ValueError(f"{name} = {a!r} is not positive definite, pivot {k} is {row[k]!r}")
        for below in rows[k + 1 :]:
            factor = below[k] / row[k]
            for j in range(k, len(rows)):
                below[j] -= factor * row[j]


def _require_converged(memory: float, p: Matrix) -> None:
    """Raise ValueError if the memory after the doublings is above DECAY_TOLERANCE.

    P is for the message.
    """
    if not memory <= DECAY_TOLERANCE:
        raise ValueError(
            f"steady_gain: no convergence within 2^{MAX_DOUBLINGS} periods, memory {memory!r}, "
            f"variances {[row[i] for i, row in enumerate(p)]}: a mode that does not decay "
            "is not observed through C (not detectable) or not driven by Qd"
        )


def _coupling(a: Matrix, b: Matrix) -> Matrix:
    """Return |A| + |B| entry by entry, (n, n): how strongly state j acts on state i."""
    return tuple(
        tuple(abs(x) + abs(y) for x, y in zip(p, q, strict=True)) for p, q in zip(a, b, strict=True)
    )


def _solve_by_doubling(a: Matrix, g: Matrix, h: Matrix) -> tuple[float, Matrix]:
    """Return the remaining memory and the solution H_k, (n, n), from A_0 = Phi', G_0 = G, H_0 = Qd.

    Structure-preserving doubling: Chu, Fan, Lin and Wang 2004 (Int. J. Control 77, 767-788, "SDA
    algorithm"; the recursion of Chu, Fan and Lin 2005, Linear Algebra Appl. 396, 55-80; before them
    Anderson 1978). With W = I + G H, each step A <- A W^-1 A, G <- G + A W^-1 G A', H <- H + A' H
    W^-1 A doubles the number of periods that H accounts for. The memory is the largest row sum of
    A; the next doubling adds at most memory^2 max|H|. The loop stops if memory <= DECAY_TOLERANCE,
    after MAX_DOUBLINGS, and if W is singular or not finite (memory inf).
    """
    unit = identity(len(a))
    memory = math.inf
    for _ in range(MAX_DOUBLINGS):
        try:
            both = solve(add(unit, multiply(g, h)), tuple(p + q for p, q in zip(a, g, strict=True)))
        except ValueError:
            return math.inf, h
        wa = tuple(row[: len(a)] for row in both)
        wg = tuple(row[len(a) :] for row in both)
        g = add(g, symmetrise(multiply(multiply(a, wg), transpose(a))))
        h = add(h, symmetrise(multiply(multiply(transpose(a), h), wa)))
        a = multiply(a, wa)
        memory = max(abs_sum(row) for row in a)
        if memory <= DECAY_TOLERANCE:
            break
    return memory, h


def _refine_covariance(
    phi: Matrix, qd: Matrix, c: Matrix, r: Matrix, gain: Matrix
) -> tuple[float, Matrix]:
    """Return the remaining memory and the covariance, (n, n), of an observer with this gain.

    One step of Newton's method on the Riccati equation (Hewer 1971, IEEE Trans. Autom. Control 16,
    382-384): P = S P S' + Qd + K R K' with K = Phi L, S = Phi - K C, solved by doubling as in Smith
    1968 (SIAM J. Appl. Math. 16). Only covariances are added, so there is no cancellation. The loop
    stops as in `_solve_by_doubling`.
    """
    k = multiply(phi, gain)
    s = subtract(phi, multiply(k, c))
    p = add(qd, symmetrise(multiply(multiply(k, r), transpose(k))))
    memory = math.inf
    for _ in range(MAX_DOUBLINGS):
        p = add(p, symmetrise(multiply(multiply(s, p), transpose(s))))
        s = multiply(s, s)
        memory = max(abs_sum(row) for row in s)
        if memory <= DECAY_TOLERANCE:
            break
    return memory, p


def _kalman_gain(p: Matrix, c: Matrix, r: Matrix) -> Matrix:
    """Return L = P C'(C P C' + R)^-1, (n, m), for symmetric P (n, n), C (m, n), R (m, m)."""
    output_covariance = multiply(c, p)
    return transpose(
        solve(symmetrise(add(multiply(output_covariance, transpose(c)), r)), output_covariance)
    )
