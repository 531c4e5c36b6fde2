"""Console: where results go; a bar is shown, and colours are used, on terminals only."""

from __future__ import annotations

import logging
import sys
import time
from pathlib import Path

from rich.console import Console

console = Console()
"""Results on stdout; silenced by --quiet."""
log = logging.getLogger("modewright")


def configure(quiet: bool = False, verbose: bool = False, log_file: Path | None = None) -> None:
    """Set how much is told: --quiet only problems, --verbose each step, --log-file all of it."""
    console.quiet = quiet
    for handler in list(log.handlers):
        log.removeHandler(handler)
        handler.close()
    log.setLevel(logging.DEBUG if verbose or log_file else logging.WARNING)
    log.propagate = False
    if verbose:
        log.addHandler(_plain(logging.StreamHandler(sys.stderr), "%(message)s"))
    if log_file:
        file = logging.FileHandler(log_file, encoding="utf-8")
        log.addHandler(_plain(file, "%(asctime)s %(levelname)s %(message)s"))
        log.debug("command: %s", " ".join(sys.argv))
    if not log.handlers:
        log.addHandler(logging.NullHandler())


def announce(files: list[Path]) -> None:
    """Tell which files were written."""
    for path in files:
        log.info("wrote %s", path)
        console.print(f"wrote {path}", highlight=False, soft_wrap=True)


def _plain(handler: logging.Handler, form: str) -> logging.Handler:
    formatter = logging.Formatter(form, "%Y-%m-%dT%H:%M:%SZ")
    formatter.converter = time.gmtime
    handler.setFormatter(formatter)
    return handler
