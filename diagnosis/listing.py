"""Listing: the tables of a report, as texts."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from diagnosis import wording
from diagnosis.digits import change, per_cent, probability, significant
from diagnosis.dossier import Dossier
from diagnosis.locus import Locus
from diagnosis.search import Tried
from diagnosis.selection import Selection
from diagnosis.worst_window import FreeRuns, by_recording

MOST_WINDOWS = 6
LOOSE = 0.3
"""A correlation below this is not told."""
SAME = 0.02
"""Part of a misfit below which a change is none."""


@dataclass(frozen=True)
class Cell:
    """A misfit without and with what was found, what has changed, and whether to the `better`."""

    before: str
    after: str
    change: str
    trend: str


@dataclass(frozen=True)
class FitRow:
    """Misfits of one recording, or of a whole set, signal by signal."""

    name: str
    words: str
    cells: tuple[Cell, ...]
    is_sum: bool = False


def fit_rows(dossier: Dossier, words: str, part: str, runs: FreeRuns) -> list[FitRow]:
    """Return the misfits [SI] of each recording of a set, then those of all over their spread."""
    rows = []
    for name, before, after in by_recording(runs):
        pairs = zip(before, after, strict=True)
        cells = tuple(_cell(float(a), float(b), significant) for a, b in pairs)
        rows.append(FitRow(name, words, cells))
    whole = dossier.verdict.fit.get(part, {})
    sums = tuple(_cell(one.nrmse_before, one.nrmse_after, per_cent) for one in whole.values())
    return [*rows, FitRow("all together, over the spread of the signal", words, sums, True)]


def _cell(before: float, after: float, text: Callable[[float], str]) -> Cell:
    part = after / before - 1.0 if before > 0.0 else 0.0
    trend = "same" if abs(part) < SAME else "better" if part < 0.0 else "worse"
    return Cell(text(before), text(after), change(before, after), trend)


@dataclass(frozen=True)
class CandidateRow:
    """A candidate: `bar` is its gain as a part of the largest, in per cent."""

    effect: str
    place: str
    train: str
    left_out: str
    probability: str
    bar: float
    reason: str
    is_accepted: bool


def candidate_rows(dossier: Dossier, selection: Selection) -> list[CandidateRow]:
    """Return those that were fitted: what was accepted first, then by rank."""
    ids = {one.layer.id for one in selection.accepted}
    first = [one for one in selection.first_round if one.layer.id not in ids]
    listed = [one for one in (*selection.accepted, *first) if one.evidence]
    most = max([one.evidence.train for one in listed if one.evidence] + [1.0])
    shares = selection.probabilities()
    return [_row(dossier, selection, one, k, most, shares) for k, one in enumerate(listed)]


def _row(
    dossier: Dossier,
    selection: Selection,
    tried: Tried,
    rank: int,
    most: float,
    shares: Mapping[str, float],
) -> CandidateRow:
    assert tried.evidence
    known, share = tried.evidence, shares.get(tried.layer.id)
    is_accepted = tried.layer.id in {one.layer.id for one in selection.accepted}
    reason = wording.reason(tried, rank, selection, dossier.case.thresholds)
    if is_accepted and dossier.verdict.verdict == "ambiguous":
        reason = "best, but not told from others: laid in what is shown here"
    if is_accepted and dossier.verdict.verdict == "unknown":
        reason = "a formula, no effect of the library: laid in what is shown here"
    effect, _, place = wording.title(tried.layer, dossier).partition("@")
    return CandidateRow(
        effect,
        place,
        _nats(known.train),
        _nats(known.left_out),
        "" if share is None else probability(share),
        100.0 * max(known.train, 0.0) / most,
        reason,
        is_accepted,
    )


def _nats(gain: float) -> str:
    return f"{gain:.0f}" if math.isfinite(gain) else "diverges"


def unfitted(dossier: Dossier, selection: Selection) -> list[tuple[str, list[str]]]:
    """Return why the other candidates were not fitted, each reason with their names."""
    found: dict[str, list[str]] = {}
    ids = {one.layer.id for one in selection.accepted}
    for tried in selection.first_round:
        if not tried.evidence and tried.layer.id not in ids:
            why = wording.reason(tried, 0, selection, dossier.case.thresholds)
            found.setdefault(why, []).append(wording.title(tried.layer, dossier))
    return list(found.items())


def place_rows(locus: Locus, most: int = MOST_WINDOWS) -> list[tuple[str, str]]:
    """Return what is known of what is missing at a place: modes, windows, companions."""
    modes = sorted(locus.modes.items(), key=lambda pair: -pair[1])
    shares = [f"{name} {per_cent(share)}" for name, share in modes if share >= 0.005]
    shares = shares if len(modes) > 1 else []
    windows = [f"{file} {start:.2f}-{end:.2f} s" for start, end, file in locus.windows]
    more = len(windows) - most
    told = ", ".join(windows[:most]) + (f" and {more} more" if more > 0 else "")
    along = [f"{name} (correlation {r:.2f})" for name, r in locus.along if abs(r) >= LOOSE]
    rows = [
        ("strongest in", told),
        ("by mode", ", ".join(shares)),
        ("goes along with", ", ".join(along)),
    ]
    return [row for row in rows if row[1]]


def recording_rows(dossier: Dossier) -> list[tuple[str, ...]]:
    """Return name, length, rate, lost samples and findings of each training recording."""
    check = dossier.check
    rows: list[tuple[str, ...]] = []
    for name in dict.fromkeys(one.recording for one in check.channels):
        channels = [one for one in check.channels if one.recording == name]
        length = max(one.end for one in channels) - min(one.start for one in channels)
        rates = sorted({round(one.rate) for one in channels if math.isfinite(one.rate)})
        lost = max(one.dropped for one in channels)
        found = [one.severity for one in check.findings if one.recording == name]
        worst = ", ".join(f"{found.count(s)} {s}" for s in ("error", "warning") if s in found)
        used = "not used" if name in dossier.left_out else "training"
        if dossier.diagnosis is None:
            used = "not used"
        rate = "-".join(f"{rate}" for rate in (rates[:1] + rates[1:][-1:]))
        rows.append(
            (
                name,
                used,
                f"{length:.1f} s",
                f"{rate} Hz",
                per_cent(lost) if lost else "none",
                worst or "none",
            )
        )
    return rows


def untestable(dossier: Dossier) -> list[tuple[str, str]]:
    """Return what recordings would have to show, and the effects that ask for it."""
    lacking: dict[str, list[str]] = {}
    for one in dossier.check.excitation.effects:
        if one.lacking:
            lacking.setdefault(" and ".join(one.lacking), []).append(one.effect)
    return [(needs, ", ".join(names)) for needs, names in lacking.items()]


def noise_words(selection: Selection, signals: Sequence[str], units: Sequence[str]) -> str:
    """Return the noise of the recorded signals: no model misses less."""
    noise = selection.base.noises.seen
    parts = zip(signals, noise, units, strict=True)
    return ", ".join(f"{name} {significant(float(sd), 2)} {unit}" for name, sd, unit in parts)


def in_parts(text: str) -> list[tuple[str, bool]]:
    """Return a sentence in parts, with whether each stood between back quotes."""
    return [(part, place % 2 == 1) for place, part in enumerate(text.split("`"))]
