"""Truth: what was concealed of recordings of real machines, as figures that a verdict is held to.

The only file that reads it; run when a method is finished, never to find one.
"""

from __future__ import annotations

import csv
import gzip
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Reals = NDArray[np.float64]
Windows = Sequence[tuple[float, float]]


def columns(path: Path) -> dict[str, Reals]:
    """Return the columns of a CSV file by name (rows,), NaN where a cell is blank."""
    data = path.read_bytes()
    text = (gzip.decompress(data) if path.suffix == ".gz" else data).decode()
    rows = list(csv.DictReader(text.splitlines()))
    return {name: np.array([float(row[name] or "nan") for row in rows]) for name in rows[0]}


def brake_figures(path: Path, windows: Windows) -> dict[str, float]:
    """Return precision and recall by samples of windows [s] in which a brake is said to act.

    It does where its force is not what it is most of the time.
    """
    known = columns(path)
    force = known["brake_force_raw"]
    rows = np.isfinite(force)
    values, counts = np.unique(force[rows], return_counts=True)
    acts = force[rows] != values[np.argmax(counts)]
    times = known["t_s"][rows]
    said = np.zeros(len(times), dtype=bool)
    for start, end in windows:
        said |= (times >= start) & (times <= end)
    both = float(np.sum(said & acts))
    return {
        "acts_s": float(np.sum(acts) * np.median(np.diff(times))),
        "precision": both / max(float(np.sum(said)), 1.0),
        "recall": both / max(float(np.sum(acts)), 1.0),
    }


def slope_figures(
    path: Path, times: Reals, speed: Reals, pull: Reals, windows: Windows
) -> dict[str, float]:
    """Return how an estimated g sin(grade) `pull` [m/s^2] agrees with what was concealed.

    Over its `times` [s] beside the `speed` [m/s]: its means over windows with those of the
    acceleration that a sensor in the car felt less what the car gained; the height that it comes to
    with the map's.
    """
    known = columns(path)
    felt, height = (
        np.interp(times, known["t_s"][np.isfinite(known[name])], _known(known[name]))
        for name in ("long_accel_mps2", "elevation_m")
    )
    mine, others = [], []
    for start, end in windows:
        rows = np.flatnonzero((times >= start) & (times <= end))
        gained = (speed[rows[-1]] - speed[rows[0]]) / (times[rows[-1]] - times[rows[0]])
        mine.append(float(np.mean(pull[rows])))
        others.append(float(np.mean(felt[rows])) - gained)
    climbed = np.cumsum(pull / 9.81 * speed) * float(np.median(np.diff(times)))
    return {
        "windows": float(len(mine)),
        "grade_correlation": _correlation(np.array(mine), np.array(others)),
        "height_correlation": _correlation(climbed, height),
    }


def _known(values: Reals) -> Reals:
    return values[np.isfinite(values)]


def _correlation(some: Reals, others: Reals) -> float:
    return float(np.corrcoef(some, others)[0, 1])
