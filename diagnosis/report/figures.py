"""Figures: the figures of a report with their captions and texts for screen readers."""

from __future__ import annotations

import html
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from matplotlib.figure import Figure

from diagnosis.data.array_types import Reals
from diagnosis.data.sampled_recording import SampledRecording
from diagnosis.estimation.place_magnitude import disturbance_unit
from diagnosis.experiment.discrimination import ExperimentPlan
from diagnosis.localisation.cause import balance_of
from diagnosis.localisation.location import SIGNIFICANT_STDS, DisturbanceEstimate, Location
from diagnosis.localisation.location_text import PLACE_PHRASES
from diagnosis.report import report_text as sentences
from diagnosis.report.diagnosis_report import DiagnosisReport
from diagnosis.report.model_comparison import ModelComparison
from diagnosis.report.number_text import format_percent, format_significant
from diagnosis.report.window_figure import (
    draw_inputs,
    draw_window,
    moving_inputs,
    set_title,
    set_ylabel,
)
from diagnosis.validation.oscillation import Oscillation
from diagnosis.validation.whiteness import WhitenessTest
from diagnosis.validation.worst_window import WorstWindow
from engine.results.mode_band import PALETTE
from engine.results.plot import Picture
from language.overlays.name_types import format_si_unit
from language.text.sanitise import escape_invisible

BLUE, RED, _, _, _, _, GREY = PALETTE


def draw_locations(locations: Sequence[Location]) -> Picture:
    """Draw a bar with its gain [nats], at least 0, for each location, the largest one in blue."""
    known = [location for location in locations if not math.isnan(location.gain)]
    shown = sorted(known, key=lambda location: location.gain)
    figure = Figure(figsize=(7.0, 0.9 + 0.38 * max(1, len(shown))), layout="constrained")
    axis = figure.subplots()
    most = max([location.gain for location in shown if math.isfinite(location.gain)] + [1.0])
    gains = [min(max(location.gain, 0.0), 1.5 * most) for location in shown]
    labels = [f"{max(location.gain, 0.0):.0f}" for location in shown]
    colours = [GREY] * (len(shown) - 1) + [BLUE]
    bars = axis.barh(
        [escape_invisible(location.path) for location in shown], gains, color=colours, height=0.65
    )
    axis.bar_label(bars, labels=labels, padding=3, fontsize=8)
    axis.set_xlim(0.0, 1.12 * max([*gains, 1.0]))
    axis.set_xlabel("what an unknown torque, force or error there would explain [nats]")
    axis.tick_params(axis="y", labelsize=9)
    for side in ("top", "right"):
        axis.spines[side].set_visible(False)
    return Picture(figure)


def draw_disturbance(
    location: Location,
    series: SampledRecording,
    disturbance: DisturbanceEstimate,
    title: str,
    unit: str,
    inputs: Mapping[str, str],
) -> Picture:
    """Draw a disturbance with its band and windows, above up to three varying inputs of one unit.

    `inputs` are all inputs with their units; `title` and `unit` label the disturbance.
    """
    values, reach = disturbance.values, SIGNIFICANT_STDS * disturbance.stds
    first = series.count - len(values)
    times: Reals = np.arange(first, series.count, dtype=np.float64) * float(series.period)
    times += float(series.start)
    moving = moving_inputs(series.inputs, inputs)
    names = list(inputs)
    figure = Figure(figsize=(8.5, 4.2 if moving else 2.8), layout="constrained")
    heights = [1.7, 1.0] if moving else [1.7]
    rows = figure.subplots(len(heights), 1, sharex=True, squeeze=False, height_ratios=heights)
    above, beneath = rows[0][0], rows[-1][0]
    above.fill_between(times, values - reach, values + reach, color=GREY, alpha=0.3, lw=0)
    above.plot(times, values, color=RED, lw=1.2)
    above.axhline(0.0, color="black", lw=0.6)
    for start, end, name in location.windows:
        if name == series.name:
            above.axvspan(start, end, color=RED, alpha=0.12, lw=0)
    set_ylabel(above, f"{title} [{unit}]")
    set_title(above, series.name)
    if moving:
        draw_inputs(beneath, times, series.inputs[first:], names, moving)
        set_ylabel(beneath, f"inputs [{inputs[names[moving[0]]]}]", 8)
        beneath.legend(loc="best", fontsize=8)
    for axis in (above, beneath):
        axis.grid(alpha=0.3)
        axis.tick_params(labelsize=8)
    beneath.set_xlabel("time [s]; red: where something is missing for sure", fontsize=9)
    return Picture(figure)


