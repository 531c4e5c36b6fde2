"""Options: arguments that several commands share, and their validation."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from language.text.diagnostic import DataError
from modewright.cli.common.exit_codes import PROBLEMS
from modewright.runtime.output_files import OutputError, require_calibration_output

if TYPE_CHECKING:
    from engine.results.trajectory import Trajectory

System = Annotated[str, typer.Argument(help="a system or automaton: name or file")]
Scenario = Annotated[str, typer.Option("--scenario", "-s", help="a scenario: name or file")]
Sets = Annotated[
    list[str] | None,
    typer.Option("--set", help="a parameter value: 'k_hs=6000 N*m/rad', 'est.t_wait=2 ms'"),
]
Calibrations = Annotated[
    list[str] | None,
    typer.Option("--calibration", "-c", help="a calibration: name or file (repeatable)"),
]
Out = Annotated[
    Path | None,
    typer.Option(
        "--out", "--output", "-o", help="write the run: .csv (with a side file), .parquet or .mf4"
    ),
]
Plot = Annotated[
    Path | None, typer.Option("--plot", "-p", help="write a figure: .png, .svg or .pdf")
]
Signals = Annotated[
    list[str] | None, typer.Option(help="only signals that match: 'plant.*' (repeatable)")
]
From = Annotated[float | None, typer.Option("--from", help="start of the window [s]")]
To = Annotated[float | None, typer.Option("--to", help="end of the window [s]")]
Numbers = Annotated[
    Literal["float64", "float32"] | None,
    typer.Option(help="number type, instead of that of the automata"),
]
Json = Annotated[bool, typer.Option("--json", help="print the result as JSON")]


def values_of(sets: Sequence[str] | None) -> dict[str, str]:
    """Return the values of --set (`parameter=value`, split at the first `=`) by parameter.

    Blanks around both are removed; the last value of a parameter counts; None gives an empty dict.
    Raises BadParameter for a text without name, `=` or value.
    """
    found = {}
    for text in sets or []:
        name, equals, value = text.partition("=")
        if not equals or not name.strip() or not value.strip():
            raise typer.BadParameter(f"`{text}` is not `parameter=value`", param_hint="--set")
        found[name.strip()] = value.strip()
    return found


def span_of(start: float | None, end: float | None) -> tuple[float, float] | None:
    """Return the time window [s] of --from and --to; None without both.

    A missing end is infinite. Raises BadParameter unless start < end.
    """
    if start is None and end is None:
        return None
    span = (-math.inf if start is None else start, math.inf if end is None else end)
    if not span[0] < span[1]:
        raise typer.BadParameter("the window is empty", param_hint="--from, --to")
    return span


@contextmanager
def usage_errors() -> Iterator[None]:
    """Convert a ValueError in the context to a usage error (exit code 2).

    A DataError passes: the exit code is 1.
    """
    try:
        yield
    except DataError:
        raise
    except ValueError as error:
        raise typer.BadParameter(str(error)) from None


def calibration_name(out: Path | None, name: str | None, date: str) -> str:
    """Return the name of a new calibration: `name`, else the stem of the file `out`, else `fitted`.

    Raises OutputError if `out` does not end in .yaml, is another kind of spec or cannot be written;
    BadParameter for an invalid name and for a non-empty date that is not like `2026-11-21`.
    """
    from language.expressions.name_rules import NAME_PATTERN
    from language.overlays.calibration import DATE

    if out:
        if out.suffix != ".yaml":
            raise OutputError(f"{out}: a calibration ends with .yaml")
        require_calibration_output(out)
    title = name or (out.stem if out else "fitted")
    if not NAME_PATTERN.fullmatch(title):
        raise typer.BadParameter(f"`{title}` is not a name", param_hint="--name")
    if date and not DATE.fullmatch(date):
        raise typer.BadParameter("a date is written as `2026-11-21`", param_hint="--date")
    return title


def require_run_format(path: Path | None) -> None:
    """Raise OutputError for a run file that ends with none of the known suffixes, in any case.

    None is accepted.
    """
    from engine.results.run_file import WRITTEN_FORMATS

    if path and path.suffix.lower() not in WRITTEN_FORMATS:
        raise OutputError(f"{path}: a run ends with .csv, .parquet or .mf4")


def picture_format(path: Path) -> str:
    """Return the format of a figure, `png`, `svg` or `pdf`, by the suffix of its path in any case.

    Raises OutputError for other suffixes.
    """
    from engine.results import picture_format as formats

    try:
        return formats.picture_format(path)
    except ValueError as error:
        raise OutputError(str(error)) from None


def report_run_end(failed: bool, trajectory: Trajectory) -> None:
    """Print latched faults and the reason of a stop to stderr; exit with code PROBLEMS if `failed`.

    A fault has the time and the mode at which it was set first. A compiled run does not record
    them; a help line says so. Faults and a stop alone do not change the exit code.
    """
    for fault in trajectory.faults:
        instant = trajectory.fault_instants.get(fault, "")
        first = f", first at {instant}" if instant else ""
        print(f"warning: a fault bit is set: {fault}{first}", file=sys.stderr)
    if any(fault not in trajectory.fault_instants for fault in trajectory.faults):
        text = "help: with `--interpreted` the time and the mode of a fault are told"
        print(text, file=sys.stderr)
    if trajectory.stopped:
        print(f"error: the run stopped: {trajectory.stopped}", file=sys.stderr)
    if failed:
        raise typer.Exit(PROBLEMS)
