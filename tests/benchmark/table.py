"""Showing: ratios and errors as they stand in build/bench.json, and as lines of the table."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from tests.benchmark.manoeuvre import Manoeuvre
from tests.benchmark.reference_solution import Solution, accuracy, reference_solution
from tests.benchmark.timing import Ratio

Figure = dict[str, Any]


def errors_of(case: Manoeuvre, found: Solution) -> Figure:
    """Return the errors of a solution, by name."""
    return asdict(accuracy(found, reference_solution(case)))


def format_ratio(ratio: Ratio, name: str, other: str) -> Figure:
    """Return a ratio as it stands in build/bench.json: quartiles, and both times [ms]."""
    return {
        "median": ratio.median,
        "low": ratio.low,
        "high": ratio.high,
        "pairs": ratio.pairs,
        f"{name}_ms": 1000 * ratio.seconds,
        f"{other}_ms": 1000 * ratio.seconds_other,
    }


def table(found: Figure) -> list[str]:
    """Return the figures as lines."""
    where = found["machine"]
    lines = [
        f"{where['processor']}, {where['cores']} cores, load {where['load'][0]}",
        f"{where['compiler']}; {where['flags']}",
        f"Python {where['python']}, numpy {where['numpy']}, scipy {where['scipy']}",
        "",
        "processor time relative to the peer (sweep, chart: rates): median (quartiles)",
    ]
    for group in ("single_run", "sweep"):
        for name, figure in found.get(group, {}).items():
            lines.append(f"  {group + '.' + name:36} {_ratio(figure)}")
    lines += [_chart(name, figure) for name, figure in found["chart"].items()]
    for name, figure in found["rivals"].items():
        said = figure.get("missing") or f"{_ratio(figure)}, first run {figure['first_run_s']:.1f} s"
        lines.append(f"  {name + ' over scipy':36} {said}")
    for name, figure in found["sweep"].items():
        rates = (f"{figure[side + '_variants_per_s']:,.0f}" for side in ("batch", "c"))
        lines.append(
            f"  {name}: {figure['variants']} variants, {' and '.join(rates)} per second and core"
        )
        for who, errors in figure["errors"].items():
            late = f"{1e6 * errors['median_late']:.2f}, {1e6 * errors['late']:.0f} us"
            lines.append(f"    {who:6} first contact late: median, largest {late}")
    first = found["first_step"]
    took = f"{first['total_s']:.2f} s, {first['compiler_s']:.2f} s in the compiler"
    lines.append(f"  from the specs to the end of a first compiled run, empty cache: {took}")
    lines += ["", "errors: events late [us], w_em over its peak (root mean square, largest)"]
    for name, figure in found["single_run"].items():
        for who, errors in figure.get("errors", {}).items():
            lines.append(f"  {name:24} {who:14} {_errors(errors)}")
    for name, figure in found["rivals"].items():
        if "errors" in figure:
            lines.append(f"  {'at the end only':24} {name:14} {_errors(figure['errors'])}")
    for step, cases in found["accuracy"].items():
        for case, sides in cases.items():
            for who, errors in sides.items():
                lines.append(f"  {case + ' at ' + step:24} {who:14} {_errors(errors)}")
    return lines


def _chart(name: str, figure: Figure) -> str:
    own = next(key for key in figure if key.endswith("_ticks_per_s"))
    spread = f"{figure['median']:.3g} ({figure['low']:.3g} .. {figure['high']:.3g})"
    rates = f"{figure[own]:,.0f} and {figure['rival_ticks_per_s']:,.0f} ticks per second"
    return f"  {'chart.' + name:36} {spread:24} {rates}, {figure['pairs']} pairs"


def _ratio(figure: Figure) -> str:
    spread = f"{figure['median']:.3g} ({figure['low']:.3g} .. {figure['high']:.3g})"
    times = ", ".join(f"{k[:-3]} {v:.4g} ms" for k, v in figure.items() if k.endswith("_ms"))
    return f"{spread:24} {times}, {figure['pairs']} pairs"


def _errors(errors: Figure) -> str:
    whole = "all, in order" if errors["is_complete"] else "NOT AS THEY ARE"
    sizes = f"{errors['rms']:.1e} {errors['largest']:.1e}"
    return f"{1e6 * errors['late']:10.3f} us  {sizes}  {errors['events']} events {whole}"
