"""Bar: what is asked of a figure, and whether it is met."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from statistics import fmean, median

import numpy as np

from tests.validation.blind_study.case_score import Answer
from tests.validation.blind_study.proportion import Rate, calibration_error, rate_of

SURE = 0.9
"""Probability from which a name counts as given for sure."""


@dataclass(frozen=True)
class Bar:
    """A figure: what is asked in words, what was measured, whether that is enough."""

    about: str
    asked: str
    measured: float
    met: bool
    text: str


Answers = Sequence[Answer]


def bars(every: Answers) -> list[Bar]:
    """Return all figures of a study that its plans have answers for."""
    found: list[Bar] = []
    of = {name: [one for one in every if one.plan == name] for name in PLANS}
    for name, make in PLANS.items():
        if of[name]:
            found += make(of[name])
    if of["full"] and of["clean"]:
        found += _repaired(of["full"], of["clean"])
        found.append(_cost(of["full"], of["clean"]))
    return found


def _full(full: Answers) -> list[Bar]:
    named = [one for one in full if one.is_named]
    slow = [one for one in full if one.label["rate_Hz"] == 100]
    least = min(by_effect(full).items(), key=lambda pair: pair[1].share)
    said = [(one.probability or 0.0, one.is_named) for one in full if one.named]
    sizes = [len(one.stated) for one in full if one.stated]
    return [
        _at_least("first name right", 0.95, rate_of(one.is_named for one in full)),
        _at_least("first name right at 100 Hz", 0.90, rate_of(one.is_named for one in slow)),
        _at_least(f"first name right, lowest rate of an effect ({least[0]})", 0.70, least[1]),
        _at_least("true effect in the stated set", 0.98, rate_of(one.is_stated for one in full)),
        _at_most("mean size of the stated set", 1.6, fmean(sizes or [0.0])),
        _at_most("largest stated set", 4, max(sizes, default=0)),
        _at_least("place right", 0.90, rate_of(one.is_placed() for one in full)),
        _at_least("place within the first two", 0.98, rate_of(one.is_placed(2) for one in full)),
        _at_least(
            f"names with probability >= {SURE:g} that are right",
            0.88,
            rate_of(right for probability, right in said if probability >= SURE),
        ),
        _at_most("expected calibration error of the probabilities", 0.08, calibration_error(said)),
        _at_most(
            "relative error of base parameters, 90th percentile",
            0.05,
            _percentile(_errors(named), 90),
        ),
    ]


def _clean(clean: Answers) -> list[Bar]:
    alarms = rate_of(one.is_alarm for one in clean)
    upper = alarms.interval()[1]
    return [
        Bar("false alarms", "<= 3 %", alarms.share, alarms.share <= 0.03, alarms.text),
        Bar(
            "false alarms, upper limit of the 95 % interval",
            "<= 6 %",
            upper,
            upper <= 0.06,
            f"{upper:.1%}",
        ),
    ]


def _weak(weak: Answers) -> list[Bar]:
    named, stated = (rate_of(f(one) for one in weak) for f in (_is_named, _is_stated))
    return [
        _at_least("at 0.3 x strength: first name right", 0.75, named),
        _at_least("at 0.3 x strength: true effect in the stated set", 0.85, stated),
    ]


def _pairs(pairs: Answers) -> list[Bar]:
    both = rate_of(set(one.ids) <= set(one.named) for one in pairs)
    return [_at_least("two effects: both named", 0.85, both)]


def _removed(removed: Answers) -> list[Bar]:
    unknown = rate_of(one.said == "unknown" and one.is_placed() for one in removed)
    wrong = rate_of((one.probability or 0.0) >= SURE for one in removed)
    return [
        _at_least("effect not in the library: `unknown` at the right place", 0.80, unknown),
        Bar(
            f"effect not in the library: wrong name with probability >= {SURE:g}",
            "<= 10 %",
            wrong.share,
            wrong.share <= 0.10,
            wrong.text,
        ),
    ]


PLANS: dict[str, Callable[[Answers], list[Bar]]] = {
    "full": _full,
    "clean": _clean,
    "weak": _weak,
    "pairs": _pairs,
    "removed": _removed,
}


def _repaired(full: Answers, clean: Answers) -> list[Bar]:
    """How much better the model is: as a whole, and of what lies above the clean twin's misfit."""
    floors = {one.case: one.misfit("after") for one in clean}
    falls, excesses = [], []
    for one in full:
        before, after, floor = one.misfit("before"), one.misfit("after"), floors.get(one.case)
        if not one.is_named or not before or after is None:
            continue
        falls.append(1.0 - after / before)
        if floor is not None and before > floor:
            excesses.append((before - after) / (before - floor))
    return [
        _share_at_least("reduction of held-out NRMSE, median of right names", 0.50, falls),
        _share_at_least("reduction above the noise floor, median", 0.80, excesses),
    ]


def by_effect(every: Answers) -> dict[str, Rate]:
    """Return how often each effect is named first."""
    names = sorted({one.true for one in every})
    return {name: rate_of(one.is_named for one in every if one.true == name) for name in names}


def _cost(full: Answers, clean: Answers) -> Bar:
    """What a case takes, and what one with an effect and one without do."""
    both, effect, none = (
        median(one.cpu_s for one in some) for some in ([*full, *clean], full, clean)
    )
    text = f"{both:.1f} ({effect:.1f} with an effect, {none:.1f} without)"
    return Bar("processor time per case [s], median", "<= 10", both, both <= 10.0, text)


def _errors(named: Answers) -> list[float]:
    return [error for one in named for error in one.base_errors]


def _percentile(values: Sequence[float], percent: float) -> float:
    return float(np.percentile(values, percent)) if values else float("inf")


def _is_named(one: Answer) -> bool:
    return one.is_named


def _is_stated(one: Answer) -> bool:
    return one.is_stated


def _at_least(about: str, asked: float, rate: Rate) -> Bar:
    return Bar(about, f">= {asked:.0%}", rate.share, rate.share >= asked, rate.text)


def _at_most(about: str, asked: float, measured: float) -> Bar:
    return Bar(about, f"<= {asked:g}", measured, measured <= asked, f"{measured:.3g}")


def _share_at_least(about: str, asked: float, shares: Sequence[float]) -> Bar:
    share = median(shares) if shares else 0.0
    return Bar(about, f">= {asked:.0%}", share, share >= asked, f"{share:.1%} of {len(shares)}")
