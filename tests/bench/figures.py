"""Figures: what `make bench` measures - ratios of processor time, and the errors beside them."""

from __future__ import annotations

from typing import Any

from tests.bench import in_c, ours, with_scipy
from tests.bench.manoeuvre import CHATTER as CHATTER, TIP_OUT as TIP_OUT, Manoeuvre
from tests.bench.showing import errors_of, shown
from tests.bench.timing import interleaved

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


def errors_at(step: str, case: Manoeuvre) -> Figure:
    """The errors of a manoeuvre at a step: ours, and those of the rival in C."""
    own = ours.solution(ours.ready(case, step).interpreted())
    rival = in_c.InC(case, float(step.partition(" ")[0]) / 1000).solution()
    return {"modewright": errors_of(case, own), "c": errors_of(case, rival)}
