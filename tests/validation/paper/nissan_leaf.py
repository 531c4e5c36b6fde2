"""Leaf: both estimators on two road drives of a Nissan LEAF; docs/paper/leaf.md.

python -m tests.validation.paper.nissan_leaf --recordings DIR
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jinja2 import Environment, StrictUndefined
from matplotlib.figure import Figure

import modewright as mw
from tests.validation.evidence.evidence_store import ROOT
from tests.validation.paper.manoeuvre import Reals, signal
from tests.validation.paper.report_page import FOLDER

DRIVES = ("drive_eco", "drive_2")
SCHEMES = {"estimator": "leaf", "hko": "leaf_hko"}
"""Variants of the paper's scheme and of the better observer."""
LEAST, CALM = 2.0, 0.5
"""A torque [N*m] that counts as having a sign, and how long another one is not a new event [s]."""
AROUND = (0.2, 0.3)
"""What is shown before and after a change of sign, and where a loss belongs to it [s]."""
TRUTH, PAPER, BETTER = "#444a52", "#20639b", "#c0392b"


@dataclass(frozen=True)
class Change:
    """Where the motor's torque changes its sign for good [s], and when each scheme loses contact
    and has it again on a side there [s], NaN: not at all; `bounces` are when it loses it once more.
    """

    drive: str
    time: float
    lost: dict[str, float]
    again: dict[str, float]
    bounces: dict[str, list[float]]


def apart(times: Sequence[dict[str, float]]) -> float:
    """Return how far the schemes are apart at most in what they do at some instants [s]."""
    return max(max(one.values()) - min(one.values()) for one in times)


def main(arguments: Sequence[str] | None = None) -> int:
    """Replay both drives; return 0 if both schemes lose contact at every change of sign."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--recordings", default=os.environ.get("MODEWRIGHT_RECORDINGS"))
    given = parser.parse_args(arguments)
    if not given.recordings:
        parser.error("no recordings: give --recordings DIR or MODEWRIGHT_RECORDINGS")
    found: list[Change] = []
    runs = {}
    paths = {d: Path(given.recordings).resolve() / "nissan_leaf" / f"{d}.csv" for d in DRIVES}
    for path in paths.values():
        if not path.is_file():
            parser.error(f"{path}: there is no such recording")
    for drive, path in paths.items():
        runs[drive] = {n: mw.replay(n, path, "leaf_can", v, root=ROOT) for n, v in SCHEMES.items()}
        found += changes(drive, {n: one.result.trajectory for n, one in runs[drive].items()})
    differing = sum(
        one.verdict.differing for own in runs.values() for one in own.values() if one.verdict
    )
    trajectories = {d: {n: r.result.trajectory for n, r in own.items()} for d, own in runs.items()}
    picture(found, trajectories).savefig(FOLDER / "leaf.png", dpi=110, metadata={"Software": None})
    shown = Environment(undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    template = Path(__file__).with_name("leaf.md.jinja").read_text("utf-8")
    text = shown.from_string(template).render(
        changes=found,
        differing=differing,
        lost_ms=1e3 * apart([one.lost for one in found]),
        again_ms=1e3 * apart([one.again for one in found]),
    )
    (FOLDER / "leaf.md").write_text(text, encoding="utf-8")
    print(text)
    return 0 if all(np.isfinite(t) for one in found for t in one.lost.values()) else 1


def changes(drive: str, runs: dict[str, mw.Trajectory]) -> list[Change]:
    """Return where the torque that the motor reports changes its sign, and what was seen there."""
    one = runs["estimator"]
    torque = signal(one, "in.T_em")
    found = []
    for time in signs(one.times, torque):
        begin, end = time - AROUND[0], time + AROUND[1]
        lost: dict[str, float] = {}
        again: dict[str, float] = {}
        bounces: dict[str, list[float]] = {}
        for name, run in runs.items():
            here = [event for event in run.events if begin <= event.time <= end]
            lost[name] = next((e.time for e in here if e.target == "gap"), float("nan"))
            back = [e.time for e in here if e.target != "gap" and e.time > lost[name]]
            again[name] = back[0] if back else float("nan")
            later = [e.time for e in here if e.target == "gap" and e.time > again[name]]
            bounces[name] = later
        found.append(Change(drive, time, lost, again, bounces))
    return found


def signs(times: Reals, torque: Reals) -> list[float]:
    """Return when a torque first lies on the other side of 0, each time for good [s]."""
    found: list[float] = []
    side = 0.0
    for time, value in zip(times.tolist(), torque.tolist(), strict=True):
        now = float(np.sign(value)) if abs(value) >= LEAST else 0.0
        if now and side and now != side and (not found or time - found[-1] > CALM):
            found.append(time)
        side = now or side
    return found


def picture(found: Sequence[Change], runs: dict[str, dict[str, mw.Trajectory]]) -> Figure:
    """Draw torques and modes around each change of sign."""
    figure = Figure(figsize=(4.2 * len(found), 5.0), layout="constrained")
    axes = figure.subplots(2, len(found), sharex="col", squeeze=False)
    for column, change in enumerate(found):
        upper, lower = axes[0][column], axes[1][column]
        one = runs[change.drive]["estimator"]
        part = (one.times >= change.time - AROUND[0]) & (one.times <= change.time + AROUND[1])
        t = one.times[part]
        upper.step(t, signal(one, "in.T_em")[part], color=TRUTH, where="post", label="T_EM, motor")
        for name, colour, label in (
            ("estimator", PAPER, "the paper's scheme"),
            ("hko", BETTER, "the better observer"),
        ):
            run = runs[change.drive][name]
            upper.plot(t, signal(run, "T_hs")[part] / 8.1938, color=colour, lw=1.0,
                       label=f"T_hs / R, {label}")  # fmt: skip
            lower.step(t, signal(run, "mode")[part], color=colour, where="post", label=label)
        upper.set_title(f"{change.drive}, {change.time:.2f} s", fontsize=9)
        lower.set_yticks((1, 0, -1), ["drive", "gap", "coast"])
        lower.set_xlabel("time [s]")
        for each in (upper, lower):
            each.grid(alpha=0.25)
    axes[0][0].set_ylabel("torque at the motor [N*m]")
    axes[0][0].legend(fontsize=7, loc="lower left")
    return figure


if __name__ == "__main__":
    sys.exit(main())
