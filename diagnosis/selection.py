"""Selection: which effects are accepted - one after the other, then each looked at again."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from diagnosis.bench import Bench
from diagnosis.estimate import Estimate
from diagnosis.evidence import evidence
from diagnosis.form import shown_form
from diagnosis.layers import Layer, has_parameters
from diagnosis.level import settled
from diagnosis.needed import Needed, renewed, still_needed
from diagnosis.plainer import led_by
from diagnosis.point import extended
from diagnosis.rival import rivals
from diagnosis.room import is_full
from diagnosis.search import Tell, Tried, searched
from diagnosis.share import counted
from diagnosis.strain import is_strained, within_range
from diagnosis.swap import swapped
from diagnosis.threshold import EVERYWHERE, USUAL, Thresholds

PART = 0.002
"""A further effect gains at least this part of what the one before it gained: a strong effect is
never described so well that nothing small is left beside it."""
HOPE, HOPE_BESIDE = 0.25, 0.5
"""Part of what it needs to gain that a candidate must promise to be fitted, alone and beside what
was accepted, where little is misjudged."""
NEXT = 7
"""Candidates that are looked at again beside two accepted ones, the best of the round before.
Beside one all are: what one hid may show itself."""
AGAIN = 15
"""Candidates that are looked at again where the model itself is found to fit better."""
MUCH = 0.1
"""Part of what the best candidate gained: a model that gains more has them looked for anew, and
candidates that gained less are not tried in another way."""
BETTER = 10.0
"""Nats by which a model must fit better for its candidates to be looked at again."""
MOST_EFFECTS = 3
OTHER = 5.0
"""Nats by which "none of these" trails the threshold in the probabilities."""


@dataclass(frozen=True)
class Selection:
    """What was accepted: `model` over `base`, the candidates of the first round, best first.

    `rivals` may be it as well as the first accepted one. `other` is the evidence
    [nats] for none of the candidates: that of a formula where one explains more.
    """

    base: Estimate = field(repr=False)
    model: Estimate = field(repr=False)
    accepted: tuple[Tried, ...]
    first_round: tuple[Tried, ...]
    rivals: tuple[Tried, ...]
    other: float = 2.0 * USUAL - OTHER

    @property
    def has_hidden(self) -> bool:
        """Whether an input that explains anything at all was accepted."""
        return any(not has_parameters(tried.layer) for tried in self.accepted)

    def probabilities(self) -> dict[str, float]:
        """Return the probability of each fitted candidate of the first round, and of `other`."""
        totals = {t.layer.id: t.score for t in self.first_round if t.evidence}
        totals["other"] = self.other
        most = max(totals.values())
        weights = {name: float(np.exp(0.5 * (total - most))) for name, total in totals.items()}
        whole = sum(weights.values())
        return {name: weight / whole for name, weight in weights.items()}


@dataclass(frozen=True)
class _Asked:
    """What a search for effects is given, the same in each round."""

    bench: Bench
    units: Mapping[str, float]
    thresholds: Thresholds
    left_out: float
    hope: float
    tell: Tell


@dataclass(frozen=True)
class _Found:
    """What the rounds so far have found, the `layers` to look at next and what one must gain."""

    base: Estimate
    model: Estimate
    accepted: tuple[Tried, ...] = ()
    first_round: tuple[Tried, ...] = ()
    layers: tuple[Layer, ...] = ()
    needed: float = 0.0


def selected(
    bench: Bench,
    base: Estimate,
    units: Mapping[str, float],
    thresholds: Thresholds = EVERYWHERE,
    tell: Tell = lambda text: None,
    left_out: float = 1.0,
    known: Sequence[Tried] = (),
    hope: float = HOPE,
) -> Selection:
    """Return the effects that the training recordings ask for: at most three, none too many.

    `left_out` is the part of the threshold that is asked for what is left out, `hope` the part that
    a candidate has to promise alone. `known` candidates, best first, were tried with the recordings
    read in another way: only the best are tried again.
    """
    asked = _Asked(bench, units, thresholds, left_out, hope, tell)
    found = _Found(base, base, layers=tuple(_near_best(known) or bench.layers()))
    goes_on = True
    while goes_on and len(found.accepted) < MOST_EFFECTS:
        found, goes_on = _one_more(asked, found)
    last = Needed(found.base, found.model, found.accepted)
    kept = still_needed(bench, last, units, thresholds, tell)
    first = tuple(renewed(found.first_round, found.accepted, kept.kept))
    return Selection(found.base, kept.model, kept.kept, first, rivals(first, kept.kept))


def _one_more(asked: _Asked, found: _Found) -> tuple[_Found, bool]:
    """Return what is found with one effect more, and whether yet another may be looked for."""
    bench, units, tell = asked.bench, asked.units, asked.tell
    if found.accepted and is_full(bench, found.model, units, asked.thresholds.usual):
        tell("free drifts find nothing more to do: no further effect is looked for")
        return found, False
    found, tried = _looked_for(asked, found)
    enough = _enough(tried, found.needed, asked.thresholds, asked.left_out)
    if enough is None:
        return found, False
    best, led = _led(bench, found.model, units, enough, tried)
    found = found if found.accepted else dataclasses.replace(found, first_round=tuple(led))
    if best.estimate is None or best.evidence is None:
        return found, False
    gained = counted(best.evidence, asked.left_out)
    tell(f"accepted {best.layer.id}: {gained:.0f} nats")
    before = [*found.accepted, best]
    together, there = swapped(bench, best.estimate, before, found.first_round, units, tell)
    if len(together) == MOST_EFFECTS and _strains(together, there, found.accepted, found.model):
        tell(f"{best.layer.id} pulls effects out of their ranges: it is not taken")
        return found, False
    first = tuple(renewed(found.first_round, before, together))
    layers = tuple(bench.layers()) if len(together) == 1 else _likely(tried, NEXT)
    return _Found(found.base, there, tuple(together), first, layers, PART * gained), True


def _looked_for(asked: _Asked, found: _Found) -> tuple[_Found, list[Tried]]:
    """Return candidates beside the model that was found, best first, and it or a better fit."""
    worth = (HOPE_BESIDE if found.accepted else asked.hope) * max(
        found.needed, asked.thresholds.usual
    )
    model, bench, units, tell = found.model, asked.bench, asked.units, asked.tell
    tried = searched(bench, model, units, found.layers, tell, worth, found.first_round)
    better, tried = looked_again(bench, model, units, tried, tell, worth)
    model = model if better is None else better
    if found.accepted:
        return dataclasses.replace(found, model=model), tried
    return dataclasses.replace(found, base=model, model=model, first_round=tuple(tried)), tried


def _led(
    bench: Bench, model: Estimate, units: Mapping[str, float], best: Tried, tried: list[Tried]
) -> tuple[Tried, list[Tried]]:
    """Return what the best candidate gives way to, or that one, and all with it, best first."""
    first = within_range(shown_form(bench, model, units, best, tried), tried)
    return (best, tried) if first is best else led_by(first, tried)


def _strains(
    together: Sequence[Tried], there: Estimate, accepted: Sequence[Tried], model: Estimate
) -> bool:
    """Tell whether effects are pulled out of their ranges by the last of them: it imitates, the
    others did not.
    """
    return is_strained(there, together) and not is_strained(model, accepted)


def _enough(
    tried: Sequence[Tried], needed: float, thresholds: Thresholds, left_out: float
) -> Tried | None:
    """Return the best candidate that gains what is needed."""
    return next(
        (
            t
            for t in tried
            if t.evidence and counted(t.evidence, left_out) > max(needed, thresholds.of(t.layer))
        ),
        None,
    )


def _likely(tried: Sequence[Tried], most: int) -> tuple[Layer, ...]:
    """Return the layers that are looked at again beside what was accepted."""
    return tuple({t.layer.id: t.layer for t in tried if t.promised > 0.0}.values())[:most]


def _near_best(known: Sequence[Tried]) -> list[Layer]:
    """Return the layers of the candidates that gained not much less than the best of them."""
    gains = {t.layer.id: (t.evidence.total, t.layer) for t in known if t.evidence}
    best = max((total for total, _ in gains.values()), default=0.0)
    return [layer for total, layer in gains.values() if total > 0.0 and total > MUCH * best]


def looked_again(
    bench: Bench,
    model: Estimate,
    units: Mapping[str, float],
    tried: list[Tried],
    tell: Tell = lambda text: None,
    worth: float = 0.0,
) -> tuple[Estimate | None, list[Tried]]:
    """Return a better fit of the model itself, if there is one, and the candidates beside it.

    Beside accepted effects they are only looked for again where one still gains what is `worth` it.
    """
    better = _better_base(bench, model, units, tried)
    if better is None:
        return None, tried
    tell(f"the model itself fits better: {better.cost:.0f} nats; candidates again")
    gained = model.cost - better.cost
    if _most(tried) * MUCH > gained or (model.candidate.layers and _most(tried) < gained + worth):
        return better, _compared(bench, better, tried)
    return better, _again(bench, better, units, tried, tell)


def _better_base(
    bench: Bench, model: Estimate, units: Mapping[str, float], tried: list[Tried]
) -> Estimate | None:
    """Return the model from where the best candidate left its parameters, if that is better.

    A model in a local minimum makes every candidate look good.
    """
    best = next(iter(tried), None)
    if best is None or best.estimate is None:
        return None
    start = extended(model.candidate, best.estimate.candidate, best.estimate.point, {})
    given = (best.estimate.noises, start, units)
    make = partial(settled, model.candidate, bench.series, *given, like=best.estimate)
    again = bench.kept("settled", model.candidate, (*given, best.estimate.gains), make)
    return again if again.cost < model.cost - BETTER else None


def _again(
    bench: Bench, model: Estimate, units: Mapping[str, float], tried: list[Tried], tell: Tell
) -> list[Tried]:
    """Return candidates beside a model that was found to fit better, looked for anew."""
    known = {t.layer.id: t for t in tried}
    promising = [other.layer for other in tried if other.promised > 0.0]
    for new in searched(bench, model, units, promising[:AGAIN], tell):
        old = known[new.layer.id].estimate
        if new.estimate and (old is None or new.estimate.cost < old.cost):
            known[new.layer.id] = new
    return _compared(bench, model, list(known.values()))


def _compared(bench: Bench, model: Estimate, tried: Sequence[Tried]) -> list[Tried]:
    """Return candidates with what they gain over a model, best first."""
    again = [
        dataclasses.replace(t, evidence=evidence(t.estimate, model, bench.series))
        if t.estimate
        else t
        for t in tried
    ]
    return sorted(again, key=lambda one: -one.score)


def _most(tried: Sequence[Tried]) -> float:
    return max((t.evidence.train for t in tried if t.evidence), default=0.0)
