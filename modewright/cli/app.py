"""Application: assemble the commands and run the command line."""

from __future__ import annotations

import io
import logging
import os
import signal
import sys
from collections.abc import Callable, Collection, Sequence
from pathlib import Path
from typing import Annotated

import typer

from language.text.diagnostic import DataError
from language.text.project_boundary import ALLOW_OUTSIDE_ENV
from modewright.cli.commands.a2l import a2l
from modewright.cli.commands.calibration import calibration
from modewright.cli.commands.check import check
from modewright.cli.commands.compare import compare
from modewright.cli.commands.dbc import dbc
from modewright.cli.commands.demo import demo
from modewright.cli.commands.diagnose import diagnose
from modewright.cli.commands.diff import diff
from modewright.cli.commands.doctor import doctor
from modewright.cli.commands.effects import effects
from modewright.cli.commands.explain import explain
from modewright.cli.commands.fit import fit
from modewright.cli.commands.fmu import fmu
from modewright.cli.commands.format import format
from modewright.cli.commands.fuzz import fuzz
from modewright.cli.commands.generate import generate
from modewright.cli.commands.graph import graph
from modewright.cli.commands.lockstep import lockstep
from modewright.cli.commands.lsp import lsp
from modewright.cli.commands.mcdc import mcdc
from modewright.cli.commands.metrics import metrics
from modewright.cli.commands.new import new
from modewright.cli.commands.plot import plot
from modewright.cli.commands.prove import prove
from modewright.cli.commands.recording import recording
from modewright.cli.commands.replay import replay
from modewright.cli.commands.schema import schema
from modewright.cli.commands.sensitivity import sensitivity
from modewright.cli.commands.simulate import simulate
from modewright.cli.commands.sweep import sweep
from modewright.cli.commands.test import test
from modewright.cli.commands.trace import trace
from modewright.cli.common.console import configure
from modewright.cli.common.exit_codes import EXIT_CODES, INTERRUPTED, run_with_exit_code
from modewright.cli.common.interruption import convert_signals
from modewright.runtime.gc_threshold import raise_gc_threshold
from modewright.runtime.output_files import require_writable

MULTI_VALUE_OPTIONS = ("--train", "--held-out")
"""Options that take all values up to the next option; each may also be repeated."""


def expand_arguments(arguments: Sequence[str]) -> list[str]:
    """Return the arguments with the option inserted before each further value of it.

    This holds for MULTI_VALUE_OPTIONS: `--train a b` becomes `--train a --train b`. The arguments
    are unchanged if the second one begins with `-`, because the positional argument of the command
    could then be among the values.
    """
    if len(arguments) < 2 or arguments[1].startswith("-"):
        return list(arguments)
    result: list[str] = []
    option = ""
    for argument in arguments:
        if argument.startswith("-"):
            option = argument if argument in MULTI_VALUE_OPTIONS else ""
        elif option and result[-1] != option:
            result.append(option)
        result.append(argument)
    return result


COMPLETION_VARIABLE = "_MODEWRIGHT_COMPLETE"
"""Set by a shell that requests completions; the words are in other variables."""

COMMANDS = (
    new, check, test, trace, diagnose, fit, effects, simulate, sweep, sensitivity,
    lockstep, replay, plot, compare, graph, generate, a2l, dbc, fmu, metrics, prove, fuzz, mcdc,
    explain, diff, format, schema, lsp, doctor,
)  # fmt: skip
"""The commands in the order of the help."""


def build_application(arguments: Collection[str] | None = None) -> typer.Typer:
    """Return the application with all COMMANDS and the groups recording, calibration and demo.

    Given the arguments of the command line, only commands that are named in them have their
    parameters; the others are stubs with name and help, because the inspection of parameters is
    slow. None gives all commands their parameters.
    """
    typer_app = typer.Typer(
        no_args_is_help=True,
        pretty_exceptions_enable=False,
        rich_markup_mode=None,
        help="Hybrid automata in YAML: simulate them, generate C code, keep both in lock-step.",
        epilog=EXIT_CODES,
        callback=options,
    )
    for command in COMMANDS:
        is_complete = arguments is None or command.__name__ in arguments
        typer_app.command(epilog=EXIT_CODES)(command if is_complete else command_stub(command))
    typer_app.add_typer(recording, name="recording")
    typer_app.add_typer(calibration, name="calibration")
    typer_app.add_typer(demo, name="demo")
    return typer_app


def command_stub(command: Callable[..., None]) -> Callable[[], None]:
    """Return a function with the name and the docstring of a command but without parameters.

    A call raises AssertionError; it serves for the list of commands only.
    """

    def stub() -> None:
        raise AssertionError(f"{command.__name__} has no parameters")

    stub.__name__, stub.__doc__ = command.__name__, command.__doc__
    return stub


def _version(is_wanted: bool) -> None:
    """Print the version and exit if it is wanted."""
    if is_wanted:
        from importlib import metadata

        print(f"modewright {metadata.version('modewright')}")
        raise typer.Exit


def _require_working_folder() -> None:
    """Raise DataError if the working folder was deleted."""
    try:
        os.getcwd()
    except FileNotFoundError:
        raise DataError(
            "the current folder does not exist any more: change to another one"
        ) from None


def options(
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="print problems only")] = False,
    verbose: Annotated[bool, typer.Option("--verbose", "-v", help="print each step")] = False,
    log_file: Annotated[Path | None, typer.Option(help="append the log to this file")] = None,
    version: Annotated[  # noqa: ARG001 - its callback prints it
        bool, typer.Option("--version", help="print the version", is_eager=True, callback=_version)
    ] = False,
    allow_outside: Annotated[
        bool,
        typer.Option("--allow-outside", help="allow specs to refer to files outside their project"),
    ] = False,
) -> None:
    """Hybrid automata in YAML: simulate them, generate C code, keep both in lock-step."""
    if quiet and verbose:
        raise typer.BadParameter("leave out one of them", param_hint="--quiet, --verbose")
    _require_working_folder()
    require_writable(log_file)
    configure(quiet, verbose, log_file)
    if allow_outside:
        os.environ[ALLOW_OUTSIDE_ENV] = "1"


app = build_application()


def main() -> None:
    """Run the command line on `sys.argv` and exit with its exit code.

    Missing stdout and stderr are replaced by the null device. SIGTERM and SIGHUP interrupt the
    command like Ctrl-C, with the exit code 128 plus their number. After an interrupt further ones
    are ignored during the exit.
    """
    raise_gc_threshold()
    logging.raiseExceptions = False  # do not stop if the log cannot be written
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, "w"))  # noqa: SIM115 - for the whole process
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")  # file names may not be valid text
    arguments = expand_arguments(sys.argv[1:])
    is_completion = COMPLETION_VARIABLE in os.environ
    run = build_application(None if is_completion else arguments)
    with convert_signals() as received:
        code = run_with_exit_code(lambda: run(arguments, standalone_mode=False))
    if code == INTERRUPTED:
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # ignore further interrupts during exit
    sys.exit(received.exit_code or code)
