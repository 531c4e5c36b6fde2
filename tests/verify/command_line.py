"""Verify the command line: how quick --help is, what a kept program saves; one line per figure.

Times are those of the processor, the best of several: a busy machine changes little.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent
sys.path.insert(0, str(ROOT))

from tests.verify.processor import seconds_of  # noqa: E402

HELP_AGAINST_TYPER = 2.0
"""`modewright --help` against an empty typer application's: what we import ourselves, with room."""
EMPTY = """
import typer
app = typer.Typer(rich_markup_mode=None)
app.command()(lambda: None)
app(["--help"])
"""
HELP_SECONDS = 0.5


def main() -> int:
    """Print every figure; return 0 if all are met."""
    command = str(Path(sys.executable).parent / "modewright")
    bare = seconds_of(lambda: run([sys.executable, "-I", "-c", EMPTY]))
    helped = seconds_of(lambda: run([command, "--help"]))
    first, again = compiled(command)
    figures = {
        "help [s]": (helped, helped < HELP_SECONDS),
        "help / empty typer application": (helped / bare, helped / bare < HELP_AGAINST_TYPER),
        "programs compiled by a second lock-step run": (again, again == 0),
        "programs compiled by a first one": (first, first > 0),
    }
    for name, (value, met) in figures.items():
        print(f"{'met ' if met else 'OPEN'} {name}: {json.dumps(round(value, 3))}")
    return 0 if all(met for _, met in figures.values()) else 1


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
