"""Interpolation: the meaning of `lookup`, each operation rounded to the number type.

ha_math has the same operations in the same order (codegen/templates/ha_math.c.jinja).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

Points = Sequence[float]


@dataclass(frozen=True)
class Interpolation:
    """Tables in one number type: linear between points, held outside, NaN at NaN."""

    rounded: Callable[[float], float]

    def lookup(self, axis: Points, size: int, values: Points, x: float) -> float:
        """Return the value of a table at x."""
        low, part = self._cell(axis, size, x)
        return self._blend(values[low], values[low + 1], part)

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
        """Return the value of a table at (x, y): linear in y along both rows, then in x."""
        row, down = self._cell(rows, count, x)
        column, along = self._cell(columns, width, y)
        first = row * width + column
        upper = self._blend(values[first], values[first + 1], along)
        lower = self._blend(values[first + width], values[first + width + 1], along)
        return self._blend(upper, lower, down)

    def _cell(self, axis: Points, size: int, x: float) -> tuple[int, float]:
        """Return the interval of an axis that x is in, by bisection, and the part of it before x.

        Outside, the part is 0 or 1; of NaN it is NaN.
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
        before, whole = self.rounded(x - axis[low]), self.rounded(axis[high] - axis[low])
        return low, self.rounded(before / whole)

    def _blend(self, a: float, b: float, part: float) -> float:
        """Return a at 0, b at 1, linear between."""
        if part >= 1.0:
            return b
        return self.rounded(a + self.rounded(part * self.rounded(b - a)))
