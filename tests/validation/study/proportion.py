"""Rate: a share of a count with its Wilson interval, and how well probabilities are calibrated."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import sqrt
from statistics import NormalDist, fmean

BINS = 10


@dataclass(frozen=True)
class Rate:
    """`hits` of `count`."""

    hits: int
    count: int

    @property
    def share(self) -> float:
        """The share; 0 of nothing."""
        return self.hits / self.count if self.count else 0.0

    def interval(self, confidence: float = 0.95) -> tuple[float, float]:
        """Return the Wilson score interval (E. B. Wilson 1927) of the share."""
        if not self.count:
            return 0.0, 1.0
        z = NormalDist().inv_cdf(0.5 + confidence / 2.0)
        spread = 1.0 + z * z / self.count
        middle = (self.share + z * z / (2.0 * self.count)) / spread
        part = self.share * (1.0 - self.share) / self.count + (z / (2.0 * self.count)) ** 2
        half = z * sqrt(part) / spread
        return max(0.0, middle - half), min(1.0, middle + half)

    @property
    def text(self) -> str:
        """The rate as it is printed."""
        low, high = self.interval()
        return f"{self.share:.1%} ({low:.1%} to {high:.1%}) of {self.count}"


def rate_of(hits: Iterable[bool]) -> Rate:
    """Return how many are true."""
    every = list(hits)
    return Rate(sum(every), len(every))


@dataclass(frozen=True)
class Bin:
    """Probabilities that are close: their mean, and how many of what they said was right."""

    mean: float
    right: Rate


def reliability(said: Sequence[tuple[float, bool]]) -> list[Bin]:
    """Return the filled ones of ten equal bins of probabilities and of what was right."""
    bins: list[list[tuple[float, bool]]] = [[] for _ in range(BINS)]
    for probability, right in said:
        bins[min(int(probability * BINS), BINS - 1)].append((probability, right))
    return [
        Bin(fmean(probability for probability, _ in one), rate_of(right for _, right in one))
        for one in bins
        if one
    ]


def calibration_error(said: Sequence[tuple[float, bool]]) -> float:
    """Return the expected calibration error (Naeini, Cooper, Hauskrecht 2015); 0 of nothing."""
    bins = reliability(said)
    off = sum(one.right.count * abs(one.right.share - one.mean) for one in bins)
    return off / len(said) if said else 0.0
