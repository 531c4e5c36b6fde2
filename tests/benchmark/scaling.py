"""Measures time and memory over the size of a spec, a run or a study; writes docs/growth.md.

Each point runs in a process of its own. Times are processor times; those of studies with several
workers are elapsed times.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from fractions import Fraction
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import EngFormatter, NullLocator

from language.model.system import Stimulus, StimulusPiece
from tests.validation.evidence.evidence_store import ROOT, write_json
from tests.validation.evidence.resource_usage import peak_megabytes

PAGE, PICTURE, JSON = (
    ROOT / "docs" / "growth.md",
    ROOT / "docs" / "growth.png",
    ROOT / "build" / "growth.json",
)
CURVES: Mapping[str, Sequence[int]] = {
    "states": (4, 8, 16, 32, 64),
    "modes": (3, 6, 12, 30, 60),
    "seconds": (1, 10, 100, 1000),
    "variants": (100, 1000, 10_000, 100_000, 1_000_000),
    "workers": (1, 2, 4),
}
ABOUT = {
    "states": "The automaton is a chain of inertias that are connected by springs. It has two "
    "states for each inertia, and three modes. The column *read and checked* contains the time in "
    "which modewright reads, checks and lowers the spec. *Lowering* is the translation of the "
    "checked spec to the internal program from which the C is printed. The column *compiled* "
    "contains the time of the C compiler. The column *run again* contains the time of a "
    "simulation for which the compiled C already exists. This time includes the lowering. The "
    "simulation covers one second, and its major step is 1 ms.",
    "modes": "The automaton has four states. Its modes form a ring: each mode has one transition, "
    "which leads to the next mode. The columns have the same meaning as in the table above.",
    "seconds": "The table gives the processor time of one simulation. The driveline and its "
    "estimator are simulated by compiled C. The estimator has a period of 1 ms, and the "
    "simulation records a row of results every 10 ms. The first column contains the simulated "
    "time.",
    "variants": "One call simulates many variants of the manoeuvre tip-out (a step of the motor "
    "torque from positive to negative) on one core. The variants differ in the values of five "
    "parameters. The major step is 5 ms. The column *carried out* contains the processor time of "
    "the call.",
    "workers": "A [study](studies.md) simulates 20 000 variants of the driveline with its "
    "estimator. Worker processes share the variants. The column *study* contains the elapsed time "
    "of the whole study.",
}
WHY = {
    "states": "The largest stable step of the integration follows from the eigenvalues of each "
    "mode. Modewright computes these eigenvalues with scalar operations in a fixed order and not "
    "with a library of linear algebra, so that the result has the same bits on every machine. The "
    "cost of the eigenvalues is cubic in the number of states. At 64 states they take half of the "
    "time of *run again*. The C has one line for each operation, so the time of *compiled* also "
    "grows with the number of states.",
    "modes": "Each mode has its own equations and its own integration step in the C. No part of "
    "the computation examines every pair of modes. Therefore no time grows with the square of the "
    "number of modes. Below ten modes the start of the compiler takes most of the time of "
    "*compiled*.",
    "seconds": "In each row, lowering the spec and printing the C take about 0.1 s. The memory "
    "contains the recorded rows and the plan of the simulation. The plan lists all instants with "
    "their actions, such as the ticks of the estimator.",
    "variants": "From 1,000 variants on, the time is nearly proportional to the number of "
    "variants. The memory contains the results of all variants of the call. A [study](studies.md) "
    "computes its variants in blocks and writes each block to a file. Its memory therefore does "
    "not depend on the number of variants.",
    "workers": "Before its first block of variants, each worker starts Python and loads the study "
    "and the compiled C. This takes more than a second of processor time for each worker. With "
    "more workers than cores the study therefore takes longer.",
}
"""Reasons for the measured exponents, found with a profiler; check them with new figures."""
STUDY_VARIANTS = 20_000
SHORT = EngFormatter(sep="")
GENTLE = Fraction(5)
"""A torque [N*m] with which no speed leaves its range, however long it acts."""


@dataclass(frozen=True)
class Point:
    """A size with times [s] by what takes them, and the largest memory [MB]."""

    size: int
    seconds: Mapping[str, float]
    megabytes: float


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure all curves, or one point; write the page."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--point", nargs=2, metavar=("CURVE", "SIZE"), help=argparse.SUPPRESS)
    parser.add_argument("--most", type=int, help="leave out larger sizes, write no page")
    given = parser.parse_args(arguments)
    if given.point:
        curve, size = given.point
        print(json.dumps(asdict(_here(curve, int(size)))))
        return 0
    found = {
        curve: [_measured(curve, size) for size in sizes if size <= (given.most or size)]
        for curve, sizes in CURVES.items()
    }
    if given.most is None:
        write_json(JSON, {name: [asdict(one) for one in points] for name, points in found.items()})
        PAGE.write_text(page(found), encoding="utf-8")
        picture(found).savefig(PICTURE, dpi=110, metadata={"Software": None})
    return 0


def _measured(curve: str, size: int) -> Point:
    command = [sys.executable, "-m", "tests.benchmark.scaling", "--point", curve, str(size)]
    done = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True)
    found = json.loads(done.stdout.splitlines()[-1])
    point = Point(found["size"], found["seconds"], found["megabytes"])
    told = ", ".join(f"{name} {value:.3g} s" for name, value in point.seconds.items())
    print(f"{curve} {size}: {told}, {point.megabytes:.0f} MB", flush=True)
    return point


def _here(curve: str, size: int) -> Point:
    """Measure a point in this process."""
    with tempfile.TemporaryDirectory() as name:
        seconds = MEASURES[curve](size, Path(name))
    return Point(size, seconds, peak_megabytes())


def _spec(states: int, modes: int) -> str:
    """Return a chain of inertias whose first spring differs by mode, and modes in a ring."""
    count = states // 2
    lines = ["language: 1", "automaton: growing", "step: 1 ms"]
    lines += [
        "parameters: {J: {value: 0.1 kg*m^2}, k: {value: 90 N*m/rad}, c: {value: 0.05 N*m*s/rad}}"
    ]
    lines += ["states:"]
    for i in range(count):
        lines += [f"  a_{i}: {{unit: rad, initial: {0.1 if i == 0 else 0} rad}}"]
        lines += [f"  w_{i}: {{unit: rad/s, initial: 0 rad/s}}"]
    lines += ["flow:"]
    for i in range(count):
        left = f"c * (w_{i} - w_{i - 1}) + k * (a_{i} - a_{i - 1})" if i else "T_0"
        right = f"k * (a_{i} - a_{i + 1})" if i + 1 < count else f"k * a_{i}"
        lines += [f"  a_{i}: der(a_{i}) = w_{i}", f"  w_{i}: J * der(w_{i}) = -({left}) - {right}"]
    lines += ["initial: m_0", "modes:"]
    for m in range(modes):
        guard = "a_0 < 0 rad and w_0 < 0 rad/s" if m % 2 == 0 else "a_0 > 0 rad and w_0 > 0 rad/s"
        lines += [f"  m_{m}:", f"    equations: {{T_0: k * {0.01 * m:.2f} * a_0 + c * w_0}}"]
        lines += [f"    transitions: {{m_{(m + 1) % modes}: {{when: {guard}}}}}"]
    return "\n".join([*lines, "outputs: [a_0, w_0, mode]", ""])


def _grown(states: int, modes: int, folder: Path) -> dict[str, float]:
    """Read, check and lower, compile and run a spec of a size; return each's processor time."""
    from modewright.api.simulation import load
    from modewright.runtime.back_end_choice import run_in_c

    os.environ["MODEWRIGHT_CACHE"] = str(folder / "cache")
    (folder / "spec").mkdir()
    (folder / "spec" / "growing.yaml").write_text(_spec(states, modes))
    (folder / "spec" / "second.yaml").write_text(
        "language: 1\nscenario: second\nof: growing\nhorizon: 1 s\nrecord: {every: 10 ms}\n"
    )
    begin = _used()
    loaded = load("growing", "second", root=folder)
    read = _used() - begin
    run_in_c(loaded.system, loaded.scenario)
    first = _used() - begin - read
    begin = _used()
    for _ in range(5):
        run_in_c(loaded.system, loaded.scenario)
    again = (_used() - begin) / 5
    return {"read and checked": read, "compiled": first - again, "run again": again}


