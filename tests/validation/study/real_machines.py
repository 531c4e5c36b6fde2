"""Real machines: what a diagnosis says of their recordings, beside signals that it does not see.

python -m tests.validation.study.real_machines --recordings DIR [--only WORD]

The results are stored in docs/evidence/real_machines.json, from which the page is written.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import os
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import modewright as mw
from diagnosis.data.sampled_recording import SampledRecording, decimate
from diagnosis.estimation.estimate import evaluate
from diagnosis.estimation.noise_level import disturbance_units
from diagnosis.localisation.disturbance_state_fit import ALL_LEVELS, scan_level
from diagnosis.localisation.smoother import smooth_states
from diagnosis.model.parameter_vector import vector_of
from diagnosis.model.placed_effect import DISTURBANCE_STATE
from diagnosis.pipeline.diagnosis_case import read_series
from diagnosis.report.diagnosis_report import DiagnosisReport
from tests.diagnosis import real_machines as machines
from tests.validation.evidence.evidence_store import ROOT, write_json
from tests.validation.study.ground_truth import brake_figures, columns, slope_figures
from tests.validation.study.result_store import product_digest

Reals = NDArray[np.float64]
Figure = dict[str, Any]
EVIDENCE = ROOT / "docs" / "evidence" / "real_machines.json"
PRECISION, RECALL = 0.9, 0.8
GRADE, HEIGHT = 0.99, 0.9
THROTTLE, LONGEST_BREAK = 2.0, 15.0
"""Per cent of throttle above which no brake acts, and seconds of it that make a window."""
DAMPER = {
    "sine_0.5Hz_36lb_0.5in_1024Hz.csv.gz": 0.085,
    "sine_0.5Hz_80lb_1in_1024Hz.csv.gz": 0.125,
}


def main() -> None:
    """Diagnose each machine, print a line of JSON for it, and store the results."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--recordings", default=os.environ.get("MODEWRIGHT_RECORDINGS"))
    parser.add_argument("--only", default="", help="machines with this word in their name")
    given = parser.parse_args()
    if not given.recordings:
        parser.error("no recordings: give --recordings DIR or MODEWRIGHT_RECORDINGS")
    folder = Path(given.recordings).resolve()
    machine_figures: dict[str, Callable[[], Figure]] = {
        **{f"leaf_brake {name}": partial(brake, folder, name) for name in ("drive_eco", "drive_2")},
        **{f"damper {file}": partial(damper, folder, file) for file in DAMPER},
        "i3_grade": partial(grade, folder),
    }
    results = {one["machine"]: one for one in stored_results()}
    for name, figure in machine_figures.items():
        if given.only in name:
            results[name] = {"machine": name, **figure()}
            print(json.dumps(results[name]), flush=True)
            results[name]["code"] = product_digest()
            write_json(EVIDENCE, {"results": list(results.values())})


def stored_results() -> list[Figure]:
    """Return the stored result of each machine; empty if there are none."""
    return json.loads(EVIDENCE.read_text("utf-8"))["results"] if EVIDENCE.exists() else []


def brake(recordings: Path, drive: str) -> Figure:
    """Return how well the windows of the LEAF's friction brake are found in one drive.

    `is_fulfilled` is None where the brake never acts and none is named.
    """
    folder = recordings / "nissan_leaf"
    verdict = mw.diagnose("leaf_vehicle", [folder / f"{drive}.csv"]).verdict
    effects = [f"{one.id}@{one.place}" for one in verdict.effects]
    named = "unknown_input@flow.w_w" in effects
    windows = [(start, end) for start, end, _ in verdict.location[0].windows]
    found = brake_figures(folder / "truth" / f"{drive}_brake.csv", windows if named else [])
    is_fulfilled = named and found["precision"] >= PRECISION and found["recall"] >= RECALL
    return {
        "required": f"unknown_input on flow.w_w, precision >= {PRECISION}, recall >= {RECALL}",
        "says": verdict.verdict,
        "effects": effects,
        "windows": [[round(end, 2) for end in one] for one in windows] if named else [],
        **found,
        "result": "precision {precision:.2f}, recall {recall:.2f}".format(**found)
        if named
        else "no unknown input",
        "is_fulfilled": is_fulfilled if found["acts_s"] > 0.0 or named else None,
    }


