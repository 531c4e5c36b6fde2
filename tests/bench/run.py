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

from codegen.build import FLAGS, compiler_version
from tests.bench import figures

ROOT = Path(__file__).resolve().parent.parent.parent
RESULT = ROOT / "build" / "bench.json"
PAIRS = 15
"""Fewest pairs of which a figure counts."""


def main(arguments: list[str] | None = None) -> int:
    """Measure, show and keep the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--pairs", type=int, default=PAIRS, help="of each ratio")
    parser.add_argument("--out", type=Path, default=RESULT)
    given = parser.parse_args(arguments)
    found = {
        "machine": machine(),
        "single_run": {"interpreter_over_scipy": figures.interpreter_over_scipy(given.pairs)},
        "accuracy": {step: figures.errors_at(step) for step in figures.STEPS},
    }
    given.out.parent.mkdir(parents=True, exist_ok=True)
    given.out.write_text(json.dumps(found, indent=1) + "\n")
    print("\n".join(table(found)))
    return 0


def machine() -> dict[str, Any]:
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


def table(found: dict[str, Any]) -> list[str]:
    """Return the figures as lines."""
    where = found["machine"]
    lines = [
        f"{where['processor']}, {where['cores']} cores, load {where['load'][0]}",
        f"{where['compiler']}; {where['flags']}",
        f"Python {where['python']}, numpy {where['numpy']}, scipy {where['scipy']}",
        "",
        "processor time over the rival's: median of pairs (quartiles)",
    ]
    for group in ("single_run", "sweep"):
        for name, figure in found.get(group, {}).items():
            spread = f"{figure['median']:.3g} ({figure['low']:.3g} .. {figure['high']:.3g})"
            times = ", ".join(f"{k} {v:.4g}" for k, v in figure.items() if k.endswith("_ms"))
            lines.append(f"  {group}.{name:24} {spread:26} {times}, {figure['pairs']} pairs")
    lines += ["", "errors: events late [us], w_em over its peak (root mean square, largest)"]
    for name, figure in found["single_run"].items():
        for who, errors in figure.get("errors", {}).items():
            lines.append(f"  {name:24} {who:12} {_errors(errors)}")
    for step, cases in found["accuracy"].items():
        for case, sides in cases.items():
            for who, errors in sides.items():
                lines.append(f"  {case:12} at {step:8} {who:12} {_errors(errors)}")
    return lines


def _errors(errors: dict[str, Any]) -> str:
    whole = "all, in order" if errors["is_complete"] else "NOT AS THEY ARE"
    sizes = f"{errors['rms']:.1e} {errors['largest']:.1e}"
    return f"{1e6 * errors['late']:10.3f} us  {sizes}  {errors['events']} events {whole}"


def _processor() -> str:
    path = Path("/proc/cpuinfo")
    lines = path.read_text().splitlines() if path.exists() else []
    named = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return named[0] if named else platform.processor()


if __name__ == "__main__":
    sys.exit(main())
