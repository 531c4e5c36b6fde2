"""Runs: read, save, plot and compare trajectories, run files and `system:scenario`."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from engine.results.run_comparison import RunDifference, compare_runs
from engine.results.run_file import FORMATS, encode_run, read_run
from engine.results.trajectory import Trajectory
from language.text.arguments import (
    PathText,
    PathTexts,
    TimeWindow,
    optional,
    require_instance,
    to_mapping,
    to_number,
    to_path,
    to_some_texts,
    to_text,
    to_time_window,
)
from language.text.diagnostic import DataError
from modewright.api import simulation as api
from modewright.runtime.output_files import write_files

if TYPE_CHECKING:
    from engine.results.plot import Picture

Run = Trajectory | PathText
"""A trajectory, the path of a run file, or `system:scenario` to simulate."""


def save(trajectory: Trajectory, path: PathText) -> None:
    """Write a run to `.csv` (with events and names in `.csv.json` beside it), `.parquet` or `.mf4`.

    Both files are replaced atomically. Raises OutputError, MissingToolError without pyarrow or
    asammdf, and ValueError for other suffixes.
    """
    require_instance(trajectory, Trajectory, "trajectory")
    write_files(encode_run(trajectory, to_path(path, "path")))


def read(run: Run, root: PathText | None = None) -> Trajectory:
    """Return a run as a trajectory; a trajectory is returned as it is.

    A path with the suffix .csv or .parquet is a file that `save` wrote; another text is
    `system:scenario`, split at the last colon, and is simulated. Raises SpecError,
    MissingToolError, and ValueError for a text without colon.
    """
    return _trajectory_of(run, "run", root)


def _trajectory_of(run: Run, name: str, root: PathText | None = None) -> Trajectory:
    """Return the run of an argument; errors contain the name of the argument."""
    if isinstance(run, Trajectory):
        return run
    text = to_text(run, name, "a trajectory, a path or `system:scenario`")
    if Path(text).suffix.lower() in FORMATS:
        return read_run(Path(text))
    side_of = Path(text.removesuffix(".json"))
    if Path(text).suffix.lower() == ".mf4":
        label = f"`{text}` is for other tools and for `replay`: an MF4 has no transitions"
        raise ValueError(f"{label}; compare runs in .csv or .parquet")
    if text.endswith(".json") and side_of.suffix.lower() == ".csv":
        raise ValueError(f"`{text}` is the side file of a run: name the run, {side_of}")
    system, colon, scenario = text.rpartition(":")
    if not colon or not system or not scenario:
        raise ValueError(f"`{text}` is neither a .csv or .parquet file nor system:scenario")
    return api.simulate(system, scenario, root=root)


def plot(
    run: Run,
    other: Run | None = None,
    *,
    signals: PathTexts | None = None,
    span: TimeWindow | None = None,
    title: str = "",
) -> Picture:
    """Return a figure of one run, or of two runs with the second one dashed in the same colours.

    `signals` is a pattern such as `plant.*` or a list of patterns; None means all signals. `span`
    is the time window [s]; None is the whole run. An empty title is replaced by the labels of the
    runs. Raises as `read`, and ValueError for a run without samples or signals, for a window
    without samples, for an empty list and for a pattern that matches no signal.
    """
    from engine.results.plot import draw_overview

    patterns = optional(to_some_texts, signals, "signals") or ()
    window = optional(to_time_window, span, "span")
    title = to_text(title, "title", "a text")
    runs = [_trajectory_of(run, "run")]
    names = [run_label(run, "A")]
    if other is not None:
        runs.append(_trajectory_of(other, "other"))
        names.append(run_label(other, "B"))
    for each, name in zip(runs, names, strict=True):
        if not len(each.times) or not each.signals:
            what = "signals" if len(each.times) else "samples"
            raise DataError(f"`{name}` has no {what}: there is nothing to draw")
    shown = title or (f"A: {names[0]}; B (dashed): {names[1]}" if len(runs) > 1 else names[0])
    return draw_overview(runs, patterns, window, shown)


def compare(
    a: Run,
    b: Run,
    *,
    relative: float = 0.0,
    tolerances: Mapping[str, float] | None = None,
    slack: float = 0.0,
    signals: PathTexts | None = None,
    span: TimeWindow | None = None,
    offset: float = 0.0,
    align: bool = False,
) -> RunDifference:
    """Compare two runs signal by signal at the samples of `a`, to which `b` is interpolated.

    `offset` [s] is added to the times of `b`. With `align` the offset with the largest correlation
    of the runs is found instead; `shift` of the result states it.

    `is_within` of the result states whether all are within tolerance. A signal may differ by the
    larger of `relative` times its peak in `a` and its entry in `tolerances` (patterns of names,
    values in SI); by nothing without both. Modes may disagree for `slack` [s]. `signals` is a
    pattern of the names to compare or a list of patterns (None: all), `span` is the time window
    [s]. Raises as `read`; DataError, a ValueError, for runs without common time or signal, for
    different units and for runs that do not correlate; and ValueError for a tolerance that matches
    no signal, is negative or is not finite, for `align` with an offset, and for an empty list.
    """
    allowed = {
        pattern: to_number(value, f"tolerances[{pattern!r}]")
        for pattern, value in (optional(to_mapping, tolerances, "tolerances") or {}).items()
    }
    patterns = optional(to_some_texts, signals, "signals") or ()
    window = optional(to_time_window, span, "span")
    relative, slack = to_number(relative, "relative"), to_number(slack, "slack")
    offset = to_number(offset, "offset")
    if align and offset:
        raise ValueError("`align` finds the offset: leave out one of them")
    return compare_runs(
        _trajectory_of(a, "a"), _trajectory_of(b, "b"),
        relative=relative, tolerances=allowed, slack=slack, patterns=patterns, span=window,
        offset=None if align else offset,
    )  # fmt: skip


def run_label(run: Run, default: str) -> str:
    """Return the label of a run in a figure.

    A trajectory has its name, or `default` if that is empty; a run file its file name;
    `system:scenario` is its own label.
    """
    if isinstance(run, Trajectory):
        return run.name or default
    path = Path(run)
    return path.name if path.suffix.lower() in FORMATS else os.fspath(run)
