"""Charts: how fast a flat chart with a wait is ticked, beside C by hand and machines of Python."""

from __future__ import annotations

import importlib
from typing import Any

from tests.benchmark.chart_runs import (
    TICKS,
    TICKS_IN_C,
    Run,
    chart_inputs,
    make_compiled_runs,
    make_interpreter_run,
)
from tests.benchmark.table import format_ratio
from tests.benchmark.timing import Ratio, time_interleaved

Figure = dict[str, Any]
MACHINES = {
    "transitions": "with_transitions",
    "python-statemachine": "with_statemachine",
    "sismic": "with_sismic",
}
"""Packages with charts, and the modules that run them."""
SHARE = 20
"""What part of the ticks the machines run: they are slower."""


class OtherTransitions(Exception):
    """Two sides made different transitions: nothing to compare."""


def measure_charts(pairs: int) -> Figure:
    """Return the figures of the chart: ticks per second of ours over those of others."""
    found = {
        f"interpreter_over_{name}": _over_machine(module, name, pairs)
        for name, module in MACHINES.items()
    }
    fastest = min(found, key=lambda name: found[name]["median"])
    return {
        "interpreter_over_fastest": {**found[fastest], "fastest": fastest.rpartition("_")[2]},
        **found,
        "generated_over_c": _over_c(pairs, ranges=False),
        "generated_with_ranges_over_c": _over_c(pairs, ranges=True),
        "generated_over_c_both_with_ranges": _over_c(pairs, ranges=True, held=True),
    }


def _over_machine(module: str, name: str, pairs: int) -> Figure:
    ticks = TICKS // SHARE
    rival: Run = importlib.import_module(f"tests.benchmark.competitor_scripts.{module}").prepared(
        chart_inputs(ticks).pairs()
    )
    ours = make_interpreter_run(ticks)
    _same(name, ours(), rival())
    return _rated(time_interleaved(rival, ours, pairs), name, "interpreter", ticks)


def _over_c(pairs: int, ranges: bool, held: bool = False) -> Figure:
    generated, by_hand = make_compiled_runs(TICKS_IN_C, ranges, held)
    _same("C", generated(), by_hand())
    return _rated(time_interleaved(by_hand, generated, pairs), "c", "generated", TICKS_IN_C)


def _same(name: str, own: int, other: int) -> None:
    if own != other or not own:
        raise OtherTransitions(f"{own} transitions of ours, {other} of {name}")


def _rated(ratio: Ratio, rival: str, own: str, ticks: int) -> Figure:
    """Return the rival's time over ours, which is our ticks per second over its."""
    rates = {
        f"{own}_ticks_per_s": ticks / ratio.seconds_other,
        "rival_ticks_per_s": ticks / ratio.seconds,
    }
    return {**format_ratio(ratio, rival, own), **rates, "ticks": ticks}