def _lasting(seconds: int, folder: Path) -> dict[str, float]:
    import dataclasses

    from modewright.api.simulation import load
    from modewright.runtime.back_end_choice import run_in_c

    loaded = load("ev_driveline_ideal", "tip_out", root=ROOT)
    gentle = {"T_req": Stimulus((StimulusPiece(Fraction(0), GENTLE),))}
    every = dataclasses.replace(loaded.scenario, every=Fraction(1, 100), inputs=gentle)
    run_in_c(loaded.system, dataclasses.replace(every, horizon=Fraction(1, 10)))
    begin = _used()
    run_in_c(loaded.system, dataclasses.replace(every, horizon=Fraction(seconds)))
    return {"run": _used() - begin}


def _variants(count: int, folder: Path) -> dict[str, float]:
    from tests.benchmark.manoeuvre import TIP_OUT
    from tests.benchmark.variants import Sweep

    Sweep(TIP_OUT, 8).run_ours(1)
    sweep = Sweep(TIP_OUT, count)
    begin = _used()
    sweep.run_ours(1)
    return {"carried out": _used() - begin}


def _working(workers: int, folder: Path) -> dict[str, float]:
    import modewright as mw
    from tests.validation.evidence.cluster import STUDY

    (folder / "study.yaml").write_text(STUDY.format(count=STUDY_VARIANTS))
    mw.sweep(str(folder / "study.yaml"), folder / "warm", root=ROOT, samples=100, workers=1)
    begin = time.perf_counter()
    mw.sweep(str(folder / "study.yaml"), folder / "out", root=ROOT, workers=workers)
    return {"study": time.perf_counter() - begin}