def damper(recordings: Path, file: str) -> Figure:
    """The gap of the friction damper."""
    found = machines.diagnose_damper(recordings, file)
    return {
        "required": f"backlash, NRMSE <= {DAMPER[file]}",
        **found,
        "result": f"{' + '.join(found['effects']) or 'no effect'}, NRMSE {found['nrmse'][1]:.3f}",
        "is_fulfilled": "backlash" in found["effects"] and found["nrmse"][1] <= DAMPER[file],
    }


def grade(recordings: Path) -> Figure:
    """The grade of the road under the i3, over the whole trip, from its torque and speed alone.

    A cruise control drives without throttle.
    """
    file = recordings / "bmw_i3" / "trip_a11.csv.gz"
    dossier = mw.diagnose("bmw_i3", [file])
    effects = [f"{one.id}@{one.place}" for one in dossier.verdict.effects]
    whole, pull = _pull(dossier, file)
    times = float(whole.start) + float(whole.period) * np.arange(whole.count, dtype=np.float64)
    recorded = columns(file)
    throttle, torque, speed = (
        np.asarray(np.interp(times, recorded["t_s"], recorded[name]), dtype=np.float64)
        for name in ("throttle_pct", "motor_torque_Nm", "velocity_kmh")
    )
    free = throttle > THROTTLE
    driven = free | (torque > 0.0)
    known = np.asarray(np.interp(times, times[driven], pull[driven]), dtype=np.float64)
    truth = file.parent / "truth" / "trip_a11_road.csv.gz"
    windows = [one for one in _stays(times, free) if one[1] - one[0] >= LONGEST_BREAK]
    found = slope_figures(truth, times, speed / 3.6, known, windows)
    named = "road_grade@flow.v" in effects
    is_fulfilled = found["grade_correlation"] >= GRADE and found["height_correlation"] >= HEIGHT
    return {
        "required": f"road_grade on flow.v, grade >= {GRADE}, height >= {HEIGHT} (correlations)",
        "effects": effects,
        **found,
        "result": "grade {grade_correlation:.3f}, height {height_correlation:.2f}".format(**found),
        "is_fulfilled": named and is_fulfilled,
    }


def _pull(dossier: DiagnosisReport, file: Path) -> tuple[SampledRecording, Reals]:
    """Return a whole trip and the g sin(grade) [m/s^2] (samples,) that a smoother finds in it.

    With the parameters found in its windows, the grade as a random walk.
    """
    assert dossier.diagnosis
    bench, model = dossier.diagnosis.model_set, dossier.diagnosis.selection.model
    mapping = dataclasses.replace(dossier.case.mapping, windows={})
    case = dataclasses.replace(dossier.case, mapping=mapping, recordings={})
    (read,) = read_series(file, case, bench.automaton, bench.output_names)
    whole = decimate(read, bench.series[0].is_first_order_hold)
    values = {k: v for k, v in model.values(0).items() if not k.startswith("grade")}
    name = bench.disturbances[0].qualified_name(DISTURBANCE_STATE)
    candidate = bench.compile_candidate(())
    units = disturbance_units(candidate, [whole], values)
    start = evaluate(candidate, [whole], model.noise_levels, vector_of(candidate, 1, values))
    free = scan_level(start, [whole], units, name, ALL_LEVELS)
    column = free.candidate.predictor.states.index(name)
    (found,) = smooth_states(free, [whole])
    return whole, -found.states[:, column] / values["m"]


def _stays(times: Reals, free: NDArray[np.bool_]) -> list[tuple[float, float]]:
    """Return the times [s] from and to which something holds."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], free, [False]]).astype(int)))
    return [(float(times[a]), float(times[b - 1])) for a, b in edges.reshape(-1, 2)]


if __name__ == "__main__":
    main()
