"""Pareto: delay against false losses of contact as the protection against chatter grows."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyarrow.dataset
from matplotlib.figure import Figure

import modewright as mw
from tests.validation.evidence.evidence_store import ROOT
from tests.validation.paper.observers import CRUISE_MINUTES, MS

DELAYS, LOSSES = "delay_by_level", "losses_by_level"
WAIT, HYSTERESIS = 2.0, 1.5
"""A level in the paper's scheme [ms] and in the better observer [N*m], as the studies have it."""


@dataclass(frozen=True)
class Point:
    """A setting: median and 95th percentile of the first delay [ms], false losses in a minute."""

    setting: str
    median: float
    p95: float
    cruise: float


def run_pareto(folder: Path) -> dict[str, list[Point]]:
    """Run both studies, or go on with them, and return the points of each scheme."""
    tables = []
    for name in (DELAYS, LOSSES):
        mw.sweep(name, folder / name, root=ROOT, block=50)
        tables.append(pyarrow.dataset.dataset(folder / name / "blocks").to_table().to_pandas())
    delays, losses = tables
    found: dict[str, list[Point]] = {"paper": [], "better": []}
    for level in sorted(set(delays["level"])):
        here, there = delays[delays["level"] == level], losses[losses["level"] == level]
        for scheme, ending, size, unit in (
            ("paper", "_est", WAIT, "ms"),
            ("better", "", HYSTERESIS, "N*m"),
        ):
            first = here[f"gaps{ending}.first"].dropna().to_numpy() * MS
            median, p95 = float(np.median(first)), float(np.percentile(first, 95))
            cruise = float(there[f"losses{ending}"].mean() / CRUISE_MINUTES)
            found[scheme].append(Point(f"{level * size:g} {unit}", median, p95, cruise))
    return found


def picture(points: dict[str, list[Point]]) -> Figure:
    """Draw both fronts: the better corner is the lower left one."""
    figure = Figure(figsize=(7.0, 4.2), layout="constrained")
    axes = figure.add_subplot()
    looks = {
        "paper": ("#444a52", "s", "the paper's scheme, by its wait"),
        "better": ("#c0392b", "o", "the better observer, by its hysteresis"),
    }
    for scheme, (colour, marker, label) in looks.items():
        own = points[scheme]
        x, y = [p.median for p in own], [p.cruise for p in own]
        axes.plot(x, y, color=colour, marker=marker, lw=0.8, label=label)
        places: dict[tuple[float, float], list[str]] = {}
        for point in own:
            places.setdefault((point.median, point.cruise), []).append(point.setting)
        for where, settings in places.items():
            text = ", ".join(settings)
            axes.annotate(text, where, textcoords="offset points", xytext=(5, 4), fontsize=7)
    axes.set_yscale("symlog", linthresh=1.0)
    axes.set_ylim(bottom=-0.2)
    axes.margins(x=0.12)
    axes.set_xlabel("first loss of contact is seen, median delay [ms]")
    axes.set_ylabel("false losses in a minute at 2 N*m")
    axes.grid(alpha=0.25)
    axes.legend()
    return figure