MEASURES = {
    "states": lambda size, folder: _grown(size, 3, folder),
    "modes": lambda size, folder: _grown(4, size, folder),
    "seconds": _lasting,
    "variants": _variants,
    "workers": _working,
}


def _used() -> float:
    """Return the processor time of this process and of those that it started and that ended [s]."""
    return sum(
        used.ru_utime + used.ru_stime
        for used in map(resource.getrusage, (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    )


def exponent(points: Sequence[Point], what: str) -> float:
    """Return the power of the size that a time grows with, between the last two points."""
    (a, b) = points[-2:]
    return float(np.log(b.seconds[what] / a.seconds[what]) / np.log(b.size / a.size))


def page(found: Mapping[str, Sequence[Point]]) -> str:
    """Return the page: a table for each curve."""
    lines = [
        "# Scaling",
        "",
        "This page shows how time and memory grow with the size of a spec, of a simulation and of "
        "a study. [The glossary](glossary.md) explains the terms.",
        'The command `make bench ARGS="--growth"` measures the figures. It measures each row of a '
        "table in a separate process. The times are processor times, except in the table of "
        "workers. The column *memory* contains the largest memory of the process of the row.",
        f"The machine has {os.cpu_count()} cores. Other load on the machine changes the figures.",
        "",
        "![Time and memory over the size](growth.png)",
    ]
    for name, points in found.items():
        parts = list(points[0].seconds)
        lines += ["", f"**Number of {name}.** {ABOUT[name]}", ""]
        lines += [f"| {name} | " + " | ".join(f"{part} [s]" for part in parts) + " | memory [MB] |"]
        lines += ["|---" * (len(parts) + 2) + "|"]
        for one in points:
            cells = [f"{one.size:,}", *(f"{one.seconds[part]:.3g}" for part in parts)]
            lines += ["| " + " | ".join([*cells, f"{one.megabytes:.0f}"]) + " |"]
        powers = [f"{exponent(points, part):.1f} for *{part}*" for part in parts]
        lines += [
            "",
            "Between the last two rows, each time grows in proportion to a power of the number "
            f"of {name}. The exponent of this power is {', '.join(powers)}. {WHY[name]}",
        ]
    return "\n".join(lines) + "\n"


def picture(found: Mapping[str, Sequence[Point]]) -> Figure:
    """Draw times and memory over size, both axes logarithmic: a slope of one is linear."""
    figure = Figure(figsize=(2.9 * len(found), 5.0), layout="constrained")
    axes = figure.subplots(2, len(found), sharex="col")
    for column, (name, points) in enumerate(found.items()):
        upper, lower = axes[0][column], axes[1][column]
        sizes = np.array([one.size for one in points], dtype=float)
        for part in points[0].seconds:
            upper.loglog(sizes, [one.seconds[part] for one in points], "o-", ms=4, lw=1, label=part)
        first = max(points[0].seconds.values())
        power = -1 if name == "workers" else 1
        upper.loglog(sizes, first * (sizes / sizes[0]) ** power, ":", color="#999", lw=1.0)
        memory = [one.megabytes for one in points]
        lower.semilogx(sizes, memory, "s-", ms=4, color="#444a52", lw=1.0)
        lower.set_ylim(0, 1.1 * max(memory))
        lower.set_xlabel("simulated seconds" if name == "seconds" else name)
        lower.set_xticks(sizes, [SHORT.format_data(size) for size in sizes])
        lower.xaxis.set_minor_locator(NullLocator())
        upper.legend(fontsize=7)
        for each in (upper, lower):
            each.grid(alpha=0.25)
    axes[0][0].set_ylabel("time [s]; dotted: linear")
    axes[1][0].set_ylabel("memory [MB]")
    return figure


if __name__ == "__main__":
    sys.exit(main())
