"""Verify runs against reference traces of the paper; writes evidence/reference_traces.json.

Resumable: a figure that was measured with the same code is not measured again. Figures that need
the real recordings are left as they are, or as "not measured", where these are absent.
"""

from __future__ import annotations

import argparse
import csv
import gzip
import os
import sys
from collections.abc import Callable
from fractions import Fraction
from functools import partial
from pathlib import Path

import numpy as np

import modewright as mw
from tests.validation.evidence.evidence_store import ROOT, Figure, measure_figures

PAPER = ROOT / "tests" / "data" / "paper"
DRIVES = {"drive_eco": 20.151, "drive_2": 7.55}
"""When the torque report crosses zero [s]."""
NUMBERS = {"drive": "1", "gap": "0", "coast": "-1"}


def main() -> int:
    """Measure what is not measured yet; return 0 if every bar is met."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--recordings", default=os.environ.get("MODEWRIGHT_RECORDINGS"))
    named = parser.parse_args().recordings
    os.chdir(ROOT)
    return measure_figures("reference_traces", figures(Path(named) if named else None))


def figures(recordings: Path | None) -> dict[str, Callable[[], Figure]]:
    """Return what can be measured here."""
    found: dict[str, Callable[[], Figure]] = {"tip_out": tip_out, "lockstep": lockstep}
    for suffix in ("", "_noisy"):
        found[f"replay_1kHz{suffix}"] = partial(reference_replay, suffix)
    found["refused"] = check_refused_specs
    if recordings:
        for drive in DRIVES:
            for estimator in ("estimator", "estimator_simple"):
                path = recordings / "nissan_leaf" / f"{drive}.csv"
                found[f"{estimator}_{drive}"] = partial(leaf, estimator, path)
    return found


def tip_out() -> Figure:
    """Plant events and signals against the reference trace."""
    trajectory = mw.simulate("ev_driveline_ideal", "tip_out")
    with (PAPER / "truth_tip_out_events.csv").open() as file:
        expected = np.array([float(row["t"]) for row in csv.DictReader(file)])
    times = np.array([event.time for event in trajectory.events_of("plant")])
    with gzip.open(PAPER / "truth_tip_out.csv.gz", "rt") as file:
        rows = list(csv.DictReader(file))
    near = np.any(np.abs(trajectory.times[:, None] - times[None, :]) < 2e-6, axis=1)
    relative = {}
    for signal in ("w_em", "w_w", "theta_d", "theta_b", "w_b", "T_hs"):
        reference = np.array([float(row[signal]) for row in rows])
        kept = ~near if signal in ("T_hs", "w_b") else np.ones(len(rows), dtype=bool)
        difference = np.abs(trajectory.signals[f"plant.{signal}"] - reference)[kept]
        relative[signal] = float(difference.max() / np.abs(reference).max())
    late = float(np.abs(times - expected).max())
    met = len(times) == 10 and late <= 1e-6 and max(relative.values()) <= 1e-6
    return {"met": met, "events": len(times), "largest_event_error_s": late, "signals": relative}


def lockstep() -> Figure:
    """Both estimators beside the plant against their C."""
    _, verdicts = mw.lockstep("ev_driveline", "tip_out")
    values = {verdict.name: [verdict.values, verdict.differing] for verdict in verdicts}
    return {"met": all(verdict.is_equal for verdict in verdicts), "values_differing": values}


def reference_replay(suffix: str) -> Figure:
    """The same transitions as the reference estimator, and the golden case of rule 2."""
    name = f"est_paper_tip_out_1kHz{suffix}"
    found = mw.replay("estimator", PAPER / f"{name}.csv.gz", "reference_trace")
    with (PAPER / f"{name}_events.csv").open() as file:
        expected = list(csv.DictReader(file))
    events = found.result.trajectory.events
    same = [(NUMBERS[e.source], NUMBERS[e.target]) for e in events] == [
        (row["from"], row["to"]) for row in expected
    ]
    late = max(
        abs(Fraction(repr(e.time)) - Fraction(row["t"]))
        for e, row in zip(events, expected, strict=False)
    )
    trajectory = found.result.trajectory
    torque, times = trajectory.signals["T_hs"], trajectory.times
    window = times > 0.45
    first = float(times[window][np.argmax(torque[window] <= 0.0)])
    golden = first == 0.507 and events[0].time == 0.508
    assert found.verdict
    return {
        "met": same and late <= Fraction(1, 1000) and golden and found.verdict.is_equal,
        "transitions": len(events),
        "largest_difference_s": float(late),
        "torque_first_at_or_below_zero_s": first,
        "mode_changes_s": events[0].time,
        "differing_bits": found.verdict.differing,
    }


def leaf(estimator: str, path: Path) -> Figure:
    """A real drive: bits, transitions around the tip-out, innovation."""
    found = mw.replay(estimator, path, "leaf_can", variant="leaf")
    crossing = DRIVES[path.stem]
    events = found.result.trajectory.events
    left = [e.time for e in events if e.source == "drive" and abs(e.time - crossing) <= 0.15]
    reached = [e.time for e in events if e.target == "coast" and e.time > crossing - 0.15]
    before = [e.time for e in events if crossing - 5.15 <= e.time < crossing - 0.15]
    assert found.verdict
    met = len(left) == 1 and bool(reached) and not before and found.verdict.is_equal
    return {
        "met": met,
        "left_drive_s": left,
        "reached_coast_s": reached[:1],
        "torque_report_crosses_zero_s": crossing,
        "transitions_in_the_5_s_before": len(before),
        "differing_bits": found.verdict.differing,
        "innovation_rms_rad_per_s": dict(found.result.innovation_rms),
    }


def check_refused_specs() -> Figure:
    """Specs that are refused with exactly the text beside them."""
    book = (ROOT / "tests" / "semantics" / "invalid_specs").glob("*.yaml")
    specs = [spec for spec in sorted(book) if not spec.stem.endswith(".repaired")]
    wrong = [
        spec.stem
        for spec in specs
        if mw.render_all(mw.check(str(spec.relative_to(ROOT)))) + "\n"
        != spec.with_suffix(".txt").read_text()
    ]
    count = len(specs)
    return {"met": count >= 10 and not wrong, "specs": count, "other_text": wrong}


if __name__ == "__main__":
    sys.exit(main())
