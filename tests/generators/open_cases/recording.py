"""Recording: what the loggers make of a course, and its file."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from tests.generators.open_cases.case import Case, SimulatedRecording, stream
from tests.generators.open_cases.driveline_simulation import STEP
from tests.generators.open_cases.effect import Floats

HEADER = "t_s,T_em_Nm,T_br_Nm,w_em_radps,w_w_radps"
LINE = "%6.4f,%+07.2f,%+07.1f,%+07.2f,%+07.2f"
"""Every line has the same length, so that no file size tells what is in the file."""
DAY = 1_700_000_000
"""Time stamp of all files [s], so that none tells in which order they were made."""


def sample_recording(
    course: SimulatedRecording, case: Case, generator: np.random.Generator
) -> Floats:
    """Sample, add noise, quantise: time and the four columns, (n_samples, 5)."""
    stride = round(1.0 / (case.rate * STEP))
    columns = [
        (course.T_em, case.sensors.T_em),
        (course.T_br, case.sensors.T_br),
        (course.w_em, case.sensors.w_em),
        (course.w_w, case.sensors.w_w),
    ]
    rows = [np.arange(course.T_em[::stride].size) / case.rate]
    for values, (noise, quantum) in columns:
        sampled = values[::stride]
        noisy = sampled + noise * generator.standard_normal(sampled.size)
        rows.append(quantum * np.round(noisy / quantum))
    rows[2] = np.where(course.T_br[::stride] > 0.0, np.maximum(rows[2], 0.0), 0.0)
    return np.stack(rows, axis=1) + 0.0


def write_case(folder: Path, case: Case, recordings: list[SimulatedRecording]) -> None:
    """Write `train/rec_00.csv ...` and `held_out/rec_00.csv ...` below the folder."""
    generator = stream(case.seed, case.number, "noise")
    for number, course in enumerate(recordings):
        held_out = number >= case.train
        part = folder / ("held_out" if held_out else "train")
        part.mkdir(parents=True, exist_ok=True)
        path = part / f"rec_{number - case.train * held_out:02d}.csv"
        table = sample_recording(course, case, generator)
        text = "\n".join(LINE % tuple(row) for row in table.tolist())
        path.write_text(f"{HEADER}\n{text}\n", encoding="ascii")
        os.utime(path, (DAY, DAY))
