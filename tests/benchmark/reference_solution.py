"""Truth: the driveline by Taylor series with 40 digits, its events by bisection on them.

In each mode the rates are polynomials of the states, so that the coefficients of the series follow
from one another (Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, I.8).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import mpmath as mp
import numpy as np
from numpy.typing import NDArray

from tests.benchmark.manoeuvre import Manoeuvre

DIGITS = 40
TERMS = 30
"""Powers of the series: at 5 ms the ratio of two terms is below 2 / 30, so 1e-30 is left."""
STEP = 5
"""Step of the series [ms]."""
HALVINGS = 90
"""Of a step, to locate a change of mode: 5 ms / 2^90 = 4e-30 s."""

Point = list[mp.mpf]
Series = list[list[mp.mpf]]


@dataclass(frozen=True)
class Solution:
    """Events as (time [s], mode), and the motor's speed [rad/s] (n,) at some milliseconds (n,)."""

    events: tuple[tuple[float, int], ...]
    milliseconds: tuple[int, ...]
    w_em: NDArray[np.float64]


@dataclass(frozen=True)
class Accuracy:
    """How a solution differs from the truth.

    `is_complete`: every event is there, in order, none twice; `late` is the largest error of an
    event [s]; `rms` and `largest` are the errors of the motor's speed over its peak: the root of
    the mean square over the run, and the largest.
    """

    is_complete: bool
    events: int
    late: float
    rms: float
    largest: float


def accuracy(found: Solution, expected: Solution) -> Accuracy:
    """Return how a solution differs from one that has every millisecond."""
    modes = [[mode for _, mode in one.events] for one in (found, expected)]
    times = zip(found.events, expected.events, strict=False)
    late = max((abs(ours - theirs) for (ours, _), (theirs, _) in times), default=0.0)
    off = np.abs(found.w_em - expected.w_em[list(found.milliseconds)])
    peak = float(np.max(np.abs(expected.w_em)))
    rms, largest = float(np.sqrt(np.mean(off**2))) / peak, float(np.max(off)) / peak
    return Accuracy(modes[0] == modes[1], len(found.events), float(late), rms, largest)


@cache
def reference_solution(case: Manoeuvre) -> Solution:
    """Return the solution of a manoeuvre."""
    with mp.workdps(DIGITS):
        return _Series(case).run()


class _Series:
    """The states w_em, w_w, theta_d, theta_b in contact (mode 1 or -1) or in the gap (0)."""

    def __init__(self, case: Manoeuvre) -> None:
        self.case = case
        values = {name: mp.mpf(text) for name, text in case.parameters.items()}
        self.p = values
        r_w, weight = values["r_w"], values["m"] * values["g"]
        self.inertia = values["m"] * r_w**2 + 4 * values["J_wh"]
        self.drag = (
            weight * r_w * values["C_0"],
            weight * r_w * values["C_1"] + values["b_w"],
            weight * r_w * values["C_2"] + values["a_aer"] * r_w**3,
        )
        self.mode = 1
        self.torque = mp.mpf(case.torques[0])
        self.point: Point = [mp.mpf(v.numerator) / v.denominator for v in case.start()]
        self.events: list[tuple[float, int]] = []
        self.w_em: list[float] = [float(self.point[0])]

    def run(self) -> Solution:
        for step in range(0, self.case.horizon_ms, STEP):
            if step == self.case.step_ms:
                self.torque = mp.mpf(self.case.torques[1])
            self._step(step)
        return Solution(tuple(self.events), tuple(range(len(self.w_em))), np.array(self.w_em))

    def _step(self, start: int) -> None:
        """Move over one step from mode to mode; keep the speed at each millisecond of it."""
        now, end = mp.mpf(0), mp.mpf(STEP) / 1000
        kept = 1
        while now < end:
            series = self._series()
            length, is_event = self._length(series, end - now)
            while kept <= STEP and mp.mpf(kept) / 1000 <= now + length:
                self.w_em.append(float(_at(series[0], mp.mpf(kept) / 1000 - now)))
                kept += 1
            self.point = [_at(one, length) for one in series]
            now += length
            if is_event:
                self._jump()
                self.events.append((float(mp.mpf(start) / 1000 + now), self.mode))

    def _series(self) -> Series:
        """Return the coefficients of each state over the time [s] from now."""
        p, torque = self.p, self.torque
        em, w, d, b = ([value] for value in self.point)
        for n in range(TERMS):
            is_first = 1 if n == 0 else 0
            twist, slip = d[n] - b[n], em[n] / p["R"] - w[n]
            shaft = p["k_hs"] * twist + p["c_hs"] * slip if self.mode else mp.mpf(0)
            square = mp.fsum(w[i] * w[n - i] for i in range(n + 1))
            load = self.drag[0] * is_first + self.drag[1] * w[n] + self.drag[2] * square
            em_rate = (torque * is_first - shaft / p["R"] - p["b_em"] * em[n]) / p["J_em"]
            b_rate = mp.mpf(0) if self.mode else slip + p["k_hs"] / p["c_hs"] * twist
            for one, rate in ((em, em_rate), (w, (shaft - load) / self.inertia)):
                one.append(rate / (n + 1))
            for one, rate in ((d, slip), (b, b_rate)):
                one.append(rate / (n + 1))
        return [em, w, d, b]

    def _inside(self, series: Series, time: mp.mpf) -> bool:
        """Tell whether the mode still holds a time [s] from now."""
        p = self.p
        em, w, d, b = (_at(one, time) for one in series)
        free = em / p["R"] - w + p["k_hs"] / p["c_hs"] * (d - b)
        if self.mode:
            return bool(self.mode * free >= 0)
        return not ((b >= p["alpha"] and free > 0) or (b <= -p["alpha"] and free < 0))

    def _length(self, series: Series, left: mp.mpf) -> tuple[mp.mpf, bool]:
        """Return how long the mode holds within what is left [s], and whether it ends there.

        Half a millisecond is the shortest stay in a mode that is looked for.
        """
        parts = int(mp.ceil(left * 2000))
        for part in range(1, parts + 1):
            low, high = left * (part - 1) / parts, left * part / parts
            if not self._inside(series, high):
                for _ in range(HALVINGS):
                    middle = (low + high) / 2
                    low, high = (middle, high) if self._inside(series, middle) else (low, middle)
                return high, True
        return left, False

    def _jump(self) -> None:
        if self.mode:
            self.mode = 0
            return
        self.mode = 1 if self.point[3] > 0 else -1
        self.point[3] = self.mode * self.p["alpha"]


def _at(series: list[mp.mpf], time: mp.mpf) -> mp.mpf:
    value = series[-1]
    for coefficient in series[-2::-1]:
        value = value * time + coefficient
    return value
