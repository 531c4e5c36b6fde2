"""Shown: both models beside one set of recordings - free runs, worst window, what is missed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from diagnosis.adaptation import adapted
from diagnosis.dossier import Dossier
from diagnosis.estimate import Estimate
from diagnosis.series import Series
from diagnosis.whiteness import Whiteness, whiteness_of
from diagnosis.worst_window import FreeRuns, WorstWindow, free_runs, worst_window
from language.known import unit_text
from language.map import column_dimension


@dataclass(frozen=True)
class Shown:
    """One set of recordings: `part` as verdicts call it, `words` for a reader; `units` by signal.

    `before` and `after` say how white the innovations of both models are.
    """

    part: str
    words: str
    runs: FreeRuns = field(repr=False)
    units: tuple[str, ...]
    window: WorstWindow = field(repr=False)
    before: tuple[Whiteness, ...] = field(repr=False)
    after: tuple[Whiteness, ...] = field(repr=False)


def shown_of(dossier: Dossier) -> list[Shown]:
    """Return what was held out, then what was trained on; nothing without a diagnosis."""
    found = dossier.diagnosis
    if found is None:
        return []
    base, model = found.selection.base, found.selection.model
    sets = [_shown(dossier, "train", "training", base, model, found.bench.series)]
    if found.held_out:
        held = found.held_out
        both = adapted(base, held), adapted(model, held)
        sets.insert(0, _shown(dossier, "held_out", "held-out", *both, held))
    return sets


def _shown(
    dossier: Dossier,
    part: str,
    words: str,
    base: Estimate,
    model: Estimate,
    series: Sequence[Series],
) -> Shown:
    runs = free_runs(base, model, series)
    columns = {one.compare: one for one in dossier.case.mapping.columns.values()}
    units = tuple(unit_text(column_dimension(columns[name])) for name in runs.signals)
    period = float(series[0].period)
    window = worst_window(runs, units, words)
    white = [tuple(whiteness_of(one, period)) for one in (base, model)]
    return Shown(part, words, runs, units, window, *white)
