"""Wording: a diagnosis in plain words, for the console and the report."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from diagnosis.digits import quantity_text
from diagnosis.dossier import Dossier
from diagnosis.finding import told
from diagnosis.layers import Layer
from diagnosis.naming import place_path, verdict_id
from diagnosis.place_sentence import PLACES, place_sentence
from diagnosis.rival import CLOSE, is_close
from diagnosis.search import FULL_FITS, HOPELESS, WORTH, Tried
from diagnosis.selection import Selection
from diagnosis.threshold import Thresholds
from diagnosis.verdict import Misfit as FitMisfit, Named, Quantity

MOST_NAMED = 4
"""Most rivals, windows or findings told in a sentence."""


def headline(dossier: Dossier) -> str:
    """Return the verdict in one sentence."""
    verdict = dossier.verdict
    if dossier.ended:
        return f"Nothing is concluded yet: {dossier.ended}."
    if dossier.diagnosis is None:
        return "Nothing is concluded about the physics: these recordings are not usable."
    if verdict.verdict == "effect":
        named = " and ".join(_with_values(one) for one in verdict.effects)
        return f"`{dossier.name}` lacks {named}."
    if verdict.verdict == "ambiguous":
        names = [effect_at(one) for one in verdict.ambiguous_with]
        return (
            f"`{dossier.name}` lacks something, and these recordings cannot tell which of these "
            f"it is: {'; '.join(names)}."
        )
    if verdict.verdict == "unknown":
        like = _formula(dossier) or _nearest(dossier)
        return f"`{dossier.name}` lacks something that none of the effects tried explains{like}."
    return (
        f"`{dossier.name}` lacks nothing that these recordings show: with its parameters "
        f"recalibrated no effect gains the {dossier.case.thresholds.text} nats asked for."
    )


def _formula(dossier: Dossier) -> str:
    """Return what an unknown was turned into, as the end of a sentence."""
    found = dossier.diagnosis.description if dossier.diagnosis else None
    if found is None:
        return ""
    return f"; it is like `{found.text}` {PLACES[found.locus.section]} {found.locus.place}"


def _nearest(dossier: Dossier) -> str:
    """Return the effects that come nearest to what is unknown, as the end of a sentence."""
    names = [effect_at(one) for one in dossier.verdict.ambiguous_with]
    return f"; the nearest is {' or '.join(names[:MOST_NAMED])}" if names else ""


def effect_at(one: Named) -> str:
    """Return an effect with its place in words."""
    section, _, name = one.place.partition(".")
    return f"{one.id.replace('_', ' ')} {PLACES[section]} {name}"


def _with_values(one: Named) -> str:
    values = ", ".join(f"{name} = {quantity(q)}" for name, q in one.parameters.items())
    return f"{effect_at(one)} ({values})" if values else effect_at(one)


def quantity(one: Quantity) -> str:
    """Return a value with its standard deviation and unit."""
    return quantity_text(one)


def rounded(value: float) -> str:
    """Return a number with two digits that count, `100` and not `1e+02`."""
    return f"{float(f'{value:.2g}'):g}"


def improvement(dossier: Dossier) -> str:
    """Return what the model gains in free simulation, in one sentence; empty without a fit."""
    fit = dossier.verdict.fit
    parts = [
        f"{name.replace('_', ' ')}: {_misfits(signals)}" for name, signals in fit.items() if signals
    ]
    if not parts:
        return ""
    confirmed = {True: " - confirmed", False: " - not confirmed", None: ""}
    return f"misfit of free simulation, {'; '.join(parts)}{confirmed[dossier.verdict.confirmed]}"


def _misfits(signals: Mapping[str, FitMisfit]) -> str:
    found = []
    for name, one in signals.items():
        before, after = f"{100 * one.nrmse_before:.3g} %", f"{100 * one.nrmse_after:.3g} %"
        found.append(f"{name} {before}" if before == after else f"{name} {before} to {after}")
    return ", ".join(found)


def location(dossier: Dossier) -> str:
    """Return where something is missing, in one sentence; empty where nothing is."""
    found = dossier.diagnosis
    if found is None or dossier.verdict.verdict == "nothing_missing":
        return ""
    return place_sentence(dossier.verdict.location, found.bench)


def separation(dossier: Dossier) -> list[str]:
    """Return what would separate what was found from what it is confused with."""
    if dossier.diagnosis is None:
        return []
    selection = dossier.diagnosis.selection
    lines = [plan(dossier)] if plan(dossier) else []
    for tried in (*selection.accepted, *selection.rivals):
        effect = tried.layer.effect
        if effect.separated_by and effect.confused_with:
            name = verdict_id(tried.layer, dossier.automaton)
            others = ", ".join(effect.confused_with)
            lines.append(f"{name} from {others}: {'; '.join(effect.separated_by)}")
    return lines


def oscillation(dossier: Dossier) -> str:
    """Return until when the model follows the largest step; empty where nothing is missing."""
    found = dossier.diagnosis.shuffles if dossier.diagnosis else ()
    if not found or not found[0].differs or dossier.verdict.verdict == "nothing_missing":
        return ""
    text = found[0].sentence()
    if len(found) > 1:
        after = found[1]
        end = "to the end" if after.until >= after.length else f"until t = {after.until:.2f} s"
        text += f"; with what was found it fits {end}"
    return text


def plan(dossier: Dossier) -> str:
    """Return what to record to be sure, as it was simulated; empty where there is no doubt."""
    found = dossier.diagnosis.plan if dossier.diagnosis else None
    return found.sentence() if found else ""


def reason(tried: Tried, place: int, selection: Selection, thresholds: Thresholds) -> str:
    """Return why a candidate was accepted or not; `place` is its rank."""
    ids = {one.layer.id for one in selection.accepted}
    if tried.layer.id in ids:
        return "accepted"
    if tried.layer.id in {one.layer.id for one in selection.rivals}:
        if not selection.accepted:
            return "the nearest, but not what is missing"
        if is_close(tried, selection.accepted[0]):
            return f"cannot be told from the accepted one: within {CLOSE:g} nats of it"
        return "may be it as well: gains nearly as much as the best"
    known = tried.evidence
    if known is None:
        if tried.promised < WORTH:
            return f"not fitted: promises less than {WORTH:g} nats"
        best = max((t.evidence.train for t in selection.first_round if t.evidence), default=0.0)
        if tried.promised < HOPELESS * best:
            return f"not fitted: promises less than {100 * HOPELESS:g} % of what another gains"
        return f"not fitted: {FULL_FITS} others promise more"
    threshold = thresholds.of(tried.layer)
    if known.train <= threshold:
        return f"gains less than {threshold:.0f} nats in training"
    if known.left_out <= threshold:
        return f"gains less than {threshold:.0f} nats on parts that were left out"
    if not selection.accepted:
        return "ranked behind one that was not accepted"
    return "explains less than what was accepted" if place else "not needed beside the others"


def title(layer: Layer, dossier: Dossier) -> str:
    """Return the name of a candidate as verdicts have it."""
    return f"{verdict_id(layer, dossier.automaton)}@{place_path(layer)}"


def summary(dossier: Dossier) -> list[str]:
    """Return at most four lines: verdict, place, what else is to be told, improvement, doubt.

    Where all five are to be told, the second and third are one.
    """
    is_ambiguous = dossier.verdict.verdict == "ambiguous"
    more = plan(dossier) if is_ambiguous else oscillation(dossier)
    place, doubt = location(dossier), _doubt(dossier)
    if place and more and doubt:
        place, more = f"{place}; {more}", ""
    lines = [headline(dossier), place, more, improvement(dossier), doubt]
    return [line for line in lines if line]


def _doubt(dossier: Dossier) -> str:
    """Return what a reader has to know before believing the verdict."""
    worst = told([finding for finding in dossier.findings if finding.severity != "note"])
    if worst:
        more = f" (and {len(worst) - 1} more)" if len(worst) > 1 else ""
        return f"recordings: {worst[0][1]}{more}"
    verdict = dossier.verdict
    if verdict.verdict == "effect" and verdict.ambiguous_with:
        return f"nearly as good: {_first([effect_at(one) for one in verdict.ambiguous_with])}"
    return ""


def _first(names: Sequence[str]) -> str:
    more = f" and {len(names) - MOST_NAMED} more" if len(names) > MOST_NAMED else ""
    return ", ".join(names[:MOST_NAMED]) + more
