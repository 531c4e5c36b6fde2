"""Figures: the figures of a report with their captions and texts for screen readers."""

from __future__ import annotations

import html
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from matplotlib.axes import Axes
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
from diagnosis.report.model_comparison import ComparedModel, ModelComparison
from diagnosis.report.number_text import format_percent, format_significant
from diagnosis.validation.oscillation import Oscillation
from engine.results.mode_band import PALETTE
from engine.results.plot import Picture
from language.overlays.name_types import format_si_unit
from language.text.sanitise import escape_invisible

BLUE, RED, GREEN, _, _, PURPLE, GREY = PALETTE
INPUT_COLOURS = (GREEN, PURPLE, GREY)
MODEL_STYLES = {
    "recalibrated": (RED, "-", "simulated, recalibrated"),
    "without": (RED, "--", "simulated without the effect"),
    "with": (BLUE, "-", "simulated with it"),
}
"""Colour, style and legend of the simulation by a model of a comparison."""
OSCILLATION_STYLES = (
    ("--", RED, "simulated, recalibrated"),
    ("-", BLUE, "simulated, with what was found"),
)


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
    moving = _moving_inputs(series.inputs, inputs)
    heights = [1.7, 1.0] if moving else [1.7]
    figure, axes = _stack_axes(heights, 4.2 if moving else 2.8)
    above, beneath = axes[0], axes[-1]
    above.fill_between(times, values - reach, values + reach, color=GREY, alpha=0.3, lw=0)
    above.plot(times, values, color=RED, lw=1.2)
    above.axhline(0.0, color="black", lw=0.6)
    for start, end, name in location.windows:
        if name == series.name:
            above.axvspan(start, end, color=RED, alpha=0.12, lw=0)
    _set_ylabel(above, f"{title} [{unit}]")
    _set_title(above, series.name)
    if moving:
        _draw_inputs(beneath, times, series.inputs[first:], moving)
        _set_ylabel(beneath, f"inputs [{inputs[next(iter(moving.values()))]}]", 8)
        beneath.legend(loc="best", fontsize=8)
    for axis in axes:
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
    names = [
        name for name, values in zip(inputs, series.inputs.T, strict=True) if np.std(values) > 0.0
    ]
    figure, axes = _stack_axes([1.0] * (1 + len(signals)), 0.8 + 1.7 * (1 + len(signals)))
    for name in names:
        values = series.inputs[:, list(inputs).index(name)]
        axes[0].plot(time, values, color="black", lw=1.2, label=escape_invisible(name))
    _set_ylabel(axes[0], f"inputs [{inputs[names[0]] if names else ''}]")
    for row, (name, unit) in enumerate(signals):
        for place, (title, shown) in enumerate(zip(plan.names, best.outputs, strict=True)):
            style, label = ("-", "--", ":")[place % 3], escape_invisible(title)
            colour = PALETTE[place]
            axes[row + 1].plot(time, shown[:, row], style, color=colour, lw=1.3, label=label)
        _set_ylabel(axes[row + 1], f"{name} [{unit}]")
    for axis in axes:
        axis.grid(alpha=0.3)
    axes[0].legend(loc="best", fontsize=8)
    axes[1].legend(loc="best", fontsize=8)
    _set_title(axes[0], best.manoeuvre.name, 11)
    axes[-1].set_xlabel("time [s]")
    return Picture(figure)


def draw_oscillation(oscillations: Sequence[Oscillation], unit: str) -> Picture:
    """Draw frequency over amplitude [unit] of the cycles, recorded and by one or two models."""
    figure = Figure(figsize=(7.0, 3.2), layout="constrained")
    axis = figure.subplots()
    first = oscillations[0].recorded
    axis.semilogx(first.amplitudes, first.frequencies, "o", color="black", ms=4, label="recorded")
    for one, (style, colour, label) in zip(oscillations, OSCILLATION_STYLES, strict=False):
        own = one.simulated
        axis.semilogx(own.amplitudes, own.frequencies, style, color=colour, lw=1.4, label=label)
    text = escape_invisible(f"amplitude of a cycle of {oscillations[0].signal} [{unit}]")
    axis.set_xlabel(text, parse_math=False)
    axis.set_ylabel("frequency [Hz]")
    axis.grid(alpha=0.3, which="both")
    axis.legend(loc="best", fontsize=8)
    return Picture(figure)