def draw_experiment(
    plan: ExperimentPlan, inputs: Mapping[str, str], signals: Sequence[tuple[str, str]]
) -> Picture:
    """Draw the first manoeuvre of a plan, and each output as each candidate simulates it.

    `inputs` and `signals` give names with units, in the order of the columns.
    """
    best = plan.options[0]
    series = best.manoeuvre.series
    time = np.arange(series.count) * float(series.period)
    moved = [k for k in range(len(inputs)) if float(np.std(series.inputs[:, k])) > 0.0]
    count = 1 + len(signals)
    figure = Figure(figsize=(8.5, 0.8 + 1.7 * count), layout="constrained")
    axes = figure.subplots(count, 1, sharex=True, squeeze=False)[:, 0]
    names = list(inputs)
    for k in moved:
        label = escape_invisible(names[k])
        axes[0].plot(time, series.inputs[:, k], color="black", lw=1.2, label=label)
    set_ylabel(axes[0], f"inputs [{inputs[names[moved[0]]] if moved else ''}]")
    for row, (name, unit) in enumerate(signals):
        for place, (title, shown) in enumerate(zip(plan.names, best.outputs, strict=True)):
            style, label = ("-", "--", ":")[place % 3], escape_invisible(title)
            colour = PALETTE[place]
            axes[row + 1].plot(time, shown[:, row], style, color=colour, lw=1.3, label=label)
        set_ylabel(axes[row + 1], f"{name} [{unit}]")
    for axis in axes:
        axis.grid(alpha=0.3)
    axes[0].legend(loc="best", fontsize=8)
    axes[1].legend(loc="best", fontsize=8)
    set_title(axes[0], best.manoeuvre.name, 11)
    axes[-1].set_xlabel("time [s]")
    return Picture(figure)


OSCILLATION_STYLES = (
    ("--", RED, "simulated, recalibrated"),
    ("-", BLUE, "simulated, with what was found"),
)


def draw_oscillation(oscillations: Sequence[Oscillation], unit: str) -> Picture:
    """Draw frequency over amplitude [unit] of the cycles, recorded and by one or two models."""
    figure = Figure(figsize=(7.0, 3.2), layout="constrained")
    axis = figure.subplots()
    first = oscillations[0]
    own = first.recorded
    axis.semilogx(own.amplitudes, own.frequencies, "o", color="black", ms=4, label="recorded")
    for one, (style, colour, label) in zip(oscillations, OSCILLATION_STYLES, strict=False):
        own = one.simulated
        axis.semilogx(own.amplitudes, own.frequencies, style, color=colour, lw=1.4, label=label)
    text = escape_invisible(f"amplitude of a cycle of {first.signal} [{unit}]")
    axis.set_xlabel(text, parse_math=False)
    axis.set_ylabel("frequency [Hz]")
    axis.grid(alpha=0.3, which="both")
    axis.legend(loc="best", fontsize=8)
    return Picture(figure)


def draw_whiteness(
    before: Sequence[WhitenessTest], after: Sequence[WhitenessTest], is_base_only: bool
) -> Picture:
    """Draw the autocorrelations of innovations by lag [ms] with the 99 % band, for each signal."""
    figure = Figure(figsize=(8.5, 2.7), layout="constrained")
    axes = figure.subplots(1, len(before), squeeze=False, sharey=True)[0]
    for axis, old, new in zip(axes, before, after, strict=True):
        lags = 1000.0 * old.lags
        axis.axhspan(-old.band, old.band, color="#999999", alpha=0.35, lw=0, label="white noise")
        axis.axhline(0.0, color="black", lw=0.6)
        first = "recalibrated" if is_base_only else "without"
        axis.plot(lags, old.correlations, "s--", color=RED, ms=3.5, lw=1.0, label=first)
        if not is_base_only:
            axis.plot(lags, new.correlations, "o-", color=BLUE, ms=3.0, lw=1.2, label="with")
        set_title(axis, old.signal)
        axis.set_xlabel("lag [ms]", fontsize=9)
        axis.grid(alpha=0.3)
        axis.tick_params(labelsize=8)
    axes[0].set_ylabel("correlation", fontsize=9)
    axes[0].legend(loc="upper right", fontsize=8)
    return Picture(figure)


SVG_HEAD = re.compile(r"^.*?<svg ", re.DOTALL)
METADATA = re.compile(r"<metadata>.*?</metadata>", re.DOTALL)
SVG_IDENTIFIER = re.compile(r'(\bid="|href="#|url\(#)')
"""Places where an SVG has an identifier, which must differ between figures of a page."""


@dataclass(frozen=True)
class ReportFigure:
    """A figure: the name of its files, its caption, and its text for screen readers."""

    name: str
    caption: str
    alternative_text: str
    picture: Picture = field(repr=False)


