"""Interpolation: the meaning of `lookup`, each operation rounded to the number type.

ha_math has the same operations in the same order (codegen/templates/emit/ha_math.c.jinja).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

Points = Sequence[float]


@dataclass(frozen=True)
class Interpolation:
    """Linear interpolation in tables; outside of the axis the end value is held, a NaN gives a NaN.

    `round_value` rounds the double result of an operation to the number type.
    """

    round_value: Callable[[float], float]

    def lookup(self, axis: Points, size: int, values: Points, x: float) -> float:
        """Return the value of a one-dimensional table at x, interpolated linearly.

        `axis` and `values` have `size` points, at least 2; the points of the axis ascend. Outside
        of the axis the end value is returned, for a NaN a NaN.
        """
        low, part = self._find_cell(axis, size, x)
        return self._interpolate(values[low], values[low + 1], part)

    def lookup2(
        self,
        rows: Points,
        columns: Points,
        count: int,
        width: int,
        values: Points,
        x: float,
        y: float,
    ) -> float:
        """Return the value of a two-dimensional table at (x, y).

        The interpolation is linear in y along both rows, then in x. `rows` has `count` ascending
        points of x, `columns` has `width` of y; `values` are stored row by row. Outside of an axis
        its end is taken, for a NaN the result is a NaN.
        """
        row, down = self._find_cell(rows, count, x)
        column, along = self._find_cell(columns, width, y)
        first = row * width + column
        upper = self._interpolate(values[first], values[first + 1], along)
        lower = self._interpolate(values[first + width], values[first + width + 1], along)
        return self._interpolate(upper, lower, down)

    def _find_cell(self, axis: Points, size: int, x: float) -> tuple[int, float]:
        """Return the index of the interval of an axis that contains x, and x's fraction of it.

        The interval is found by bisection. The fraction is 0 below the axis, 1 above it and NaN for
        a NaN.
        """
        low, high = 0, size - 1
        if x <= axis[low]:
            return low, 0.0
        if x >= axis[high]:
            return high - 1, 1.0
        while high - low > 1:
            middle = low + (high - low) // 2
            if x < axis[middle]:
                high = middle
            else:
                low = middle
        before, whole = self.round_value(x - axis[low]), self.round_value(axis[high] - axis[low])
        return low, self.round_value(before / whole)

    def _interpolate(self, a: float, b: float, fraction: float) -> float:
        """Return a at fraction 0, b at 1 and above, and the linear interpolation between."""
        if fraction >= 1.0:
            return b
        return self.round_value(a + self.round_value(fraction * self.round_value(b - a)))
