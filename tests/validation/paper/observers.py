"""Observers: what a study says of delays, misses and torque errors, a row for each scheme."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.dataset
from pyarrow import Table
from scipy.stats import chi2

import modewright as mw
from sweep.analysis.confidence_interval import Interval, interval_of_quantile, wilson_interval
from tests.validation.evidence.evidence_store import ROOT

STUDY, CRUISE = "observers", "false_losses"
CRUISE_MINUTES = 28.5 / 60.0
"""What is counted of a cruise: 30 s without its first 1.5 s."""
LOW = 2.0
"""Torque of the half-shafts in the cruise that the issue of chatter is about [N*m]."""
MS = 1e3
SCHEMES = {
    "paper": {10.0: "_simple", 1.0: "_est", 0.1: "_est"},
    "stepped": {10.0: "_est"},
    "better": {10.0: "", 1.0: "", 0.1: ""},
}
"""Endings of the measures of a scheme, by period of its inputs [ms]: at 100 Hz the paper has Fig. 7
at steps of 10 ms; `stepped` is its Fig. 6 at steps of 1 ms between these inputs."""
NOTES = {10.0: 16.35, 1.0: 1.76, 0.1: 0.78}
"""Medians of the paper's scheme [ms], by period [ms], in a reproduction by others: not measured
here, and what ours are held against."""


@dataclass(frozen=True)
class Row:
    """One scheme at one rate of inputs: the first gap of each manoeuvre, all gaps, the torque.

    Delays [ms] of the gaps that were `reported`, signed unless they say so; `torque` is the root
    mean square over all manoeuvres from 0.1 s on [N*m]; `cruise_losses` false losses at 2 N*m in
    `cruise_minutes`, which are 0 where no cruise was run.
    """

    scheme: str
    period: float
    is_matched: bool
    count: int
    reported: int
    median: float
    median_interval: Interval
    p5: float
    p95: float
    absolute_median: float
    absolute_p95: float
    missed_first: int
    missed_interval: Interval
    missed: int
    gaps: int
    false: int
    torque: float
    cruise_losses: int
    cruise_minutes: float
    faults: int

    @property
    def rate(self) -> str:
        """The rate of the inputs [Hz]."""
        return f"{1e3 / self.period:.0f}"

    @property
    def cruise(self) -> float:
        """False losses in a minute, NaN where no cruise was run."""
        return self.cruise_losses / self.cruise_minutes if self.cruise_minutes else float("nan")

    @property
    def most_cruise(self) -> float:
        """The upper end of the 95 % interval of false losses in a minute (Poisson)."""
        most = float(chi2.ppf(0.975, 2 * (self.cruise_losses + 1))) / 2.0
        return most / self.cruise_minutes if self.cruise_minutes else float("nan")


def run_studies(folder: Path, seed: int | None, samples: int | None) -> list[Row]:
    """Run both studies, or go on with them, and return the rows."""
    mw.sweep(STUDY, folder / STUDY, root=ROOT, block=100, seed=seed, samples=samples)
    mw.sweep(CRUISE, folder / CRUISE, root=ROOT, block=4)
    table, cruise = (_table(folder / name) for name in (STUDY, CRUISE))
    return [
        _row(table, cruise, scheme, period, is_matched)
        for is_matched in (True, False)
        for scheme, periods in SCHEMES.items()
        for period in periods
    ]


def _table(folder: Path) -> Table:
    return pyarrow.dataset.dataset(folder / "blocks").to_table()


def _row(table: Table, cruise: Table, scheme: str, period: float, is_matched: bool) -> Row:
    own = _columns(table, period)
    here = own["wrong"] == (0.0 if is_matched else 1.0)
    ending, good = SCHEMES[scheme][period], own["status"] == "done"
    one = {name: values[here & good] for name, values in own.items()}
    first = one[f"gaps{ending}.first"].astype(float) * MS
    first = first[np.isfinite(first)]
    missed_first = int(one[f"gaps{ending}.first_missed"].sum())
    count = int(good[here].sum())
    losses, minutes = _cruised(cruise, ending, period) if is_matched else (0, 0.0)
    return Row(
        scheme=scheme,
        period=period,
        is_matched=is_matched,
        count=count,
        reported=len(first),
        median=float(np.median(first)),
        median_interval=interval_of_quantile(first, np.arange(len(first)), 0.5, 0.95),
        p5=float(np.percentile(first, 5)),
        p95=float(np.percentile(first, 95)),
        absolute_median=float(np.median(np.abs(first))),
        absolute_p95=float(np.percentile(np.abs(first), 95)),
        missed_first=missed_first,
        missed_interval=wilson_interval(missed_first, count, 0.95),
        missed=int(one[f"gaps{ending}.missed"].sum()),
        gaps=int(one[f"gaps{ending}.truths"].sum()),
        false=int(one[f"gaps{ending}.false_events"].sum()),
        torque=float(np.sqrt(np.mean(one[f"error_T{ending}"].astype(float) ** 2))),
        cruise_losses=losses,
        cruise_minutes=minutes,
        faults=int((~good[here]).sum()),
    )


def _cruised(cruise: Table, ending: str, period: float) -> tuple[int, float]:
    """Return the false losses in cruises at the low torque, and how many minutes these are."""
    one = _columns(cruise, period)
    low = np.isclose(one["driver.T_aim"].astype(float), LOW) & (one["status"] == "done")
    return int(one[f"losses{ending}"][low].sum()), float(low.sum() * CRUISE_MINUTES)


def _columns(table: Table, period: float) -> dict[str, Any]:
    found = {name: table[name].to_numpy(zero_copy_only=False) for name in table.column_names}
    here = np.isclose(found["T_s"].astype(float) * MS, period)
    return {name: values[here] for name, values in found.items()}


def better_observer(rows: list[Row], is_matched: bool = True) -> Mapping[str, Mapping[str, float]]:
    """Return the figures of the better observer as JSON, by rate of the inputs [Hz]."""
    return {
        row.rate: {
            "median_ms": row.median,
            "p95_ms": row.p95,
            "absolute_median_ms": row.absolute_median,
            "absolute_p95_ms": row.absolute_p95,
            "manoeuvres": row.count,
            "missed_first": row.missed_first,
            "false": row.false,
            **({"cruise_false_per_min": row.cruise} if is_matched else {}),
            "torque_rms_Nm": row.torque,
        }
        for row in rows
        if row.scheme == "better" and row.is_matched == is_matched
    }