def report_figures(
    report: DiagnosisReport, comparisons: Sequence[ModelComparison]
) -> list[ReportFigure]:
    """Return the figures of a report that have content: windows, whiteness, places, and others.

    The report must have a diagnosis; whiteness is that of the first comparison.
    """
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
    """Return the title of a window and the largest error of each signal in free simulation."""
    alone = window.times >= window.free_from
    texts = []
    for k, (name, unit) in enumerate(zip(window.signals, window.units, strict=True)):
        sizes = []
        for run in (window.before, window.after):
            missed = np.abs(window.measured[alone, k] - run[alone, k])
            size = float(np.nanmax(missed)) if np.isfinite(missed).any() else np.nan
            sizes.append(f"{format_significant(size, 2)} {unit}")
        amount = sizes[0] if is_base_only else f"{sizes[0]} without, {sizes[1]} with"
        texts.append(f"{name} by up to {amount}")
    words = window.title[0].upper() + window.title[1:]
    return f"{words}. Left alone the model misses {'; '.join(texts)}."


def _whiteness_figure(comparison: ModelComparison, is_base_only: bool) -> ReportFigure:
    """Return the figure of the innovations' autocorrelation on one set of recordings."""
    parts = []
    for before, after in zip(comparison.before, comparison.after, strict=True):
        sizes = [format_percent(one.predictable_fraction) for one in (before, after)]
        amount = sizes[0] if is_base_only else f"{sizes[0]} without, {sizes[1]} with"
        parts.append(f"{before.signal} {amount}")
    caption = (
        f"Autocorrelation of the errors of one-step prediction ({comparison.label} recordings). "
        f"Part that is predictable from their past: {'; '.join(parts)}; none for white noise."
    )
    picture = draw_whiteness(comparison.before, comparison.after, is_base_only)
    return ReportFigure("whiteness", caption, caption, picture)


def _oscillation_figure(report: DiagnosisReport, comparison: ModelComparison) -> list[ReportFigure]:
    """Return the figure of frequency over amplitude as a list; empty if the model follows."""
    text = sentences.format_oscillation(report)
    if not text or report.diagnosis is None:
        return []
    found = report.diagnosis.oscillations
    units = dict(zip(comparison.window.signals, comparison.window.units, strict=True))
    caption = f"How the frequency goes with the amplitude: {text}."
    picture = draw_oscillation(found, units[found[0].signal])
    return [ReportFigure("shuffle", caption, caption, picture)]


def _location_figure(report: DiagnosisReport) -> ReportFigure:
    """Return the figure of the gains of all locations."""
    locations = report.verdict.location
    caption = (
        "Where an unknown torque, force or error would explain most, before effects are applied"
    )
    ranked = ", ".join(f"{one.path} {max(one.gain, 0.0):.0f}" for one in locations)
    alternative = f"{caption}, in nats: {ranked}."
    return ReportFigure("places", f"{caption}.", alternative, draw_locations(locations))


def _disturbance_figure(report: DiagnosisReport, inputs: Mapping[str, str]) -> list[ReportFigure]:
    """Return the figure of the first location's longest window in a list; empty without one."""
    best, found = report.verdict.location[0], report.diagnosis
    if found is None or report.verdict.verdict == "nothing_missing" or not best.windows:
        return []
    model_set = found.model_set
    names = [one.name for one in model_set.series]
    place = names.index(best.windows[0][2])
    section, _, name = balance_of(model_set, best.section, best.place).partition(".")
    unit = disturbance_unit(model_set, section, name)
    what = f"missing {PLACE_PHRASES[section]} {name}"
    is_beside = best.free_model is not None and bool(best.free_model.candidate.placed_effects)
    when = "beside the effects that were found" if is_beside else "before effects are applied"
    caption = (
        f"What is {what} over time, {when}: the unknown that would explain what is recorded in "
        f"{names[place]}, give or take three standard deviations."
    )
    series, unknown = model_set.series[place], best.disturbances[place]
    picture = draw_disturbance(best, series, unknown, what, unit, inputs)
    return [ReportFigure("missing", caption, caption, picture)]


def embed_svg(figure: ReportFigure, data: bytes) -> str:
    """Return an SVG as an element of a page; the figure's name makes its identifiers unique."""
    label = html.escape(figure.alternative_text, quote=True)
    text = SVG_IDENTIFIER.sub(rf"\g<1>{figure.name}-", METADATA.sub("", data.decode()))
    return SVG_HEAD.sub(f'<svg role="img" aria-label="{label}" ', text, count=1)
