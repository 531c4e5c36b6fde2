"""How visible an effect is, and the size that makes it as visible as wanted."""

from collections.abc import Callable, Sequence
from math import log

import numpy as np
from scipy.optimize import least_squares

from .machines import Machine, rounded
from .manoeuvres import Plan
from .simulation import Array, Run, simulate, vector

COMPARED = 1500  # samples per recording and signal that the refit uses


def run_all(
    m: Machine, plans: Sequence[Plan], slots: dict[str, float], loads: Sequence[Array | None]
) -> list[Run]:
    """The recordings of the truth with these slots and disturbances."""
    p = m.parameters(slots)
    substeps = m.substeps * (2 if "FLEX_K" in slots else 1)
    return [
        simulate(p, 1 / m.rate, substeps, reference=q.reference, noise=q.noise, disturbance=load)
        for q, load in zip(plans, loads, strict=True)
    ]


def naive(m: Machine, base: dict[str, float], run: Run) -> Array:
    """Outputs of the naive model with this base and the recorded command."""
    return simulate(vector(m.mechanics(base)), 1 / m.rate, m.substeps, command=run.command).clean


def refit(m: Machine, runs: Sequence[Run]) -> Array:
    """RMS of the residual of each signal over its noise, after a refit of the base parameters."""
    names = list(m.base)
    noise = np.array(m.noise)
    strides = [max(1, len(run.command) // COMPARED) for run in runs]
    weights = [np.sqrt(s / sum(len(r.command) for r in runs)) for s in strides]

    def residual(x: Array) -> Array:
        base = {name: m.base[name] * np.exp(v) for name, v in zip(names, x, strict=True)}
        parts = []
        for run, stride, weight in zip(runs, strides, weights, strict=True):
            error = (naive(m, base, run) - run.clean)[::stride] / noise
            parts.append(np.clip(np.nan_to_num(error, nan=1e6), -1e6, 1e6).ravel() * weight)
        return np.concatenate(parts)

    start = np.zeros(len(names))
    fit = least_squares(
        residual, start, bounds=(-2, 2), diff_step=1e-4, xtol=1e-4, ftol=1e-3, max_nfev=12
    )
    return np.asarray(np.sqrt(np.sum(fit.fun.reshape(-1, len(noise)) ** 2, axis=0)))


def raw(m: Machine, runs: Sequence[Run], twins: Sequence[Run]) -> Array:
    """RMS difference of each signal to its clean twin over its noise, both without noise."""
    square = [(r.clean - t.clean) ** 2 for r, t in zip(runs, twins, strict=True)]
    return np.asarray(np.sqrt(np.concatenate(square).mean(axis=0)) / np.array(m.noise))


def usable(m: Machine, runs: Sequence[Run]) -> bool:
    """Whether the loop stays stable: bounded speeds, a command that is seldom at its limit."""
    for run in runs:
        limited = np.mean(np.abs(run.command) > 0.98 * m.f_max)
        if run.diverged or limited > 0.1 or np.abs(run.clean).max() > 2.5 * m.v_max:
            return False
    return True


class SizeNotFound(Exception):
    """No physical size makes the effect as visible as wanted."""


def find_size(
    m: Machine,
    run: Callable[[float], list[Run]],
    typical: float,
    largest: float,
    target: float,
    allowed: tuple[float, float],
) -> float:
    """The size whose largest visibility after a refit is the target, within 15 % or `allowed`.

    It has four digits, so that the last bits of the linear algebra do not matter.
    """
    low, high = 0.0, largest  # the size is between these, as far as known
    size, last = rounded(min(typical, largest), 4), None
    best: tuple[float, float] | None = None
    for _ in range(9):
        runs = run(size)
        value = float(refit(m, runs).max()) if usable(m, runs) else np.inf
        if allowed[0] <= value <= allowed[1]:
            miss = abs(log(value / target))
            if best is None or miss < best[0]:
                best = (miss, size)
            if miss < 0.15:
                break
        if value < target:
            low = size
            if size >= 0.999 * largest:
                break
        else:
            high = size
        power = 1.0
        if last and 0 < last[1] < np.inf and 0 < value < np.inf and last[0] != size:
            power = min(3.0, max(0.4, log(value / last[1]) / log(size / last[0])))
        last = (size, value)
        guess = size * (target / value) ** (1 / power) if 0 < value < np.inf else size / 3
        if not low < guess < high:
            guess = largest if guess >= largest == high else (low + high) / 2
        size = rounded(min(guess, largest), 4)
    if best is None:
        raise SizeNotFound
    return best[1]
