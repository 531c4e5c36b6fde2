"""Command recording: check the quality of recordings, and propose maps of their columns."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from modewright.cli.common.console import console, progress_spinner, report_written_files
from modewright.cli.common.exit_codes import EXIT_CODES, PROBLEMS
from modewright.cli.common.options import Json, Plot, picture_format, usage_errors
from modewright.render.pluralisation import pluralise
from modewright.runtime.output_files import OutputError, require_writable, write_files

recording = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode=None,
    help="Check recordings, propose maps.",
    epilog=EXIT_CODES,
)


@recording.callback()
def _recording() -> None:
    """Check recordings, propose maps."""


@recording.command(epilog=EXIT_CODES)
def check(
    files: Annotated[
        list[Path],
        typer.Argument(help="CSV(.gz), Parquet, MF4, or CAN logs: BLF, ASC, TRC, candump"),
    ],
    mapping: Annotated[
        str | None, typer.Option("--map", "-m", help="map of columns: name or file")
    ] = None,
    spec: Annotated[
        str | None, typer.Option("--spec", "-s", help="an automaton, to check units and clocks")
    ] = None,
    databases: Annotated[
        list[str] | None,
        typer.Option("--dbc", help="CAN database for logs, if there is no map; also BUS=FILE"),
    ] = None,
    plot: Plot = None,
    as_json: Json = False,
) -> None:
    """Report rates, gaps, noise and outliers, and which effects recordings can test.

    Exit code 1 if an error makes the recordings unusable for a diagnosis.

    \b
    modewright recording check drive.csv --spec leaf_motor_side --plot drive.png
    """
    from modewright.api.recordings import check_recordings
    from modewright.render import recording as show_recording, run as show

    form = picture_format(plot) if plot else ""
    require_writable(plot)
    with progress_spinner(f"looking at {pluralise(len(files), 'recording')}"), usage_errors():
        checked = check_recordings(files, mapping, spec, databases or ())
    if plot:
        title = ", ".join(file.name for file in files) + (f" against {spec}" if spec else "")
        write_files({plot: checked.plot(title).data(form)})
    if as_json:
        show.print_json(show_recording.check_json(checked.check))
    else:
        show_recording.print_check(console(), checked.check)
        report_written_files([plot] if plot else [])
    if not checked.check.is_usable:
        raise typer.Exit(PROBLEMS)


@recording.command("map", epilog=EXIT_CODES)
def propose(
    file: Annotated[Path, typer.Argument(help="the recording: a file of any known format")],
    spec: Annotated[str, typer.Option("--spec", "-s", help="an automaton: name or file")],
    databases: Annotated[
        list[str] | None, typer.Option("--dbc", help="CAN database of a log (repeatable)")
    ] = None,
    name: Annotated[
        str | None, typer.Option("--name", help="name of the map; by default from the file")
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="write the map: a new file .yaml")
    ] = None,
) -> None:
    """Propose a map: the columns of a recording for the signals of an automaton.

    The map follows from names, units, values and the model. Its comments tell the reasons and what
    is open. A person checks and corrects it. Without --out it is printed.

    \b
    modewright recording map drive.csv --spec leaf_motor_side --out spec/map_drive.yaml
    """
    from modewright.api.recordings import propose_map

    if out:
        if out.suffix != ".yaml":
            raise OutputError(f"{out}: a map ends with .yaml")
        if out.exists():
            raise OutputError(f"{out}: the file exists; a map may have corrections of a person")
        require_writable(out)
    with progress_spinner(f"looking at {file.name}"), usage_errors():
        text = propose_map(file, spec, databases or (), name)
    if out:
        write_files({out: text.encode()})
        report_written_files([out])
    else:
        print(text, end="")
