"""Report: a diagnosis as files - verdict, variant, figures, and one page that holds it all."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib import resources
from typing import Any

import jinja2

from codegen.rendering import version
from diagnosis import wording
from diagnosis.dossier import Dossier, verdict_json
from diagnosis.estimation import adapted
from diagnosis.finding import told
from diagnosis.fit import note_of
from diagnosis.locus_picture import locus_picture
from diagnosis.naming import quantities_of
from diagnosis.search import Tried
from diagnosis.selection import Selection
from diagnosis.worst_window import (
    FreeRuns,
    WorstWindow,
    by_recording,
    free_runs,
    window_picture,
    worst_window,
)
from engine.plot import Picture
from language.known import unit_text
from language.map import column_dimension

LINES_OF_SVG = re.compile(r"^.*?(?=<svg)", re.DOTALL)


PLACES = "Where an unknown torque, force or error would explain most, before effects were tried"


@dataclass(frozen=True)
class Figure:
    """A figure of the report: the name of its files, what it shows, and the picture."""

    name: str
    caption: str
    picture: Picture


def report_files(dossier: Dossier, variant: str) -> dict[str, bytes]:
    """Return the files of a diagnosis by name."""
    sets = shown_sets(dossier)
    figures = figures_of(dossier, sets)
    verdict = json.dumps(verdict_json(dossier.verdict), indent=2, allow_nan=False) + "\n"
    files = {"verdict.json": verdict.encode(), "variant.yaml": variant.encode()}
    drawings = {}
    for figure in figures:
        drawing = figure.picture.data("svg")
        files[f"{figure.name}.svg"] = drawing
        files[f"{figure.name}.png"] = figure.picture.data("png")
        drawings[figure.name] = LINES_OF_SVG.sub("", drawing.decode())
    each = _each(dossier, sets)
    context = {
        **context_of(dossier),
        "each": each,
        "variant": variant,
        "figures": figures,
        "svg": drawings,
    }
    files["report.html"] = _page(context).encode()
    return files


@dataclass(frozen=True)
class Shown:
    """Free simulations of one set of recordings: `name` of its files, `words` for a reader."""

    name: str
    words: str
    runs: FreeRuns


def shown_sets(dossier: Dossier) -> list[Shown]:
    """Return the free simulations of what was held out, then of what was trained on."""
    found = dossier.diagnosis
    if found is None:
        return []
    base, model = found.selection.base, found.selection.model
    sets = [Shown("train", "training", free_runs(base, model, found.bench.series))]
    if found.held_out:
        held = found.held_out
        runs = free_runs(adapted(base, held), adapted(model, held), held)
        sets.insert(0, Shown("held_out", "held-out", runs))
    return sets


def figures_of(dossier: Dossier, sets: Sequence[Shown]) -> list[Figure]:
    """Return the figures: the worst window of each set of recordings, and the places."""
    found = dossier.diagnosis
    if found is None:
        return []
    units = _units(dossier, sets[0].runs.signals)
    figures = []
    for one in sets:
        window = worst_window(one.runs, units)
        caption = _caption(window, one.words)
        picture = window_picture(window, caption, not found.selection.accepted)
        figures.append(Figure(f"window_{one.name}", caption, picture))
    caption = (
        "Where an unknown torque, force or error would explain most, before effects were tried"
    )
    return [*figures, Figure("places", caption, locus_picture(dossier.verdict.location))]


def _units(dossier: Dossier, signals: Sequence[str]) -> list[str]:
    columns = {one.compare: one for one in dossier.case.mapping.columns.values()}
    return [unit_text(column_dimension(columns[name])) for name in signals]


def _each(dossier: Dossier, sets: Sequence[Shown]) -> list[tuple[str, ...]]:
    """Return a row for each recording and signal: what is missed [SI] before and after."""
    rows: list[tuple[str, ...]] = []
    for one in sets:
        units = _units(dossier, one.runs.signals)
        for name, before, after in by_recording(one.runs):
            for k, signal in enumerate(one.runs.signals):
                change = after[k] / before[k] - 1.0 if before[k] else 0.0
                numbers = (f"{before[k]:.3g} {units[k]}", f"{after[k]:.3g} {units[k]}")
                rows.append((name, one.words, signal, *numbers, f"{100 * change:+.0f} %"))
    return rows


def _caption(window: WorstWindow, words: str) -> str:
    start, end = window.times[0], window.times[-1]
    return f"Worst window of the {words} recordings: {window.recording}, {start:.3g} to {end:.3g} s"


def context_of(dossier: Dossier) -> dict[str, Any]:
    """Return what the page is filled with, as texts."""
    verdict = dossier.verdict
    found = dossier.diagnosis
    return {
        "name": dossier.name,
        "verdict": verdict,
        "headline": _code(wording.headline(dossier)),
        "summary": wording.summary(dossier)[1:],
        "abouts": _abouts(dossier),
        "fit": _fit(dossier),
        "candidates": _candidates(dossier, found.selection) if found else [],
        "parameters": _parameters(dossier, found.selection) if found else [],
        "fixed": _fixed(dossier),
        "separation": wording.separation(dossier),
        "rivals": [wording.effect_at(one) for one in verdict.ambiguous_with],
        "findings": told(dossier.findings),
        "left_out": dossier.left_out,
        "untestable": _untestable(dossier),
        "inputs": verdict.inputs,
        "held_out": dossier.held_out,
        "has_model": bool(found and found.selection.accepted),
        "threshold": dossier.case.threshold,
        "version": version(),
    }


def _code(text: str) -> list[tuple[str, bool]]:
    """Return a sentence in parts, with whether each stood between back quotes."""
    return [(part, place % 2 == 1) for place, part in enumerate(text.split("`"))]


def _abouts(dossier: Dossier) -> list[str]:
    found = dossier.diagnosis
    accepted = found.selection.accepted if found else ()
    return [
        f"{one.layer.effect.name.replace('_', ' ')}: {one.layer.effect.about}. "
        f"Its signature: {one.layer.effect.signature or 'none is told'}."
        for one in accepted
    ]


def _fit(dossier: Dossier) -> list[tuple[str, str, str, str, str]]:
    rows = []
    for part, signals in dossier.verdict.fit.items():
        for name, one in signals.items():
            change = one.nrmse_after / one.nrmse_before - 1.0 if one.nrmse_before else 0.0
            before, after = f"{100 * one.nrmse_before:.3g} %", f"{100 * one.nrmse_after:.3g} %"
            rows.append((part.replace("_", " "), name, before, after, f"{100 * change:+.0f} %"))
    return rows


@dataclass(frozen=True)
class Row:
    """A candidate in the table: `bar` is its gain as a part of the largest, in per cent."""

    name: str
    train: str
    left_out: str
    probability: str
    bar: float
    reason: str
    is_fitted: bool
    is_accepted: bool


def _candidates(dossier: Dossier, selection: Selection) -> list[Row]:
    ids = {one.layer.id for one in selection.accepted}
    first = [one for one in selection.first_round if one.layer.id not in ids]
    listed = [*selection.accepted, *first]
    gains = [one.evidence.train for one in listed if one.evidence]
    most = max([*gains, 1.0])
    shares = selection.probabilities()
    return [_row(dossier, selection, one, k, most, shares) for k, one in enumerate(listed)]


def _row(
    dossier: Dossier,
    selection: Selection,
    tried: Tried,
    place: int,
    most: float,
    shares: Mapping[str, float],
) -> Row:
    known = tried.evidence
    share = shares.get(tried.layer.id)
    return Row(
        wording.title(tried.layer, dossier),
        f"{known.train:.0f}" if known else "",
        f"{known.left_out:.0f}" if known else "",
        "" if share is None else "< 0.1 %" if share < 0.001 else f"{100 * share:.1f} %",
        100.0 * max(known.train, 0.0) / most if known else 0.0,
        wording.reason(tried, place, selection, dossier.case.threshold),
        known is not None,
        tried.layer.id in {one.layer.id for one in selection.accepted},
    )


def _parameters(dossier: Dossier, selection: Selection) -> list[tuple[str, ...]]:
    """Return a row of texts for each parameter: declared, recalibrated, with the effects, note."""
    before, after = quantities_of(selection.base), quantities_of(selection.model)
    coordinates = {one.name: one for one in selection.model.candidate.uncertain}
    rows: list[tuple[str, ...]] = []
    for name, now in after.items():
        declared = dossier.automaton.parameters.get(name)
        value = "" if declared is None or declared.value is None else f"{float(declared.value):.4g}"
        old = wording.quantity(before[name]) if name in before else ""
        note = note_of(now, coordinates[name])
        rows.append((name, value, old, wording.quantity(now), note))
    return rows


def _fixed(dossier: Dossier) -> list[str]:
    """Return the parameters that have no range: they were taken as exact."""
    return [
        name
        for name, one in dossier.automaton.parameters.items()
        if one.range is None and one.value is not None and one.type == "real"
    ]


def _untestable(dossier: Dossier) -> list[tuple[str, str]]:
    lacking: dict[str, list[str]] = {}
    for one in dossier.check.excitation.effects:
        if one.lacking:
            lacking.setdefault(" and ".join(one.lacking), []).append(one.effect)
    return [(", ".join(names), needs) for needs, names in lacking.items()]


def _page(context: Mapping[str, Any]) -> str:
    folder = resources.files("diagnosis").joinpath("templates")
    environment = jinja2.Environment(
        loader=jinja2.FunctionLoader(lambda name: folder.joinpath(name).read_text("utf-8")),
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        autoescape=True,
    )
    return environment.get_template("report.html.jinja").render(context)
