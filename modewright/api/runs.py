"""Runs: read, save, plot and compare trajectories, run files and `system:scenario`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from engine.results.run_comparison import RunDifference, compare_runs
from engine.results.run_file import FORMATS, encode_run, read_run
from engine.results.trajectory import Trajectory
from modewright.api import simulation as api
from modewright.runtime.output_files import write_files

if TYPE_CHECKING:
    from engine.results.plot import Picture

Run = Trajectory | str | Path
"""A trajectory, the path of a run file, or `system:scenario` to simulate."""


def save(trajectory: Trajectory, path: str | Path) -> None:
    """Write a run to `.csv` (with events and names in `.csv.json` beside it) or to `.parquet`.

    Both files are replaced atomically. Raises OutputError, MissingToolError without pyarrow, and
    ValueError for other suffixes.
    """
    write_files(encode_run(trajectory, Path(path)))


def read(run: Run, root: Path | None = None) -> Trajectory:
    """Return a run as a trajectory; a trajectory is returned as it is.

    A path with the suffix .csv or .parquet is a file that `save` wrote; another text is
    `system:scenario`, split at the last colon, and is simulated. Raises SpecError,
    MissingToolError, and ValueError for a text without colon.
    """
    if isinstance(run, Trajectory):
        return run
    if Path(run).suffix.lower() in FORMATS:
        return read_run(Path(run))
    system, colon, scenario = str(run).rpartition(":")
    if not colon or not system or not scenario:
        raise ValueError(f"`{run}` is neither a .csv or .parquet file nor system:scenario")
    return api.simulate(system, scenario, root=root)


def plot(
    run: Run,
    other: Run | None = None,
    *,
    signals: Sequence[str] = (),
    span: tuple[float, float] | None = None,
    title: str = "",
) -> Picture:
    """Return a figure of one run, or of two runs with the second one dashed in the same colours.

    `signals` are patterns such as `plant.*` (all signals if empty). `span` is the time window [s];
    None is the whole run. An empty title is replaced by the labels of the runs. Raises as `read`,
    and ValueError for a run without samples or signals, for a window without samples and for a
    pattern that matches no signal.
    """
    from engine.results.plot import draw_overview

    runs = [read(each) for each in (run, other) if each is not None]
    names = [
        run_label(each, letter) for each, letter in ((run, "A"), (other, "B")) if each is not None
    ]
    for each, name in zip(runs, names, strict=True):
        if not len(each.times) or not each.signals:
            what = "signals" if len(each.times) else "samples"
            raise ValueError(f"`{name}` has no {what}: there is nothing to draw")
    shown = title or (f"A: {names[0]}; B (dashed): {names[1]}" if len(runs) > 1 else names[0])
    return draw_overview(runs, signals, span, shown)


def compare(
    a: Run,
    b: Run,
    *,
    relative: float = 0.0,
    tolerances: Mapping[str, float] | None = None,
    slack: float = 0.0,
    signals: Sequence[str] = (),
    span: tuple[float, float] | None = None,
) -> RunDifference:
    """Compare two runs signal by signal at the samples of `a`, to which `b` is interpolated.

    `is_within` of the result states whether all are within tolerance. A signal may differ by the
    larger of `relative` times its peak in `a` and its entry in `tolerances` (patterns of names,
    values in SI); by nothing without both. Modes may disagree for `slack` [s]. `signals` are
    patterns of the names to compare (all if empty), `span` is the time window [s]. Raises as
    `read`, and ValueError for runs without common time or signal, for different units, and for a
    tolerance that matches no signal, is negative or is not finite.
    """
    return compare_runs(
        read(a), read(b),
        relative=relative, tolerances=tolerances, slack=slack, patterns=signals, span=span,
    )  # fmt: skip


def run_label(run: Run, default: str) -> str:
    """Return the label of a run in a figure.

    A trajectory has its name, or `default` if that is empty; a run file its file name;
    `system:scenario` is its own label.
    """
    if isinstance(run, Trajectory):
        return run.name or default
    return Path(run).name if Path(run).suffix.lower() in FORMATS else str(run)
