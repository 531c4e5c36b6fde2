"""Figures: what `make bench` measures - ratios of processor time, and the errors beside them."""

from __future__ import annotations

import os
from typing import Any

from tests.benchmark import hand_written_c as in_c, modewright_run as ours
from tests.benchmark.competitor_scripts import with_scipy
from tests.benchmark.manoeuvre import TIP_OUT, Manoeuvre
from tests.benchmark.table import errors_of, format_ratio
from tests.benchmark.timing import time_interleaved
from tests.benchmark.variants import FINE, Sweep

Figure = dict[str, Any]
STEPS = ("5 ms", "2 ms", "1 ms")
"""Steps at which errors are shown."""
INTERPRETER_STEP, INTERPRETER_ROWS = "2.5 ms", "10 ms"
"""At this step the largest error of w_em is below 1e-6 of its peak, at 4 ms its mean already is.
Rows are as far apart as the steps of scipy at most."""

COMPILED_STEPS = ("5 ms", "2 ms")
VARIANTS = 10_000
"""Of the sweep."""


def interpreter_over_scipy(pairs: int) -> Figure:
    """The interpreter against RK45 of scipy: rtol 1e-6, steps of at most 10 ms, events on."""
    case = ours.prepare_run(TIP_OUT, INTERPRETER_STEP, INTERPRETER_ROWS)
    ratio = time_interleaved(case.interpreted, lambda: with_scipy.run(TIP_OUT), pairs)
    errors = {
        "interpreter": errors_of(TIP_OUT, ours.solution(case.interpreted())),
        "scipy": errors_of(TIP_OUT, with_scipy.solution(TIP_OUT)),
    }
    return {
        **format_ratio(ratio, "interpreter", "scipy"),
        "step": INTERPRETER_STEP,
        "errors": errors,
    }


def compiled_over_c(pairs: int, step: str) -> Figure:
    """A run in our C against the rival at the same step: w_em at each millisecond, every event."""
    run = ours.prepare_run(TIP_OUT, step, "1 ms").compiled()
    rival = in_c.CompiledRival(TIP_OUT, _seconds(step))
    ratio = time_interleaved(run.run, rival.run, pairs)
    found = run.trajectory()
    assert found is not None
    errors = {
        "compiled": errors_of(TIP_OUT, ours.solution(found)),
        "c": errors_of(TIP_OUT, rival.solution()),
    }
    return {**format_ratio(ratio, "compiled", "c"), "step": step, "errors": errors}


def batch_over_c(pairs: int) -> Figure:
    """Variants per second of our C over the rival's loop, both on all cores."""
    sweep = Sweep(TIP_OUT, VARIANTS)
    threads = os.cpu_count() or 1
    ratio = time_interleaved(
        lambda: sweep.run_rival(threads), lambda: sweep.run_ours(threads), pairs
    )
    fine = sweep.run_rival(threads, FINE)
    errors = {
        "batch": sweep.run_ours(threads).errors(fine),
        "c": sweep.run_rival(threads).errors(fine),
    }
    rates = {
        "batch_variants_per_s": VARIANTS / ratio.seconds_other,
        "c_variants_per_s": VARIANTS / ratio.seconds,
    }
    return {**format_ratio(ratio, "c", "batch"), **rates, "variants": VARIANTS, "errors": errors}


def errors_at(step: str, case: Manoeuvre) -> Figure:
    """The errors of a manoeuvre at a step: ours, and those of the rival in C."""
    own = ours.solution(ours.prepare_run(case, step).interpreted())
    rival = in_c.CompiledRival(case, _seconds(step)).solution()
    return {"modewright": errors_of(case, own), "c": errors_of(case, rival)}


def _seconds(step: str) -> float:
    return float(step.partition(" ")[0]) / 1000
