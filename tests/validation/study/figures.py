"""Figures of the study: means over generators with equal weight, with bootstrap intervals."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from tests.validation.study.case_score import SURE, Answer
from tests.validation.study.proportion import calibration_error

REPEATS = 1000
"""Bootstrap samples of an interval."""
SEED = 1
Value = Any
Score = Callable[[Answer, bool], Value]
"""The value of a case, None if it does not count; True as second argument is the strict score."""
Statistic = Callable[[Sequence[Value]], float]


@dataclass(frozen=True)
class Figure:
    """A figure over the cases of some `groups`; `required` is its limit in words.

    `unit` is `%` for shares. `has_names` tells whether accepted names change the figure.
    """

    about: str
    required: str
    groups: tuple[str, ...]
    score: Score
    statistic: Statistic
    unit: str = "%"
    has_names: bool = False

    def values(self, answers: Sequence[Answer], is_strict: bool = False) -> list[Value]:
        """Return the values of the cases that count."""
        some = (self.score(one, is_strict) for one in answers if one.group in self.groups)
        return [value for value in some if value is not None]


@dataclass(frozen=True)
class Measured:
    """A figure: its mean over generators with the 95 % interval, and that of each generator.

    A generator without cases has none; NaN if there is no generator.
    """

    figure: Figure
    mean: float
    low: float
    high: float
    by_generator: Mapping[str, float]

    @property
    def mean_text(self) -> str:
        """The mean with its interval."""
        if not self.by_generator:
            return ""
        low, high = (self.format(value) for value in (self.low, self.high))
        return f"{self.format(self.mean)} ({low} to {high})"

    def text_of(self, generator: str) -> str:
        """Return the figure of a generator; empty if it has none."""
        return self.format(self.by_generator[generator]) if generator in self.by_generator else ""

    def format(self, value: float) -> str:
        """Return a value with its unit."""
        if self.figure.unit == "%":
            return f"{100.0 * value:.1f} %"
        return f"{value:.3g}{f' {self.figure.unit}' if self.figure.unit else ''}"


def measure(figure: Figure, answers: Sequence[Answer], is_strict: bool = False) -> Measured:
    """Return a figure of answers.

    The interval is that of a percentile bootstrap over the cases within each generator (Efron,
    Tibshirani 1993).
    """
    names = dict.fromkeys(one.generator for one in answers)
    values = {
        name: figure.values([one for one in answers if one.generator == name], is_strict)
        for name in names
    }
    values = {name: some for name, some in values.items() if some}
    if not values:
        return Measured(figure, np.nan, np.nan, np.nan, {})
    each = {name: figure.statistic(some) for name, some in values.items()}
    rng = np.random.default_rng(SEED)
    drawn = np.mean([_bootstrap(figure.statistic, some, rng) for some in values.values()], axis=0)
    low, high = np.percentile(drawn, [2.5, 97.5])
    return Measured(figure, float(np.mean(list(each.values()))), float(low), float(high), each)


def _bootstrap(statistic: Statistic, values: list[Value], rng: np.random.Generator) -> list[float]:
    """Return the statistic of `REPEATS` samples with replacement."""
    picks = rng.integers(len(values), size=(REPEATS, len(values))).tolist()
    return [statistic([values[k] for k in pick]) for pick in picks]


def _mean(values: Sequence[Value]) -> float:
    return float(sum(values)) / len(values)


def _median(values: Sequence[Value]) -> float:
    return float(np.median(values))


def _sure(one: Answer, is_strict: bool) -> bool | None:
    """Return whether a name with a probability of `SURE` or more is right."""
    if not one.named or (one.probability or 0.0) < SURE:
        return None
    return one.is_named(is_strict)


def _probability(one: Answer, is_strict: bool) -> tuple[float, bool] | None:
    """Return the probability of a name and whether the name is right."""
    if not one.named or one.probability is None:
        return None
    return one.probability, one.is_named(is_strict)


NAMES = ("full", "weak", "clean")
EVERY = ("full", "clean", "weak", "pairs", "removed")
_share = partial(Figure, statistic=_mean)
FIGURES = (
    _share("first name right", ">= 88 %", ("full",), lambda a, s: a.is_named(s), has_names=True),
    _share(
        "first name right in a verdict that is not `ambiguous`", "", ("full",),
        lambda a, s: a.is_alone_named(s), has_names=True,
    ),
    _share(
        "right name in the stated set", ">= 95 %", ("full",), lambda a, s: a.is_stated(s),
        has_names=True,
    ),
    _share(
        "mean size of the stated set", "<= 1.8", ("full",), lambda a, s: len(a.stated) or None,
        unit="",
    ),
    _share("first place right", ">= 95 %", ("full",), lambda a, s: a.is_placed),
    _share("false alarms", "<= 3 %", ("clean",), lambda a, s: a.is_alarm),
    _share(
        "0.3 x strength: first name right", ">= 70 %", ("weak",),
        lambda a, s: a.is_named(s) if a.is_visible else None, has_names=True,
    ),
    _share(
        "two effects: both named", ">= 70 %", ("pairs",), lambda a, s: a.are_all_named(s),
        has_names=True,
    ),
    _share(
        "effect not in the library: `unknown` or a relative, at the right place", ">= 75 %",
        ("removed",), lambda a, s: a.is_unknown(s), has_names=True,
    ),
    _share("names with a probability >= 0.9 that are right", ">= 92 %", NAMES, _sure,
           has_names=True),
    Figure("expected calibration error", "<= 0.06", NAMES, _probability, calibration_error, "",
           has_names=True),
    Figure("held-out misfit removed, median", ">= 75 %", ("full",), lambda a, s: a.removed_misfit,
           _median),
    _share("held-out misfit larger than before", "<= 2 %", ("full", "clean", "weak", "pairs"),
           lambda a, s: a.is_worse),
    Figure("processor time per case, median", "", ("full", "clean"), lambda a, s: a.cpu_s, _median,
           "s"),
    _share("no verdict", "0 %", EVERY, lambda a, s: not a.verdict),
)  # fmt: skip
"""All figures of the page, in its order."""
