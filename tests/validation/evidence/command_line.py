"""Verify the command line: how quick --help is, what a kept program saves; one line per figure.

Times are those of the processor. The two commands of a ratio take turns, and the median of
the pairs' ratios counts: a machine whose speed changes on the way changes both.
"""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT))

from tests.validation.evidence.resource_usage import seconds_of  # noqa: E402

HELP_AGAINST_TYPER = 2.0
"""`modewright --help` against an empty typer application's: what we import ourselves, with room."""
EMPTY = """
import typer
app = typer.Typer(rich_markup_mode=None)
app.command()(lambda: None)
app(["--help"])
"""
HELP_SECONDS = 0.5
PAIRS = 15


def main() -> int:
    """Print every figure; return 0 if all are met."""
    command = str(Path(sys.executable).parent / "modewright")
    helped, ratio = help_against_empty(command)
    first, again = compiled(command)
    figures = {
        "help [s]": (helped, helped < HELP_SECONDS),
        "help / empty typer application": (ratio, ratio < HELP_AGAINST_TYPER),
        "programs compiled by a second lock-step run": (again, again == 0),
        "programs compiled by a first one": (first, first > 0),
    }
    for name, (value, met) in figures.items():
        print(f"{'met ' if met else 'OPEN'} {name}: {json.dumps(round(value, 3))}")
    return 0 if all(met for _, met in figures.values()) else 1


def help_against_empty(command: str) -> tuple[float, float]:
    """Return the least time of the help [s], and the median of its ratios to an empty program's."""
    pairs = [
        (
            seconds_of(lambda: run([command, "--help"]), attempts=1),
            seconds_of(lambda: run([sys.executable, "-I", "-c", EMPTY]), attempts=1),
        )
        for _ in range(PAIRS)
    ]
    return min(pairs)[0], statistics.median(helped / bare for helped, bare in pairs)


def compiled(command: str) -> tuple[int, int]:
    """Return how many programs two equal lock-step runs compile."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        cache = {"MODEWRIGHT_CACHE": str(folder / "cache")}
        counts = []
        for k in range(2):
            log = folder / f"log{k}.txt"
            lockstep = ["lockstep", "ev_driveline", "-s", "tip_out"]
            run([command, "--log-file", str(log), *lockstep], cache)
            counts.append(log.read_text().count(" compiled: "))
    return counts[0], counts[1]


def run(command: list[str], environ: dict[str, str] | None = None) -> None:
    """Run a command that must succeed."""
    subprocess.run(command, check=True, capture_output=True, env={**os.environ, **(environ or {})})


if __name__ == "__main__":
    sys.exit(main())
