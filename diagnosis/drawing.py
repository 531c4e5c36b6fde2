"""Drawing: the figures of a report, with what they say in words."""

from __future__ import annotations

import html
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from diagnosis import wording
from diagnosis.actor import balance_of
from diagnosis.digits import format_percent, format_significant
from diagnosis.dossier import DiagnosisReport
from diagnosis.locus_picture import draw_locations
from diagnosis.missing_picture import draw_disturbance
from diagnosis.place_sentence import PLACE_PHRASES
from diagnosis.plan_picture import draw_experiment
from diagnosis.scale import disturbance_unit
from diagnosis.shown import ModelComparison
from diagnosis.shuffle_picture import draw_oscillation
from diagnosis.whiteness_picture import draw_whiteness
from diagnosis.window_picture import draw_window
from diagnosis.worst_window import WorstWindow
from engine.results.plot import Picture
from language.overlays.tree_types import format_si_unit

SVG_HEAD = re.compile(r"^.*?<svg ", re.DOTALL)
METADATA = re.compile(r"<metadata>.*?</metadata>", re.DOTALL)
SVG_IDENTIFIER = re.compile(r'(\bid="|href="#|url\(#)')
"""Where an SVG names its parts: names of several figures in one page must differ."""


@dataclass(frozen=True)
class ReportFigure:
    """A figure: the name of its files, its caption, and what it shows to those who see it not."""

    name: str
    caption: str
    alternative_text: str
    picture: Picture = field(repr=False)


def report_figures(
    report: DiagnosisReport, comparisons: Sequence[ModelComparison]
) -> list[ReportFigure]:
    """Return the worst window of each set of recordings, what is left, and the places."""
    assert report.diagnosis
    is_same = not report.diagnosis.selection.accepted
    inputs = {name: format_si_unit(i.unit.dimension) for name, i in report.automaton.inputs.items()}
    found = []
    for one in comparisons:
        caption = window_caption(one.window, is_same)
        picture = draw_window(one.window, inputs, is_same)
        found.append(ReportFigure(f"window_{one.dataset}", caption, caption, picture))
    found.append(_whiteness_figure(comparisons[0], is_same))
    if any(location.gain > 0.0 for location in report.verdict.location):
        found.append(_location_figure(report))
        found += _disturbance_figure(report, inputs)
    found += _oscillation_figure(report, comparisons[0])
    if report.diagnosis.plan is not None and report.diagnosis.plan.is_discriminating:
        signals = list(zip(comparisons[0].window.signals, comparisons[0].window.units, strict=True))
        caption = f"{report.diagnosis.plan.format_sentence()}; what each would show of it"
        picture = draw_experiment(report.diagnosis.plan, inputs, signals)
        found.append(ReportFigure("plan", f"{caption[0].upper()}{caption[1:]}.", caption, picture))
    return found


def window_caption(window: WorstWindow, is_base_only: bool) -> str:
    """Return how much is missed at most in a window where the models are alone."""
    alone = window.times >= window.free_from
    texts = []
    for k, (name, unit) in enumerate(zip(window.signals, window.units, strict=True)):
        sizes = []
        for run in (window.before, window.after):
            missed = np.abs(window.measured[alone, k] - run[alone, k])
            sizes.append(float(np.nanmax(missed)) if np.isfinite(missed).any() else np.nan)
        text = f"{name} by up to {format_significant(sizes[0], 2)} {unit}"
        texts.append(
            text
            if is_base_only
            else f"{text} without, {format_significant(sizes[1], 2)} {unit} with"
        )
    words = window.title[0].upper() + window.title[1:]
    return f"{words}. Left alone the model misses {'; '.join(texts)}."


def _whiteness_figure(comparison: ModelComparison, is_base_only: bool) -> ReportFigure:
    parts = []
    for before, after in zip(comparison.before, comparison.after, strict=True):
        text = f"{before.signal} {format_percent(before.predictable_fraction)}"
        parts.append(
            text
            if is_base_only
            else f"{text} without, {format_percent(after.predictable_fraction)} with"
        )
    caption = (
        f"What is missed from one sample to the next ({comparison.label} recordings): its correlation "
        f"with itself a time later. Its own past tells of it: {'; '.join(parts)}; of white noise "
        "nothing."
    )
    picture = draw_whiteness(comparison.before, comparison.after, is_base_only)
    return ReportFigure("whiteness", caption, caption, picture)


def _oscillation_figure(report: DiagnosisReport, comparison: ModelComparison) -> list[ReportFigure]:
    """Return how the frequency goes with the amplitude, where the model has another one."""
    text = wording.format_oscillation(report)
    if not text or report.diagnosis is None:
        return []
    found = report.diagnosis.oscillations
    units = dict(zip(comparison.window.signals, comparison.window.units, strict=True))
    caption = f"How the frequency goes with the amplitude: {text}."
    return [
        ReportFigure("shuffle", caption, caption, draw_oscillation(found, units[found[0].signal]))
    ]


def _location_figure(report: DiagnosisReport) -> ReportFigure:
    locations = report.verdict.location
    caption = "Where an unknown torque, force or error would explain most, before effects are laid"
    ranked = ", ".join(f"{one.path} {max(one.gain, 0.0):.0f}" for one in locations)
    alternative = f"{caption}, in nats: {ranked}."
    return ReportFigure("places", f"{caption}.", alternative, draw_locations(locations))


def _disturbance_figure(report: DiagnosisReport, inputs: Mapping[str, str]) -> list[ReportFigure]:
    """Return what the base lacks over time, in the recording in which that is loud for longest."""
    best = report.verdict.location[0]
    if report.diagnosis is None or report.verdict.verdict == "nothing_missing":
        return []
    if not best.windows:
        return []
    model_set = report.diagnosis.model_set
    names = [one.name for one in model_set.series]
    place = names.index(best.windows[0][2])
    section, _, name = balance_of(model_set, best.section, best.place).partition(".")
    unit = disturbance_unit(model_set, section, name)
    what = f"missing {PLACE_PHRASES[section]} {name}"
    is_beside = best.free_model is not None and bool(best.free_model.candidate.placed_effects)
    when = "beside the effects that were found" if is_beside else "before effects are laid"
    caption = (
        f"What is {what} over time, {when}: the unknown that would explain what is recorded in "
        f"{names[place]}, give or take three standard deviations."
    )
    series, unknown = model_set.series[place], best.disturbances[place]
    picture = draw_disturbance(best, series, unknown, what, unit, inputs)
    return [ReportFigure("missing", caption, caption, picture)]


def embed_svg(figure: ReportFigure, data: bytes) -> str:
    """Return an SVG as a part of a page: with its words, its names like no other's."""
    label = html.escape(figure.alternative_text, quote=True)
    text = SVG_IDENTIFIER.sub(rf"\g<1>{figure.name}-", METADATA.sub("", data.decode()))
    return SVG_HEAD.sub(f'<svg role="img" aria-label="{label}" ', text, count=1)
