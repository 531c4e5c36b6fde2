"""Figures: what `make bench` measures - ratios of processor time, and the errors beside them."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from tests.bench import in_c, ours, with_scipy
from tests.bench.manoeuvre import CHATTER, TIP_OUT, Manoeuvre
from tests.bench.timing import Ratio, interleaved
from tests.bench.truth import Solution, accuracy, truth

Figure = dict[str, Any]
STEPS = ("5 ms", "2 ms", "1 ms")
"""Steps at which errors are shown."""
INTERPRETER_STEP, INTERPRETER_ROWS = "2.5 ms", "10 ms"
"""At this step the largest error of w_em is below 1e-6 of its peak, at 4 ms its mean already is.
Rows are as far apart as the steps of scipy at most."""


def interpreter_over_scipy(pairs: int) -> Figure:
    """The interpreter against RK45 of scipy: rtol 1e-6, steps of at most 10 ms, events on."""
    case = ours.ready(TIP_OUT, INTERPRETER_STEP, INTERPRETER_ROWS)
    ratio = interleaved(case.interpreted, lambda: with_scipy.run(TIP_OUT), pairs)
    errors = {
        "interpreter": errors_of(TIP_OUT, ours.solution(case.interpreted())),
        "scipy": errors_of(TIP_OUT, with_scipy.solution(TIP_OUT)),
    }
    return {**shown(ratio, "interpreter", "scipy"), "step": INTERPRETER_STEP, "errors": errors}


def errors_at(step: str) -> Figure:
    """The errors at a step: of a tip-out, and of many crossings in a row."""
    found = {}
    for case in (TIP_OUT, CHATTER):
        own = ours.solution(ours.ready(case, step).interpreted())
        rival = in_c.InC(case, float(step.partition(" ")[0]) / 1000).solution()
        found[case.name] = {"modewright": errors_of(case, own), "c": errors_of(case, rival)}
    return found


def errors_of(case: Manoeuvre, found: Solution) -> Figure:
    """Return the errors of a solution, by name."""
    return asdict(accuracy(found, truth(case)))


def shown(ratio: Ratio, name: str, other: str) -> Figure:
    """Return a ratio as it stands in build/bench.json: quartiles, and both times [ms]."""
    return {
        "median": ratio.median,
        "low": ratio.low,
        "high": ratio.high,
        "pairs": ratio.pairs,
        f"{name}_ms": 1000 * ratio.seconds,
        f"{other}_ms": 1000 * ratio.seconds_other,
    }
