"""A model that follows a signal worse than a constant lacks something, whatever effects gain."""

from __future__ import annotations

import dataclasses
import math

import pytest

from diagnosis.report.diagnosis_report import unfollowed_signals, withdraw_nothing_missing
from diagnosis.result.verdict import DecisionOutcome, NamedEffect, Verdict
from diagnosis.validation.free_simulation import Misfit


def verdict(says: DecisionOutcome, nrmse: float) -> Verdict:
    held_out = {"w_em": Misfit(nrmse, nrmse, nrmse, nrmse)}
    fit = {"train": {}, "held_out": held_out}
    named = (NamedEffect("viscous_friction", "flow.w_em", {}),)
    effects, rivals = named if says == "effect" else (), named * 2 if says == "ambiguous" else ()
    return Verdict(says, effects, (), 1.0, rivals, (), fit, {}, None, 0.0)


@pytest.mark.parametrize("nrmse", [1.01, 9.19, math.inf, math.nan])
def test_what_is_missed_is_told_and_is_something_missing(nrmse: float) -> None:
    (text,) = unfollowed_signals(verdict("nothing_missing", nrmse))
    assert text.startswith("held out: free simulation misses `w_em` by ")
    assert withdraw_nothing_missing(verdict("nothing_missing", nrmse), [text]).verdict == "unknown"


@pytest.mark.parametrize("nrmse", [0.0, 0.01, 0.99])
def test_what_is_followed_stays_as_it_is(nrmse: float) -> None:
    given = verdict("nothing_missing", nrmse)
    assert not list(unfollowed_signals(given))
    assert withdraw_nothing_missing(given, []) == given


@pytest.mark.parametrize("says", ["effect", "ambiguous", "unknown"])
def test_a_verdict_that_something_is_missing_stays(says: DecisionOutcome) -> None:
    given = verdict(says, 2.0)
    assert withdraw_nothing_missing(given, ["missed"]) == given


def test_signals_that_are_followed_are_not_told() -> None:
    given = verdict("effect", 0.1)
    train = {"w_em": Misfit(2.0, 0.1, 1.0, 1.0), "w_s": Misfit(2.0, 1.5, 1.0, 1.0)}
    fit = {"train": train, "held_out": {}}
    (text,) = unfollowed_signals(dataclasses.replace(given, fit=fit))
    assert "`w_s` by 150 % of its spread" in text
