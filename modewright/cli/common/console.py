"""Console: print results and progress; progress bars and colours appear on terminals only."""

from __future__ import annotations

import logging
import os
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from language.text.sanitise import escape_invisible

if TYPE_CHECKING:
    from rich.console import Console

PIPE_WIDTH = 160
"""Width of tables [characters] if the output is no terminal."""

REPORT_INTERVAL = 20.0
"""Time [s] between two lines of progress if the output is no terminal."""

log = logging.getLogger("modewright")


@cache
def console() -> Console:
    """Return the console for stdout, the same one at each call.

    It has no colours in pipes and under NO_COLOR. Its width is PIPE_WIDTH if stdout is no terminal
    and COLUMNS is not set. It escapes invisible characters of texts (`escape_output`).
    """
    # deferred: the import is slow and --help does not need it
    from modewright.cli.common.escaping_console import EscapingConsole

    has_width = sys.stdout.isatty() or "COLUMNS" in os.environ
    return EscapingConsole(width=None if has_width else PIPE_WIDTH)


def configure(quiet: bool = False, verbose: bool = False, log_file: Path | None = None) -> None:
    """Set the verbosity of console and log; handlers of an earlier call are removed.

    `quiet` suppresses the output of the console. `verbose` writes the log to stderr; `log_file`
    appends it to a file with UTC times, beginning with the command. Without both the log is
    discarded. A log file that cannot be written gives one warning on stderr.
    """
    if quiet or console.cache_info().currsize:
        console().quiet = quiet
    for handler in list(log.handlers):
        log.removeHandler(handler)
        with suppress(OSError):
            handler.close()
    log.setLevel(logging.DEBUG if verbose or log_file else logging.WARNING)
    log.propagate = False
    if verbose:
        log.addHandler(_set_formatter(logging.StreamHandler(sys.stderr), "%(message)s"))
    if log_file:
        file = _LogFile(log_file, encoding="utf-8")
        log.addHandler(_set_formatter(file, "%(asctime)s %(levelname)s %(message)s"))
        log.debug("command: %s", " ".join(sys.argv))
    if not log.handlers:
        log.addHandler(logging.NullHandler())


class _LogFile(logging.FileHandler):
    """Log file that reports on stderr, once, that it cannot be written."""

    has_failed = False

    def handleError(self, record: logging.LogRecord) -> None:
        """Print a warning with the reason of the exception that is being handled."""
        error = sys.exception()
        if self.has_failed or not isinstance(error, OSError):
            return
        self.has_failed = True
        name = escape_invisible(os.fspath(self.baseFilename))
        reason = error.strerror or error
        with suppress(OSError, ValueError):
            print(f"warning: the log {name} is incomplete: {reason}", file=sys.stderr)


@contextmanager
def progress_spinner(description: str) -> Iterator[None]:
    """Show a spinner with the elapsed time on stderr; log the duration at the end.

    The spinner is hidden if stderr is no terminal or the console is quiet. No duration is logged
    after an exception.
    """
    from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    from modewright.cli.common.escaping_console import EscapingConsole

    start = time.monotonic()
    screen = EscapingConsole(stderr=True)
    columns = (SpinnerColumn(), TextColumn("{task.description}"), TimeElapsedColumn())
    is_hidden = not screen.is_terminal or console().quiet
    with Progress(*columns, console=screen, transient=True, disable=is_hidden) as progress:
        progress.add_task(description, total=None)
        yield
    log.info("%s: %.2f s", description, time.monotonic() - start)


@contextmanager
def progress_bar(description: str, noun: str) -> Iterator[Callable[[int, int, int], None]]:
    """Show a progress bar with rate and remaining time on stderr; elsewhere print lines.

    Yields a function of three numbers: finished, finished before the start, and total; the rate
    counts `noun` per second without those before the start. If stderr is no terminal, a line is
    printed at most each REPORT_INTERVAL; nothing if the console is quiet. The duration is logged at
    the end.
    """
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    from modewright.cli.common.escaping_console import EscapingConsole

    screen = EscapingConsole(stderr=True)
    is_hidden = not screen.is_terminal or console().quiet
    columns = (
        TextColumn("{task.description}"), BarColumn(), TextColumn("{task.fields[count]}"),
        TextColumn("{task.fields[rate]}"), TimeRemainingColumn(),
    )  # fmt: skip
    start = reported_at = time.monotonic()
    with Progress(*columns, console=screen, transient=True, disable=is_hidden) as progress:

        def report(done: int, before: int, total: int) -> None:
            if not progress.tasks:
                progress.add_task(description, total=total, completed=before, count="", rate="")
            rate = (done - before) / max(time.monotonic() - start, 1e-9)
            shown = f"{rate:.3g} {noun}/s" if done > before else ""
            count, bar = f"{done}/{total}", progress.tasks[0].id
            progress.update(bar, total=total, completed=done, count=count, rate=shown)
            nonlocal reported_at
            if (
                not (screen.is_terminal or console().quiet)
                and time.monotonic() - reported_at > REPORT_INTERVAL
            ):
                reported_at = time.monotonic()
                print(
                    f"{description}: {done} of {total} {noun}, {shown}", file=sys.stderr, flush=True
                )

        yield report
    log.info("%s: %.2f s", description, time.monotonic() - start)


def report_written_files(files: Sequence[Path]) -> None:
    """Print and log a line `wrote path` for each path, in the given order."""
    for path in files:
        log.info("wrote %s", path)
        console().print(f"wrote {path}", highlight=False, markup=False, soft_wrap=True)


def _set_formatter(handler: logging.Handler, form: str) -> logging.Handler:
    """Set the format of a log handler, with UTC times, and return the handler."""
    formatter = logging.Formatter(form, "%Y-%m-%dT%H:%M:%SZ")
    formatter.converter = time.gmtime
    handler.setFormatter(formatter)
    return handler
