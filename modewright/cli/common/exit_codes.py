"""Exit codes: map exceptions of a command to messages and exit codes."""

from __future__ import annotations

import errno
import os
import sys
import tempfile
import traceback
import warnings
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import typer

from language.text.diagnostic import (
    AssumptionWarning,
    DataError,
    LargeRunWarning,
    MissingToolError,
    SpecError,
    render_all,
    sort_problems,
)
from language.text.sanitise import escape_invisible, truncate
from modewright.cli.common.escaping_stream import escape_standard_streams
from modewright.runtime.output_files import OutputError
from sweep.execution.dask_error import ClusterError

DONE, PROBLEMS, USAGE, TOOL, DEFECT, INTERRUPTED = 0, 1, 2, 3, 4, 130
MAX_SHOWN = 100
"""Largest number of problems that are printed; `check --json` prints all."""
USAGE_ERROR: Any = typer.BadParameter.__mro__[1]
"""The base class of all usage errors; typer contains its own copy of click."""
EXIT_CODES = """Exit codes: 0 done; 1 the spec or data has problems, a check failed, lock-step
differs; 2 wrong usage; 3 a tool is missing (its install line is printed) or does not work; 4 a
defect of modewright (one line and a report file); 130 interrupted; 143 ended by SIGTERM."""
"""The text about exit codes below the help of each command."""


def run_with_exit_code(run: Callable[[], object]) -> int:
    """Run a command line and return its exit code; messages of exceptions go to stderr.

    The code is the int that `run` returns, else DONE. A usage error gives USAGE, Ctrl-C
    INTERRUPTED, typer.Exit its own code. SpecError, OutputError, ClusterError, DataError and an
    OSError of USER_ERRNOS give PROBLEMS, MissingToolError gives TOOL. A closed pipe on stdout gives
    DONE. Any other Exception gives DEFECT and writes a report file. Meanwhile stdout and stderr
    escape invisible characters, and warnings of modewright are printed as one line each.
    """
    with escape_standard_streams(), warnings.catch_warnings():
        warnings.showwarning = partial(_show_warning, warnings.showwarning)
        return _run(run)


def _show_warning(
    show_other: Callable[..., None], message: Warning | str, category: type[Warning], *place: Any
) -> None:
    """Print a warning of modewright to stderr; pass others to `show_other`."""
    if issubclass(category, LargeRunWarning):
        print(f"warning: {message}", file=sys.stderr)
    elif issubclass(category, AssumptionWarning):
        print(message, file=sys.stderr)
    else:
        show_other(message, category, *place)


def _run(run: Callable[[], object]) -> int:
    """Return the exit code of `run_with_exit_code`."""
    try:
        code = run()
        _flush_stdout()
        return code if isinstance(code, int) else DONE
    except USAGE_ERROR as error:
        error.show()
        return USAGE
    except (KeyboardInterrupt, typer.Abort):
        print("interrupted", file=sys.stderr)
        return INTERRUPTED
    except typer.Exit as error:
        if error.exit_code == INTERRUPTED:
            print("interrupted", file=sys.stderr)
        return _flush_with_code(error.exit_code)
    except SpecError as error:
        report_problems(error)
        return PROBLEMS
    except (OutputError, ClusterError, DataError) as error:
        print(f"error: {error}", file=sys.stderr)
        return PROBLEMS
    except MissingToolError as error:
        print(f"error: {error}", file=sys.stderr)
        return TOOL
    except BrokenPipeError:
        return _discard_output()
    except OSError as error:
        if error.errno not in USER_ERRNOS:
            return _report_defect(error)
        _discard_output()
        where = f": {error.filename}" if error.filename else ""
        print(f"error: {escape_invisible(truncate(str(error.strerror) + where))}", file=sys.stderr)
        return PROBLEMS
    except Exception as error:
        return _report_defect(error)


def _report_defect(error: Exception) -> int:
    """Write the report file of an unexpected exception, print its path and return the exit code.

    If the file cannot be written, the reason is printed instead.
    """
    print(f"error: a defect of modewright: {_first_line(error)}", file=sys.stderr)
    try:
        print(f"a report is in {_write_defect_report()}", file=sys.stderr)
    except OSError as no_report:
        print(f"no report can be written: {no_report.strerror}", file=sys.stderr)
    return DEFECT


def _flush_stdout() -> None:
    """Flush stdout if it exists."""
    if sys.stdout is not None:
        sys.stdout.flush()


def _flush_with_code(code: int) -> int:
    """Flush stdout and return the exit code; ignore a reader that is gone."""
    try:
        _flush_stdout()
    except BrokenPipeError:
        return _discard_output() or code
    return code


def _discard_output() -> int:
    """Redirect stdout to the null device because its reader is gone (`| head`); return DONE."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    return DONE


def report_problems(error: SpecError) -> None:
    """Print the problems of a SpecError, sorted by place, and the number of errors to stderr.

    At most MAX_SHOWN problems are printed, with the number of the others; the count at the end
    includes all errors but no warnings.
    """
    problems = sort_problems(error.problems)
    count = sum(problem.severity == "error" for problem in problems)
    print(render_all(problems[:MAX_SHOWN]), file=sys.stderr)
    if len(problems) > MAX_SHOWN:
        print(f"\n... and {len(problems) - MAX_SHOWN} more", file=sys.stderr)
    print(f"\n{count} {'problem' if count == 1 else 'problems'}", file=sys.stderr)


USER_ERRNOS = {errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EACCES, errno.ENAMETOOLONG, errno.EIO}
"""System errors that the user can solve, such as a full disk or a wrong path."""


def _first_line(error: Exception) -> str:
    """Return the type of an exception and the first line of its message."""
    text = str(error).strip().split("\n")[0]
    return f"{type(error).__name__}: {text}" if text else type(error).__name__


def _write_defect_report() -> Path:
    """Write command line, Python version and traceback to a temporary file; return its path."""
    text = f"command: {' '.join(sys.argv)}\npython: {sys.version}\n\n{traceback.format_exc()}"
    with tempfile.NamedTemporaryFile(
        "w", prefix="modewright-report-", suffix=".txt", delete=False
    ) as file:
        file.write(text)
    return Path(file.name)