def draw_whiteness(models: Sequence[ComparedModel]) -> Picture:
    """Draw the autocorrelations of innovations by lag [ms] with the 99 % band, for each signal."""
    tests = list(zip(*(model.whiteness for model in models), strict=True))
    figure = Figure(figsize=(8.5, 2.7), layout="constrained")
    axes = figure.subplots(1, len(tests), squeeze=False, sharey=True)[0]
    for axis, by_model in zip(axes, tests, strict=True):
        first = by_model[0]
        axis.axhspan(
            -first.band, first.band, color="#999999", alpha=0.35, lw=0, label="white noise"
        )
        axis.axhline(0.0, color="black", lw=0.6)
        for one, model, (style, size, width) in zip(
            by_model, models, (("s--", 3.5, 1.0), ("o-", 3.0, 1.2)), strict=False
        ):
            colour = MODEL_STYLES[model.label][0]
            axis.plot(
                1000.0 * first.lags, one.correlations, style,
                color=colour, ms=size, lw=width, label=model.label,
            )  # fmt: skip
        _set_title(axis, first.signal)
        axis.set_xlabel("lag [ms]", fontsize=9)
        axis.grid(alpha=0.3)
        axis.tick_params(labelsize=8)
    axes[0].set_ylabel("correlation", fontsize=9)
    axes[0].legend(loc="upper right", fontsize=8)
    return Picture(figure)


def draw_window(comparison: ModelComparison, inputs: Mapping[str, str]) -> Picture:
    """Draw the varying inputs of one unit, and values and errors of each signal in a worst window.

    `inputs` are names with units; the time under the observer is grey.
    """
    window, count = comparison.window, len(comparison.signals)
    driven = _moving_inputs(window.inputs, inputs)
    heights = [1.0] * bool(driven) + [1.7, 1.0] * count
    figure, axes = _stack_axes(heights, 0.9 + 0.82 * sum(heights))
    if driven:
        first = next(iter(driven.values()))
        _draw_inputs(axes[0], window.times, window.inputs, driven)
        _set_ylabel(axes[0], f"{first if len(driven) == 1 else 'inputs'} [{inputs[first]}]", 8)
        if len(driven) > 1:
            axes[0].legend(loc="best", fontsize=8)
    for k, (name, unit) in enumerate(zip(comparison.signals, comparison.units, strict=True)):
        above, beneath = axes[bool(driven) + 2 * k :][:2]
        known = np.isfinite(window.measured[:, k])
        times, measured = window.times[known], window.measured[known, k]
        above.plot(times, measured, color="black", alpha=0.3, lw=5.0, label="recorded")
        for model, run in zip(comparison.models, window.runs, strict=True):
            colour, style, label = MODEL_STYLES[model.label]
            above.plot(window.times, run[:, k], style, color=colour, lw=1.4, label=label)
            beneath.plot(times, measured - run[known, k], style, color=colour, lw=1.1)
        beneath.axhline(0.0, color="black", lw=0.6)
        _set_ylabel(above, f"{name} [{unit}]")
        _set_ylabel(beneath, f"missed [{unit}]", 8)
    for axis in axes:
        axis.grid(alpha=0.3)
        axis.axvspan(window.times[0], window.free_from, color="#999999", alpha=0.15, lw=0)
        axis.tick_params(labelsize=8)
    axes[bool(driven)].legend(loc="best", fontsize=8)
    _set_title(axes[0], window.title[0].upper() + window.title[1:])
    axes[-1].set_xlabel("time [s]; grey: an observer follows, then the model is alone", fontsize=9)
    return Picture(figure)


def _stack_axes(heights: Sequence[float], height: float) -> tuple[Figure, list[Axes]]:
    """Return a figure of a height [inch] with axes of relative heights above each other."""
    figure = Figure(figsize=(8.5, height), layout="constrained")
    rows = figure.subplots(len(heights), 1, sharex=True, squeeze=False, height_ratios=heights)
    return figure, list(rows[:, 0])


