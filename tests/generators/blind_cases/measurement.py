"""Instruments: noise, quanta, sampling, and the CSV file that comes of it."""

from dataclasses import dataclass

import numpy as np

from tests.generators.blind_cases.recording import Recording
from tests.generators.blind_cases.solver import STEP_S, Array, Motion

COLUMNS = "t_s,T_em_Nm,T_br_Nm,w_em_radps,w_w_radps"
ROW = "%08.4f,%+010.4f,%+010.4f,%+010.4f,%+010.4f\n"
"""Every number has the same width, whatever its value."""


@dataclass(frozen=True)
class Instrument:
    """Noise's standard deviation and quantum, in the unit of the signal."""

    sd: float
    quantum: float

    def read(self, values: Array, rng: np.random.Generator) -> Array:
        """The values as recorded."""
        noisy = values + self.sd * rng.standard_normal(len(values))
        return np.asarray(np.round(noisy / self.quantum) * self.quantum + 0.0)


@dataclass(frozen=True)
class Instruments:
    """Those of a case, in the order of the columns."""

    demand: Instrument
    brake: Instrument
    w_em: Instrument
    w_w: Instrument


def draw_instruments(rng: np.random.Generator) -> Instruments:
    """Noise and quanta within the ranges that the tool was told."""
    return Instruments(
        Instrument(float(rng.uniform(0.1, 0.4)), 0.25),
        Instrument(float(rng.uniform(0.5, 1.5)), 1.0),
        Instrument(float(rng.uniform(0.05, 0.2)), float(rng.choice([0.02, 0.05, 0.1]))),
        Instrument(float(rng.uniform(0.01, 0.04)), float(rng.choice([0.005, 0.01, 0.02]))),
    )


def sample_rows(instruments: Instruments, recording: Recording, motion: Motion, rate: int) -> Array:
    """Recorded rows at `rate` [Hz]: time, demand, brake, motor speed, wheel speed."""
    stride = round(1.0 / (rate * STEP_S))
    signals = (recording.demand, recording.brake, motion.w_em, motion.w_w)
    readers = (instruments.demand, instruments.brake, instruments.w_em, instruments.w_w)
    columns = [np.arange(0, len(recording.demand), stride) * STEP_S]
    for number, (signal, reader) in enumerate(zip(signals, readers, strict=True)):
        rng = np.random.default_rng([*recording.key, 200 + number])
        columns.append(reader.read(signal[::stride], rng))
    return np.column_stack(columns)


def csv_text(rows: Array) -> str:
    """The CSV file."""
    return COLUMNS + "\n" + (ROW * len(rows)) % tuple(rows.ravel().tolist())
