"""Cards: what a reader wants to know first, in four short answers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from diagnosis import wording
from diagnosis.digits import change, per_cent, probability
from diagnosis.dossier import Dossier
from diagnosis.finding import told
from diagnosis.listing import place_rows
from diagnosis.search import Tried
from diagnosis.selection import Selection
from diagnosis.whiteness import Whiteness

MOST_LINES = 4


@dataclass(frozen=True)
class Card:
    """A question and its answer, line by line."""

    title: str
    lines: tuple[str, ...]


def cards_of(dossier: Dossier, left: Sequence[Whiteness] = ()) -> list[Card]:
    """Return the answers: where, how sure, how much better, what to keep in mind.

    `left` is what the model with what was found leaves over, signal by signal.
    """
    if dossier.diagnosis is None:
        return []
    selection = dossier.diagnosis.selection
    cards = [_where(dossier), _sure(dossier, selection), _better(dossier), _doubt(dossier, left)]
    return [card for card in cards if card.lines]


def _where(dossier: Dossier) -> Card:
    verdict = dossier.verdict
    named = verdict.effects or verdict.ambiguous_with
    lines = [wording.effect_at(one) for one in named]
    if verdict.verdict == "unknown":
        lines = [f"most at {one.path}" for one in verdict.location[:1] if one.gain > 0.0]
    if not lines:
        return Card("Where", ("nowhere: no place asks for more than the model has",))
    rows = dict(place_rows(verdict.location[0], 2)) if verdict.location else {}
    lines = [*dict.fromkeys(lines)][:MOST_LINES]
    lines += [f"{words} {rows[words]}" for words in ("by mode", "strongest in") if words in rows]
    return Card("Where", tuple(lines))


def _sure(dossier: Dossier, selection: Selection) -> Card:
    fitted = [one for one in selection.first_round if one.evidence]
    count = f"{len(selection.first_round)} candidates, {len(fitted)} fitted in full"
    lines = []
    if selection.accepted:
        shares = selection.probabilities()
        for one in (selection.accepted[0], *selection.rivals):
            if one.layer.id in shares:
                lines.append(f"{probability(shares[one.layer.id])} probable: {one.layer.id}")
        lines += [f"best of {count}", *(_gain(one) for one in selection.accepted)]
        lines.append(f"{dossier.case.thresholds.text} nats are needed")
    else:
        lines.append(f"none of {count}, gains enough")
        best = max(fitted, key=_least, default=None)
        if best is not None:
            lines += [
                f"best: {_gain(best)}",
                f"{dossier.case.thresholds.text} nats are needed in both",
            ]
    confirmed = {
        True: "better on recordings that were held out, too",
        False: "not better on recordings that were held out",
        None: "",
    }[dossier.verdict.confirmed]
    return Card("How sure", (*lines, confirmed) if confirmed else tuple(lines))


def _least(tried: Tried) -> float:
    return tried.evidence.least if tried.evidence else 0.0


def _gain(tried: Tried) -> str:
    assert tried.evidence
    known = tried.evidence
    return f"{tried.layer.id}: {known.train:.0f} nats in training, {known.left_out:.0f} left out"


def _better(dossier: Dossier) -> Card:
    fit = dossier.verdict.fit
    part = "held_out" if fit.get("held_out") else "train"
    lines = []
    has_model = bool(dossier.diagnosis and dossier.diagnosis.selection.accepted)
    for name, one in fit.get(part, {}).items():
        before, after = per_cent(one.nrmse_before), per_cent(one.nrmse_after)
        if has_model:
            moved = change(one.nrmse_before, one.nrmse_after)
            lines.append(f"{name}: {before} \N{RIGHTWARDS ARROW} {after} ({moved})")
        else:
            lines.append(f"{name}: {before}")
    title = "How much better" if has_model else "How well it fits"
    words = "held-out" if part == "held_out" else "training"
    return Card(title, (f"misfit of free simulation, {words} recordings", *lines))


def _doubt(dossier: Dossier, left: Sequence[Whiteness]) -> Card:
    verdict = dossier.verdict
    coloured = [one.signal for one in left if one.words == "coloured"]
    lines = []
    if coloured:
        lines.append(f"{', '.join(coloured)}: what is left is not noise alone")
    if verdict.verdict == "ambiguous":
        lines.append("more than one effect explains it: see what to record to be sure")
    if verdict.verdict == "effect":
        rivals = [wording.effect_at(one) for one in verdict.ambiguous_with]
        lines.append(
            f"nearly as good: {', '.join(rivals)}"
            if rivals
            else "no rival that was fitted comes close"
        )
    findings = [text for severity, text in told(dossier.findings) if severity != "note"]
    lines += [findings[0].replace("`", "")] if findings else ["nothing odd in the recordings"]
    lacking = sum(not one.is_testable for one in dossier.check.excitation.effects)
    if lacking:
        whole = len(dossier.check.excitation.effects)
        lines.append(f"{lacking} of {whole} effects are hardly testable with these recordings")
    return Card("Keep in mind", tuple(lines[:MOST_LINES]))