def _set_ylabel(axis: Axes, text: str, fontsize: int = 9) -> None:
    """Write a text beside an axis, as it is."""
    axis.set_ylabel(escape_invisible(text), fontsize=fontsize, parse_math=False)


def _set_title(axis: Axes, text: str, fontsize: int = 10) -> None:
    """Write a text above an axis, as it is."""
    axis.set_title(escape_invisible(text), loc="left", fontsize=fontsize, parse_math=False)


def _moving_inputs(values: Reals, inputs: Mapping[str, str]) -> dict[int, str]:
    """Return column and name of up to three varying inputs (samples, inputs) with one unit."""
    moving = [(k, name) for k, name in enumerate(inputs) if float(np.ptp(values[:, k])) > 0.0]
    same = [(k, name) for k, name in moving if inputs[name] == inputs[moving[0][1]]]
    return dict(same[: len(INPUT_COLOURS)])


def _draw_inputs(axis: Axes, times: Reals, values: Reals, columns: Mapping[int, str]) -> None:
    """Draw some named columns of inputs (samples, inputs) over time."""
    for (k, name), colour in zip(columns.items(), INPUT_COLOURS, strict=False):
        axis.plot(times, values[:, k], color=colour, lw=1.1, label=escape_invisible(name))


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
    plan, first = report.diagnosis.plan, comparisons[0]
    inputs = {name: format_si_unit(i.unit.dimension) for name, i in report.automaton.inputs.items()}
    units = list(zip(first.signals, first.units, strict=True))
    found = []
    for one in comparisons:
        caption = _window_caption(one)
        found.append(
            ReportFigure(f"window_{one.dataset}", caption, caption, draw_window(one, inputs))
        )
    caption = _whiteness_caption(first)
    found.append(ReportFigure("whiteness", caption, caption, draw_whiteness(first.models)))
    if any(location.gain > 0.0 for location in report.verdict.location):
        found.append(_location_figure(report.verdict.location))
        found += _disturbance_figure(report, inputs)
    if text := sentences.format_oscillation(report):
        oscillations = report.diagnosis.oscillations
        caption = f"How the frequency goes with the amplitude: {text}."
        picture = draw_oscillation(oscillations, dict(units)[oscillations[0].signal])
        found.append(ReportFigure("shuffle", caption, caption, picture))
    if plan is not None and plan.is_discriminating:
        caption = f"{plan.format_sentence()}; what each would show of it"
        picture = draw_experiment(plan, inputs, units)
        found.append(ReportFigure("plan", f"{caption[0].upper()}{caption[1:]}.", caption, picture))
    return found


def _window_caption(comparison: ModelComparison) -> str:
    """Return the title of a window and the largest error of each signal in free simulation."""
    window = comparison.window
    alone = window.times >= window.free_from
    texts = []
    for k, (name, unit) in enumerate(zip(comparison.signals, comparison.units, strict=True)):
        sizes = []
        for run in window.runs:
            missed = np.abs(window.measured[alone, k] - run[alone, k])
            size = float(np.nanmax(missed)) if np.isfinite(missed).any() else np.nan
            sizes.append(f"{format_significant(size, 2)} {unit}")
        texts.append(f"{name} by up to {_join_by_model(sizes)}")
    words = window.title[0].upper() + window.title[1:]
    return f"{words}. Left alone the model misses {'; '.join(texts)}."


def _whiteness_caption(comparison: ModelComparison) -> str:
    """Return what the figure of the innovations' autocorrelation shows, with predictable parts."""
    parts = []
    for tests in zip(*(model.whiteness for model in comparison.models), strict=True):
        sizes = [format_percent(one.predictable_fraction) for one in tests]
        parts.append(f"{tests[0].signal} {_join_by_model(sizes)}")
    return (
        f"Autocorrelation of the errors of one-step prediction ({comparison.label} recordings). "
        f"Part that is predictable from their past: {'; '.join(parts)}; none for white noise."
    )


def _join_by_model(texts: Sequence[str]) -> str:
    """Return the text of the base alone, or those without and with the effects."""
    return texts[0] if len(texts) == 1 else f"{texts[0]} without, {texts[1]} with"


def _location_figure(locations: Sequence[Location]) -> ReportFigure:
    """Return the figure of the gains of all locations."""
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
