"""Command calibration: export, import and recompute calibration pages."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer

from language.text.diagnostic import SpecError, sort_problems
from language.text.sanitise import escape_invisible
from modewright.cli.common.console import console, progress_spinner, report_written_files
from modewright.cli.common.exit_codes import EXIT_CODES
from modewright.cli.common.options import Calibrations, Json, Sets, calibration_name, values_of
from modewright.runtime.json_format import format_entry
from modewright.runtime.output_files import OutputError, require_writable, write_files

Automaton = Annotated[str, typer.Argument(help="an automaton: name or file")]
PageOut = Annotated[Path, typer.Option("--out", "-o", help="write the page: .dcm, .cdfx or .csv")]
Format = Annotated[
    str | None, typer.Option("--format", help="dcm, cdfx or csv; by default from the file name")
]

calibration = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode=None,
    help="Exchange calibration pages with calibration tools: DCM, CDFX, CSV.",
    epilog=EXIT_CODES,
)


@calibration.callback()
def _calibration() -> None:
    """Exchange calibration pages with calibration tools: DCM, CDFX, CSV."""


@calibration.command(name="export", epilog=EXIT_CODES)
def export_page(
    automaton: Automaton,
    out: PageOut,
    form: Format = None,
    calibrations: Calibrations = None,
    sets: Sets = None,
    as_json: Json = False,
) -> None:
    """Write the tunable parameters and the numbers that are computed from them.

    \b
    modewright calibration export estimator --out page.dcm
    modewright calibration export estimator -c rig_7 --out page.cdfx
    """
    from modewright.api.calibrations import export_calibration
    from modewright.render import calibration as show_calibration, run as show

    name = _output_format(out, form)
    with progress_spinner(f"solving {automaton}"), _report_problems_as_json(as_json):
        page = export_calibration(automaton, values_of(sets), calibrations=calibrations or ())
    write_files({out: page.text(name).encode()})
    if as_json:
        show.print_json(show_calibration.page_json(page))
    else:
        show_calibration.print_page(console(), page)
        report_written_files([out])


@calibration.command(name="import", epilog=EXIT_CODES)
def import_page(
    page: Annotated[Path, typer.Argument(help="a file of calibration data: .dcm, .cdfx, .csv")],
    of: Annotated[str, typer.Option("--of", help="the automaton of the page: name or file")],
    out: Annotated[Path, typer.Option("--out", "-o", help="write a calibration: .yaml")],
    form: Format = None,
    name: Annotated[
        str | None,
        typer.Option("--name", help="name of the calibration; by default that of its file"),
    ] = None,
    date: Annotated[str, typer.Option("--date", help="date of the page: '2026-11-21'")] = "",
    own_only: Annotated[
        bool, typer.Option("--own-only", help="ignore names of other functions of the ECU")
    ] = False,
    as_json: Json = False,
) -> None:
    """Convert the page of a calibration tool to a calibration file (YAML).

    Unknown names and values out of range are problems; no file is written then. Solved numbers are
    compared with the computed ones, but not imported.

    \b
    modewright calibration import page.dcm --of estimator --out spec/rig_7.yaml
    modewright calibration import ecu.dcm --of estimator --own-only --out spec/rig_7.yaml
    """
    from modewright.api.calibrations import import_calibration
    from modewright.render import calibration as show_calibration, run as show

    _require_format(form)
    title = calibration_name(out, name, date)
    with progress_spinner(f"reading {page}"), _report_problems_as_json(as_json):
        found = import_calibration(page, of, form=form, own_only=own_only)
    write_files({out: found.calibration(title, escape_invisible(page.name), date).encode()})
    if as_json:
        show.print_json(show_calibration.import_json(found))
    else:
        show_calibration.print_import(console(), found)
        report_written_files([out])


@calibration.command(epilog=EXIT_CODES)
def resolve(
    automaton: Automaton,
    out: PageOut,
    page: Annotated[
        Path | None, typer.Option("--page", help="take the tunable parameters from this page")
    ] = None,
    form: Format = None,
    calibrations: Calibrations = None,
    sets: Sets = None,
    as_json: Json = False,
) -> None:
    """Recompute matrix exponentials and gains for changed tunable parameters.

    \b
    modewright calibration resolve estimator --page page.dcm --out resolved.dcm
    modewright calibration resolve estimator --calibration rig_7 --out resolved.cdfx
    """
    from modewright.api.calibrations import resolve_calibration
    from modewright.render import calibration as show_calibration, run as show

    if not (page or calibrations or sets):
        raise typer.BadParameter("name the new values with --page, --calibration or --set")
    name = _output_format(out, form)
    values = values_of(sets)
    with progress_spinner(f"solving {automaton}"), _report_problems_as_json(as_json):
        found = resolve_calibration(automaton, page, values, calibrations=calibrations or ())
    write_files({out: found.page.text(name).encode()})
    if as_json:
        show.print_json(show_calibration.resolved_json(found))
    else:
        show_calibration.print_resolved(console(), found)
        report_written_files([out])


@contextmanager
def _report_problems_as_json(as_json: bool) -> Iterator[None]:
    """Print the problems of a SpecError as JSON if requested, and raise it again."""
    from modewright.api.spec_check import problem_json
    from modewright.render import run as show

    try:
        yield
    except SpecError as error:
        if as_json:
            problems = [problem_json(problem) for problem in sort_problems(error.problems)]
            show.print_json({**format_entry("problems"), "problems": problems})
        raise


def _require_format(form: str | None) -> None:
    """Raise BadParameter if the format of a page is unknown."""
    from codegen.exchange.calibration.file_formats import FORMATS

    if form is not None and form not in FORMATS:
        raise typer.BadParameter(f"{form}: one of {', '.join(FORMATS)}", param_hint="--format")


def _output_format(out: Path, form: str | None) -> str:
    """Return the format of a page by option or suffix. Raises OutputError if it is unknown.

    The file must be writable; this is checked before any computation.
    """
    from codegen.exchange.calibration.file_formats import FORMATS, format_name

    _require_format(form)
    require_writable(out)
    name = format_name(out, form)
    if name is None:
        endings = ", ".join(f".{each}" for each in FORMATS)
        raise OutputError(f"{out}: a page ends with {endings}, or name its --format")
    return name
