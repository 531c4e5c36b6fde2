"""Command sweep: run the variants of a study into a folder."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from modewright.cli.common.console import console, progress_bar, report_written_files
from modewright.cli.common.exit_codes import PROBLEMS
from modewright.cli.common.interruption import debounce_interrupts
from modewright.cli.common.options import Json, Sets, usage_errors, values_of
from modewright.render.pluralisation import pluralise
from modewright.runtime.output_files import (
    OutputError,
    make_folder,
    require_separate_outputs,
    write_files,
)
from sweep.execution.dask_error import ClusterError

if TYPE_CHECKING:
    from sweep.execution.study_run import StudyRun

PLOTS = "plots"
"""The folder of figures in the folder of results."""
FORMATS = ("svg", "png", "pdf")
"""Formats of figures."""
RUN_OPTIONS = {
    "out": "--out", "workers": "--workers", "cluster": "--cluster", "tls_ca": "--tls-ca",
    "tls_cert": "--tls-cert", "tls_key": "--tls-key", "sets": "--set", "samples": "--samples",
    "seed": "--seed", "block": "--block",
}  # fmt: skip
"""Options that have no effect with --summary, by parameter."""
OPEN_WARNING = (
    "warning: {} is not encrypted, and workers execute all data that reaches their scheduler "
    "(pickles): use tls:// in shared networks"
)
"""Warning for an unencrypted cluster."""
TlsFile = Annotated[
    Path | None, typer.Option(help="PEM file for tls://; by default from Dask's configuration")
]


def sweep(
    context: typer.Context,
    study: Annotated[str | None, typer.Argument(help="a study: name or file")] = None,
    out: Annotated[Path | None, typer.Option("--out", "-o", help="folder for the results")] = None,
    workers: Annotated[
        int, typer.Option("--workers", "-j", min=0, help="processes; 0: one for each core")
    ] = 0,
    cluster: Annotated[
        str | None, typer.Option(help="Dask cluster: local:4, tcp://host:8786, tls://host:8786")
    ] = None,
    tls_ca: TlsFile = None,
    tls_cert: TlsFile = None,
    tls_key: TlsFile = None,
    sets: Sets = None,
    summary: Annotated[
        Path | None, typer.Option("--summary", help="summarise a folder of results, run nothing")
    ] = None,
    samples: Annotated[
        int | None, typer.Option(min=1, help="number of samples instead of the study's")
    ] = None,
    seed: Annotated[
        int | None, typer.Option(min=0, help="seed of samples instead of the study's")
    ] = None,
    block: Annotated[
        int | None, typer.Option(min=1, max=1_000_000, help="variants that are stored together")
    ] = None,
    table: Annotated[
        Path | None, typer.Option("--csv", help="write the summary as CSV, numbers in SI")
    ] = None,
    report: Annotated[
        Path | None, typer.Option("--report", help="write an HTML report of the results")
    ] = None,
    form: Annotated[
        str, typer.Option("--format", help="format of figures: svg, png or pdf")
    ] = "svg",
    as_json: Json = False,
) -> None:
    """Run a study into a folder of Parquet files; the same command continues an interrupted run.

    The plots of the study are written into the folder `plots` there.

    \b
    modewright sweep tip_out_stiffness_and_gap --out build/tip_out
    modewright sweep my_study.yaml --out results --workers 4 --set 'c_hs=20 N*m*s/rad'
    modewright sweep random_tip_outs --out held_out --samples 200 --seed 7
    modewright sweep my_study.yaml --out results --cluster tls://head:8786 --tls-ca ca.pem
    modewright sweep --summary results --csv summary.csv --report results.html
    """
    folder = _require_folder(study, out, summary, form)
    if summary is not None:
        _require_nothing_to_run(context)
    require_separate_outputs(folder, table, report)
    lost = 0
    if study is not None:
        options: dict[str, Any] = {"block": block, "samples": samples, "seed": seed}
        options["workers"] = workers or None
        options |= _cluster_options(cluster, workers, (tls_ca, tls_cert, tls_key))
        lost = _run_study(study, folder, values_of(sets), options, as_json)
    _report_results(folder, table, report, form, as_json)
    if lost:
        raise typer.Exit(PROBLEMS)


def _require_nothing_to_run(context: typer.Context) -> None:
    """Raise BadParameter if options of a run are used with --summary."""
    given = {name: context.get_parameter_source(name) for name in RUN_OPTIONS}
    used = [
        RUN_OPTIONS[name] for name, source in given.items() if source and source.name != "DEFAULT"
    ]
    if used:
        label = f"it runs nothing: {', '.join(used)} would have no influence"
        raise typer.BadParameter(label, param_hint="--summary")


def _require_folder(study: str | None, out: Path | None, summary: Path | None, form: str) -> Path:
    """Return the folder of --out or --summary. Raises BadParameter for contradictory options."""
    if (study is None) == (summary is None):
        raise typer.BadParameter("name a study, or a folder with --summary", param_hint="STUDY")
    if study is not None and out is None:
        raise typer.BadParameter("say where the results go", param_hint="--out")
    if form not in FORMATS:
        raise typer.BadParameter(f"one of {', '.join(FORMATS)}", param_hint="--format")
    folder = out or summary
    assert folder is not None
    return folder


def _cluster_options(
    cluster: str | None, workers: int, files: tuple[Path | None, ...]
) -> dict[str, Any]:
    """Return address and credentials of a cluster; warn of an unencrypted connection.

    Raises BadParameter for contradictory options, and OutputError for a missing TLS file.
    """
    from sweep.execution.dask_address import Credentials, parse_address

    if cluster is None:
        if any(files):
            raise typer.BadParameter("files of TLS are for a cluster", param_hint="--cluster")
        return {}
    if workers:
        label = "a cluster says itself how many workers it has: `local:4`"
        raise typer.BadParameter(label, param_hint="--workers")
    with usage_errors():
        address = parse_address(cluster)
    for path in files:
        if path and not address.url.startswith("tls:"):
            raise typer.BadParameter("files of TLS are for tls://", param_hint="--cluster")
        if path and not path.is_file():
            raise OutputError(f"{path}: there is no such file")
    if address.is_unprotected:
        print_error(OPEN_WARNING.format(cluster))
    return {"cluster": cluster, "credentials": Credentials(*files)}


def _run_study(
    study: str,
    out: Path,
    values: dict[str, str],
    options: Mapping[str, Any],
    as_json: bool,
) -> int:
    """Run the study and return the number of lost blocks."""
    from modewright.api import studies

    done = [0, 0]

    def tell(now: int, before: int, total: int) -> None:
        done[:] = [now, total]
        progress(now, before, total)

    with debounce_interrupts():
        try:
            with progress_bar(f"sweep {study}", "variants") as progress, usage_errors():
                found = studies.sweep(
                    study, out, values, **options, progress=tell, warn=_print_warning
                )
        except KeyboardInterrupt:
            _report_stored(out, *done)
            raise
        except (OutputError, ClusterError) as error:
            kept = f"{done[0]} of {done[1]} variants are kept; the same command goes on"
            raise OutputError(f"{error}; {kept}" if done[1] else str(error)) from None
    if not as_json:
        _report_run(found)
    for part, reason in found.lost_blocks:
        print_error(f"variants {part.start} to {part.stop - 1} are not done: {reason}")
    return len(found.lost_blocks)


def _report_stored(out: Path, now: int, total: int) -> None:
    """Print how many variants are stored after an interruption."""
    if total:
        print_error(f"{now} of {total} variants are kept in {out}; the same command goes on")


def _print_warning(text: str) -> None:
    """Print a warning to stderr; the text of a problem already contains its severity."""
    print_error(text if ": warning: " in text.split("\n")[0] else f"warning: {text}")


def _report_run(found: StudyRun) -> None:
    """Print the numbers of computed and reused variants."""
    before = f", {found.reused} were there" if found.reused else ""
    console().print(f"{pluralise(found.computed, 'variant')} computed{before}", highlight=False)


def print_error(text: str) -> None:
    """Print a line to stderr."""
    import sys

    print(text, file=sys.stderr)


def _report_results(
    folder: Path, table: Path | None, report: Path | None, form: str, as_json: bool
) -> None:
    """Print the summary of a study and write plots, table and report."""
    from modewright.api import studies
    from modewright.render import study as show_study
    from modewright.render.run import print_json
    from modewright.render.study_page import study_report

    found = studies.study_summary(folder)
    if as_json:
        print_json(show_study.summary_json(found))
    else:
        show_study.print_summary(console(), found)
    written = _write_pictures(folder, form)
    files = {table: found.csv().encode()} if table else {}
    if report:
        files[report] = study_report(folder)
    write_files(files)
    if not as_json:
        report_written_files([*written, *files])


def _write_pictures(folder: Path, form: str) -> list[Path]:
    """Write the plots of a study and return the paths; warn if they cannot be written."""
    from modewright.api import studies

    drawn = studies.study_pictures(folder)
    files = {folder / PLOTS / f"{name}.{form}": p.data(form) for name, p in drawn.items()}
    try:
        if files:
            make_folder(folder / PLOTS)
        write_files(files)
    except OutputError as error:
        _print_warning(f"the pictures are not written: {error}")
        return []
    return list(files)
