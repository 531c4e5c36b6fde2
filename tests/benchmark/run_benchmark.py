"""Run: the benchmark - a table on the console and build/bench.json (docs/benchmark.md)."""

from __future__ import annotations

import argparse
import json
import os
import platform
import sys
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from codegen.toolchain.compiler import FLAGS, compiler_version
from tests.benchmark import performance_ratios as figures, scaling as growth
from tests.benchmark.chart_speed import measure_charts
from tests.benchmark.cold_start import measure_first_step
from tests.benchmark.competitors import RIVALS, RivalMissing, measure_rival
from tests.benchmark.manoeuvre import CHATTER, TIP_OUT
from tests.benchmark.table import table

ROOT = Path(__file__).resolve().parent.parent.parent
RESULT = ROOT / "build" / "bench.json"
PAGE = ROOT / "docs" / "benchmark.md"
FIGURES = "\n## Figures\n"
PAIRS = 15
"""Fewest pairs of which a figure counts."""


def main(arguments: list[str] | None = None) -> int:
    """Measure, show and keep the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--pairs", type=int, default=PAIRS, help="of each ratio")
    parser.add_argument("--peers", default="", help=f"some of {', '.join(RIVALS)}")
    parser.add_argument("--page", action="store_true", help=f"write the table into {PAGE.name}")
    parser.add_argument(
        "--growth", action="store_true", help="time and memory over size instead: docs/growth.md"
    )
    parser.add_argument("--out", type=Path, default=RESULT)
    given = parser.parse_args(arguments)
    if given.growth:
        return growth.main([])
    peers = [name for name in given.peers.split(",") if name]
    for name in peers:
        if name not in RIVALS:
            parser.error(f"`{name}` is none of {', '.join(RIVALS)}")
    cases = (TIP_OUT, CHATTER)
    found: dict[str, Any] = {
        "machine": machine_info(),
        "single_run": single_run(given.pairs),
        "chart": measure_charts(given.pairs),
        "first_step": measure_first_step(),
        "sweep": {"batch_over_c": figures.batch_over_c(given.pairs)},
        "accuracy": {
            step: {case.name: figures.errors_at(step, case) for case in cases}
            for step in figures.STEPS
        },
    }
    found["rivals"] = {name: rival_figure(name, given.pairs) for name in peers}
    given.out.parent.mkdir(parents=True, exist_ok=True)
    given.out.write_text(json.dumps(found, indent=1) + "\n")
    lines = table(found)
    print("\n".join(lines))
    if given.page:
        PAGE.write_text(insert_figures(PAGE.read_text(), lines))
    return 0


def insert_figures(page: str, lines: list[str]) -> str:
    """Return a page whose last part are the figures."""
    head, mark, _ = page.partition(FIGURES)
    if not mark:
        raise ValueError(f"no line {FIGURES.strip()!r} in the page")
    return "\n".join([head + FIGURES, "```text", *lines, "```", ""])


def single_run(pairs: int) -> dict[str, Any]:
    """Return the figures of one run; those of compiled C at the longer step stand first."""
    found = {}
    for number, step in enumerate(figures.COMPILED_STEPS):
        at = f"_at_{step.replace(' ', '_')}" if number else ""
        found[f"compiled_over_c{at}"] = figures.compiled_over_c(pairs, step)
    return {**found, "interpreter_over_scipy": figures.interpreter_over_scipy(pairs)}


def rival_figure(name: str, pairs: int) -> dict[str, Any]:
    """Return the figure of a tool in an environment of its own, or why there is none."""
    try:
        return measure_rival(name, pairs)
    except RivalMissing as missing:
        return {"missing": str(missing)}


def machine_info() -> dict[str, Any]:
    """Return where and with what the figures were measured."""
    return {
        "processor": _processor(),
        "cores": os.cpu_count(),
        "load": [round(load, 2) for load in os.getloadavg()],
        "system": f"{platform.system()} {platform.release()}",
        "compiler": compiler_version(),
        "flags": " ".join(FLAGS),
        "python": platform.python_version(),
        "numpy": np.__version__,
        "scipy": version("scipy"),
    }


def _processor() -> str:
    path = Path("/proc/cpuinfo")
    lines = path.read_text().splitlines() if path.exists() else []
    named = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return named[0] if named else platform.processor()


if __name__ == "__main__":
    sys.exit(main())
