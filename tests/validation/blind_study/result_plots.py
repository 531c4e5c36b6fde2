"""Picture: confusion, rates, reliability, and how much better the models are."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tests.validation.blind_study.acceptance_criteria import by_effect
from tests.validation.blind_study.case_score import Answer
from tests.validation.blind_study.proportion import reliability

OTHERS = ("nothing_missing", "unknown", "ambiguous", "failed")
BLUE, GREY, RED = "#20639b", "#8a8f98", "#c0392b"
Answers = Sequence[Answer]


def draw(every: Answers, folder: Path) -> list[Path]:
    """Draw all figures of a study into a folder; return their files."""
    full, clean, weak = ([a for a in every if a.plan == p] for p in ("full", "clean", "weak"))
    figures = {
        "confusion": confusion(full),
        "rates": rates(full, weak),
        "reliability": calibration(full),
        "better": better(full, clean),
    }
    folder.mkdir(parents=True, exist_ok=True)
    for name, figure in figures.items():
        figure.savefig(folder / f"{name}.png", dpi=110, metadata={"Software": None})
    return [folder / f"{name}.png" for name in figures]


def confusion(full: Answers) -> Figure:
    """What was said of what is true: a row for each effect, counts as numbers."""
    true = sorted({one.true for one in full})
    said = [*true, *sorted({one.said for one in full} - {*true, *OTHERS}), *OTHERS]
    count = np.zeros((len(true), len(said)))
    for one in full:
        count[true.index(one.true), said.index(one.said)] += 1
    figure = Figure(figsize=(10.5, 8.5), layout="constrained")
    axes = figure.add_subplot()
    axes.imshow(count, cmap=mpl.colormaps["Blues"], vmax=max(count.max(), 1.0) * 1.5)
    for row, column in zip(*np.nonzero(count), strict=True):
        colour = "black" if true[row] == said[column] else RED
        number = f"{count[row, column]:.0f}"
        axes.text(column, row, number, ha="center", va="center", fontsize=8, color=colour)
    axes.set_xticks(range(len(said)), [_words(name) for name in said], rotation=90, fontsize=8)
    axes.set_yticks(range(len(true)), [_words(name) for name in true], fontsize=8)
    axes.set_xlabel("first name in the verdict")
    axes.set_ylabel("what was concealed")
    return figure


def rates(full: Answers, weak: Answers) -> Figure:
    """How often each effect is named first, with 95 % intervals, as it is and at 0.3 of it."""
    figure = Figure(figsize=(9.0, 7.0), layout="constrained")
    axes = figure.add_subplot()
    order = sorted(by_effect(full), key=lambda name: by_effect(full)[name].share)
    kinds = ((full, BLUE, 0.15, "full strength"), (weak, GREY, -0.15, "0.3 x strength"))
    for answers, colour, shift, label in kinds:
        found = by_effect(answers)
        for place, name in enumerate(order):
            if name in found:
                low, high = found[name].interval()
                axes.plot([low, high], [place + shift] * 2, color=colour, linewidth=1.0)
                share = found[name].share
                axes.plot(share, place + shift, "o", color=colour, markersize=4)
        axes.plot([], [], "o-", color=colour, label=label)
    axes.set_yticks(range(len(order)), [_words(name) for name in order], fontsize=8)
    axes.set_xlim(-0.02, 1.02)
    axes.set_xlabel("named first, with the 95 % interval of Wilson")
    axes.legend(loc="lower left", frameon=False)
    return _plain(figure, axes)


def calibration(full: Answers) -> Figure:
    """How often names are right against the probability that they were given."""
    said = [(one.probability or 0.0, one.is_named) for one in full if one.named]
    figure = Figure(figsize=(4.5, 4.5), layout="constrained")
    axes = figure.add_subplot()
    axes.plot([0, 1], [0, 1], color=GREY, linewidth=0.8)
    for one in reliability(said):
        low, high = one.right.interval()
        axes.plot([one.mean] * 2, [low, high], color=BLUE, linewidth=1.0)
        axes.plot(one.mean, one.right.share, "o", color=BLUE)
        text = f"  {one.right.count}"
        axes.text(one.mean, one.right.share, text, fontsize=8, ha="left", va="top")
    axes.set_xlabel("probability of the first name")
    axes.set_ylabel("part of them that is right")
    axes.set_xlim(0, 1.08)
    axes.set_ylim(0, 1.05)
    return _plain(figure, axes)


def better(full: Answers, clean: Answers) -> Figure:
    """Misfit of free simulation on held-out recordings, without and with what was found."""
    figure = Figure(figsize=(5.5, 5.0), layout="constrained")
    axes = figure.add_subplot()
    for right, colour, label in ((True, BLUE, "named rightly"), (False, RED, "wrongly, or not")):
        points = [
            (one.misfit("before") or np.nan, one.misfit("after") or np.nan)
            for one in full
            if one.is_named == right
        ]
        axes.plot(*np.array(points or [(np.nan, np.nan)]).T, ".", color=colour, label=label)
    floors = [one.misfit("after") or np.nan for one in clean]
    if floors:
        low, high = np.nanpercentile(floors, [10, 90])
        axes.axhspan(low, high, color=GREY, alpha=0.25, label="nothing concealed (10 to 90 %)")
    ends = np.array([1e-3, 3.0])
    axes.plot(ends, ends, color=GREY, linewidth=0.8)
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlabel("held-out NRMSE of the recalibrated model")
    axes.set_ylabel("with what was found")
    axes.legend(frameon=False, loc="upper left", fontsize=8)
    return _plain(figure, axes)


def _plain(figure: Figure, axes: Axes) -> Figure:
    axes.spines[["top", "right"]].set_visible(False)
    return figure


def _words(name: str) -> str:
    return name.replace("_", " ")
