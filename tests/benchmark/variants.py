"""Variants: a sweep of the tip-out over five parameters, by compiled C of ours and by the rival."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from codegen.simulator.simulator_library import load_library
from engine.batch.batch import Batch, SignalStatistic
from engine.batch.compiled_batch import CompiledBatch
from tests.benchmark import hand_written_c as in_c, modewright_run as ours
from tests.benchmark.manoeuvre import NOMINAL, Manoeuvre

PARTS = {"m": 0.2, "J_em": 0.2, "k_hs": 0.2, "c_hs": 0.15, "alpha": 0.3}
"""How far each parameter goes to both sides of its nominal value, as a part of it."""
SEED = 4
STEP, FINE = 0.005, 0.001
Reals = NDArray[np.float64]


@dataclass(frozen=True)
class Summary:
    """Of each variant (n,): final speed [rad/s], first contact [s], events, peak torque [N*m]."""

    w_em: Reals
    contact: Reals
    events: Reals
    peak: Reals

    def errors(self, fine: Summary) -> dict[str, float]:
        """Return the largest differences from a finer solution, where the events are as many.

        A contact that is hardly touched is found by one step and not by another.
        """
        same = self.events == fine.events
        late = np.abs(self.contact - fine.contact)[same & np.isfinite(fine.contact)]
        off = np.abs(self.w_em / fine.w_em - 1.0)[same]
        return {
            "late": float(np.max(late, initial=0.0)),
            "median_late": float(np.median(late)) if len(late) else 0.0,
            "largest": float(np.max(off, initial=0.0)),
            "other_events": int(np.sum(~same)),
        }


class Sweep:
    """Variants of a manoeuvre, ready for both sides."""

    def __init__(self, case: Manoeuvre, count: int) -> None:
        """Draw the variants."""
        draws = np.random.default_rng(SEED)
        parts = {name: 1 + part * draws.uniform(-1, 1, count) for name, part in PARTS.items()}
        self.values = {name: float(NOMINAL[name]) * part for name, part in parts.items()}
        self.rows = self._rows(case)
        self.planned = CompiledBatch(self._batch(case), load_library)

    def run_ours(self, threads: int) -> Summary:
        """Carry all out by compiled C of ours."""
        found = self.planned.run(threads)
        if found.note != "compiled" or found.stopped:
            raise RuntimeError(f"{found.note}, stopped: {list(found.stopped.values())[:1]}")
        measures = found.statistics
        return Summary(
            measures["w_em"],
            found.event_times[:, 1],
            found.event_counts.astype(float),
            measures["peak"],
        )

    def run_rival(self, threads: int, step: float = STEP) -> Summary:
        """Carry all out by the rival."""
        return Summary(*in_c.run_sweep(self.rows, step, threads).T)

    def _rows(self, case: Manoeuvre) -> Reals:
        cases = [
            Manoeuvre(
                case.name,
                case.torques,
                case.step_ms,
                case.horizon_ms,
                {**case.parameters, **{name: repr(float(v[k])) for name, v in self.values.items()}},
            )
            for k in range(len(self.values["m"]))
        ]
        self.twists = np.array([float(one.start()[2]) for one in cases])
        return np.array([in_c.rival_parameters(one) for one in cases])

    def _batch(self, case: Manoeuvre) -> Batch:
        ready = ours.prepare_run(case, f"{round(1000 * STEP)} ms")
        swept = {f"plant.{name}": values for name, values in self.values.items()}
        measures = (
            SignalStatistic("w_em", "plant.w_em", "final"),
            SignalStatistic("peak", "plant.T_hs", "peak", Fraction(0)),
        )
        return Batch(
            system=ready.system,
            scenario=ready.scenario,
            count=len(self.twists),
            parameters=swept,
            initial={"plant.theta_d": self.twists, "plant.theta_b": self.values["alpha"]},
            statistics=measures,
            max_events=2,
        )
