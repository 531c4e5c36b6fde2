"""Recording figure: channels, operating range, spectrum and testable effects of recordings."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.gridspec import SubplotSpec

from diagnosis.data.array_types import Reals
from diagnosis.data_quality.channel import ChannelCheck, si_factor
from diagnosis.data_quality.excitation import Excitation, SignalExcitation, spectrum
from diagnosis.data_quality.finding import format_findings
from diagnosis.data_quality.recording_check import RecordingCheck
from engine.recordings.recording import Recording
from engine.results.mode_band import PALETTE
from engine.results.plot import Picture
from language.text.sanitise import escape_invisible, truncate

MAX_CHANNELS = 6
"""Maximum number of channels drawn, for one page."""
MAX_POINTS = 4000
"""Maximum number of points of a curve; a longer one is drawn as an envelope."""
MAX_WINDOW = 1024
"""Samples of a window of a spectrum."""
MAX_FINDINGS = 5
MAX_LINE_LENGTH = 200
BLUE, RED, GREEN, YELLOW, _, PURPLE, GREY = PALETTE
PALE, ORANGE = "#d8d8d8", "#cc7a00"
SIGNS = {"error": "\N{BLACK CIRCLE}", "warning": "\N{BLACK UP-POINTING TRIANGLE}", "note": "-"}
COLOURS = {"error": "#cc3344", "warning": "#b58900", "note": GREY}


def draw_recordings(recordings: Sequence[Recording], check: RecordingCheck, title: str) -> Picture:
    """Return the picture of checked recordings: channels, operating range, effects, findings."""
    names = list(dict.fromkeys(one.name for one in check.channels))[:MAX_CHANNELS]
    count = max(1, len(format_findings(check.findings)[:MAX_FINDINGS]))
    height = 1.6 + 1.25 * max(len(names), 5) + 0.24 * count
    figure = Figure(figsize=(13.5, height), layout="constrained")
    figure.suptitle(escape_invisible(title), x=0.01, ha="left", fontsize=13, fontweight="bold")
    grid = figure.add_gridspec(
        2, 2, width_ratios=(1.9, 1.0), height_ratios=(height, 0.24 * count + 0.1)
    )
    _draw_channels(figure, grid[0, 0], recordings, check, names)
    right = grid[0, 1].subgridspec(3, 1, height_ratios=(1.15, 0.9, 1.45))
    _draw_operating_range(figure.add_subplot(right[0]), recordings, check.excitation)
    _draw_spectrum(figure.add_subplot(right[1]), recordings, check)
    _draw_effects(figure.add_subplot(right[2]), check.excitation)
    _draw_findings(figure.add_subplot(grid[1, :]), check)
    return Picture(figure)


def _draw_channels(
    figure: Figure,
    place: SubplotSpec,
    recordings: Sequence[Recording],
    check: RecordingCheck,
    names: Sequence[str],
) -> None:
    """Draw each channel over time, recordings in a row, with windows and defects."""
    rows = place.subgridspec(len(names), 1)
    axes: list[Axes] = []
    for row, name in enumerate(names):
        axis = figure.add_subplot(rows[row], sharex=axes[0] if axes else None)
        axes.append(axis)
        shift = float(recordings[0].start) if len(recordings) == 1 else 0.0
        for recording in recordings:
            channel = recording.channels.get(name)
            move = shift - float(recording.start)
            shaded = [((float(a), float(b)), GREEN, 0.07) for a, b in recording.windows]
            if channel is not None:
                times, values = _envelope(channel.seconds + move, channel.array)
                colour = ORANGE if channel.column.to is not None else BLUE
                axis.plot(times, values / si_factor(channel), color=colour, lw=0.8)
                for one in check.channels:
                    if (one.recording, one.name) == (recording.name, name):
                        stuck = [(one.stuck, YELLOW, 0.35)] if one.stuck else []
                        shaded = [*((gap, RED, 0.25) for gap in one.gaps), *stuck, *shaded]
            for (start, end), colour, alpha in shaded:
                axis.axvspan(start + move, end + move, color=colour, alpha=alpha, lw=0)
            if row == 0 and len(recordings) > 1:
                across, text = axis.get_xaxis_transform(), escape_invisible(f" {recording.name}")
                axis.text(shift, 1.0, text, fontsize=7.5, color=GREY, va="top", transform=across,
                          parse_math=False)  # fmt: skip
            shift += float(recording.end - recording.start)
            axis.axvline(shift, color=GREY, lw=0.8, ls=":")
        one = next(one for one in check.channels if one.name == name)
        axis.set_title(_format_facts(one), loc="left", fontsize=8.5, parse_math=False, pad=3)
        axis.tick_params(labelsize=7.5, labelbottom=row == len(names) - 1)
        axis.spines[["top", "right"]].set_visible(False)
        axis.margins(x=0.0)
    label = "time [s]" if len(recordings) == 1 else "recordings in a row, time [s]"
    axes[-1].set_xlabel(label, fontsize=8)


def _format_facts(check: ChannelCheck) -> str:
    """Return the title of a channel: name, unit, rate, quantisation, noise and missing samples."""
    signal = f" \N{RIGHTWARDS ARROW} {check.signal}" if check.signal != check.name else ""
    parts = [f"{check.name}{signal}  [{check.unit}]", f"{check.rate:.4g} Hz"]
    if check.quantum:
        parts.append(f"step {check.quantum / check.factor:.3g}")
    parts.append(f"noise {check.noise / check.factor:.2g}")
    if check.dropped >= 0.001:
        parts.append(f"{check.dropped:.1%} missing")
    return escape_invisible("   ".join(parts))


def _envelope(times: Reals, values: Reals) -> tuple[Reals, Reals]:
    """Return the curve, or the minimum and maximum of each block if it has too many points."""
    if len(values) <= MAX_POINTS:
        return times, values
    size = -(-len(values) // (MAX_POINTS // 2))
    kept = len(values) // size * size
    blocks = values[:kept].reshape(-1, size)
    ends = np.stack((blocks.min(axis=1), blocks.max(axis=1)), axis=1).ravel()
    starts = times[:kept].reshape(-1, size)[:, 0]
    return np.repeat(starts, 2), ends


def _main_signal(signals: Sequence[SignalExcitation]) -> SignalExcitation | None:
    """Return the signal with most steps, then with the largest bandwidth; None without signals."""
    return max(signals, key=lambda one: (len(one.steps), one.band), default=None)


def _draw_operating_range(
    axis: Axes, recordings: Sequence[Recording], excitation: Excitation
) -> None:
    """Draw the main input over the main speed."""
    first, second = _main_signal(excitation.inputs), _main_signal(excitation.speeds)
    pairs = [
        (r.channels[first.name], r.channels[second.name])
        for r in recordings
        if first and second and {first.name, second.name} <= r.channels.keys()
    ]
    title = "where the machine has been"
    if not first or not second or not pairs or first is second:
        _draw_empty(axis, title, "no input beside a speed")
        return
    for driven, speed in pairs:
        x = np.interp(driven.seconds, speed.seconds, speed.array) / si_factor(speed)
        y = driven.array / si_factor(driven)
        axis.plot(x, y, color=BLUE, lw=0.3, alpha=0.5)
        axis.scatter(x[::3], y[::3], s=5, color=BLUE, alpha=0.35, lw=0)
    axis.axhline(0.0, color="black", lw=0.6)
    axis.axvline(0.0, color="black", lw=0.6)
    _label_axes(axis, title, f"{second.name} [{second.unit}]", f"{first.name} [{first.unit}]")


def _draw_spectrum(axis: Axes, recordings: Sequence[Recording], check: RecordingCheck) -> None:
    """Draw the amplitude spectral density of the main input, and the level of its noise."""
    main, title = _main_signal(check.excitation.inputs), "what the input excites"
    facts = [one for one in check.channels if main and one.name == main.name]
    if not main or not facts:
        _draw_empty(axis, title, "no input")
        return
    for recording, one in zip(recordings, facts, strict=False):
        channel = recording.channels[main.name]
        if len(channel.array) < 64:
            continue
        values = (channel.array - channel.array.mean()) / si_factor(channel)
        frequencies, power = spectrum(values, one.rate, MAX_WINDOW)
        axis.loglog(frequencies[1:], np.sqrt(power[1:]) + 1e-12, color=ORANGE, lw=0.9, alpha=0.8)
    noise = max(facts[0].noise, facts[0].quantum / np.sqrt(12.0)) / facts[0].factor
    if noise:
        level = noise * np.sqrt(2.0 / facts[0].rate)
        axis.axhline(level, color=GREY, lw=1.0, ls="--")
        axis.annotate("its noise", (0.01, level), xycoords=("axes fraction", "data"), fontsize=7.5,
                      ha="left", va="bottom", color=GREY)  # fmt: skip
    _label_axes(axis, title, "frequency [Hz]", f"{main.name} [{main.unit}/\N{SQUARE ROOT}Hz]")


def _draw_effects(axis: Axes, excitation: Excitation) -> None:
    """List the effects: testable ones in green, the others pale."""
    able = sum(effect.is_testable for effect in excitation.effects)
    title = f"these data can test {able} of {len(excitation.effects)} effects"
    axis.set_title(title, loc="left", fontsize=9.5)
    axis.axis("off")
    rows = -(-len(excitation.effects) // 2)
    ordered = sorted(excitation.effects, key=lambda effect: (not effect.is_testable, effect.effect))
    for k, effect in enumerate(ordered):
        x, y = 0.52 * (k // rows), 1.0 - (k % rows + 0.5) / rows
        good = effect.is_testable
        axis.plot([x + 0.012], [y], "o" if good else "x", ms=4.2, transform=axis.transAxes,
                  color=GREEN if good else PALE, clip_on=False)  # fmt: skip
        axis.text(x + 0.04, y, effect.effect, fontsize=7.6, va="center",
                  color="black" if good else "#9a9a9a", transform=axis.transAxes)  # fmt: skip


def _draw_findings(axis: Axes, check: RecordingCheck) -> None:
    """Write the first findings as lines, errors first."""
    axis.axis("off")
    lines = format_findings(check.findings)
    if not lines:
        axis.text(0.0, 0.5, "nothing odd was found in these data", color=GREEN, fontsize=10,
                  va="center", transform=axis.transAxes)  # fmt: skip
    shown = lines[:MAX_FINDINGS]
    for k, (severity, line) in enumerate(shown):
        rest = len(lines) - len(shown)
        more = f"   (and {rest} more)" if rest and k == len(shown) - 1 else ""
        text = escape_invisible(truncate(f"{SIGNS[severity]} {line}{more}", MAX_LINE_LENGTH))
        axis.text(0.0, 1.0 - (k + 0.5) / len(shown), text, fontsize=9, va="center",
                  color=COLOURS[severity], transform=axis.transAxes,
                  parse_math=False)  # fmt: skip


def _label_axes(axis: Axes, title: str, x: str, y: str) -> None:
    """Write the title and the labels of axes, and hide the upper and the right border."""
    axis.set_title(title, loc="left", fontsize=9.5)
    axis.set_xlabel(escape_invisible(x), fontsize=8, parse_math=False)
    axis.set_ylabel(escape_invisible(y), fontsize=8, parse_math=False)
    axis.tick_params(labelsize=7.5, which="both")
    axis.spines[["top", "right"]].set_visible(False)


def _draw_empty(axis: Axes, title: str, text: str) -> None:
    """Write a title, and a text in the middle of empty axes."""
    axis.set_title(title, loc="left", fontsize=9.5)
    axis.axis("off")
    axis.text(0.5, 0.5, text, ha="center", color=GREY, fontsize=9, transform=axis.transAxes)
