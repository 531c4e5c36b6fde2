"""Command line: a thin skin over the API; every command has an example in its help."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from engine.trajectory import Trajectory
from language.printing import program_text
from language.problem import ordered, render_all
from modewright import api, show
from modewright.exits import EXIT_CODES, PROBLEMS, exit_code
from modewright.files import OutputError, require_writable, write_files
from modewright.generated import generated_files, spec_files, stale_files

GRAPHIC_FORMATS = (".png", ".svg", ".pdf")

app = typer.Typer(
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode="markdown",
    help="Hybrid automata in YAML: simulate them, print them as C, keep both in lock-step.",
    epilog=EXIT_CODES,
)
console = Console()

System = Annotated[str, typer.Argument(help="a system: its name or its file")]
Scenario = Annotated[str, typer.Option("--scenario", "-s", help="a scenario: name or file")]
Sets = Annotated[
    list[str] | None,
    typer.Option("--set", help="a parameter value: 'k_hs=6000 N*m/rad', 'est.t_wait=2 ms'"),
]
Out = Annotated[Path | None, typer.Option("--out", "-o", help="write the samples to this CSV file")]
Plot = Annotated[
    Path | None, typer.Option("--plot", "-p", help="write a picture: .png, .svg or .pdf")
]
Json = Annotated[bool, typer.Option("--json", help="print the result as JSON")]


@app.command(epilog=EXIT_CODES)
def check(
    specs: Annotated[list[str] | None, typer.Argument(help="specs: names or files")] = None,
    every: Annotated[bool, typer.Option("--all", help="every spec below spec/")] = False,
    as_json: Json = False,
) -> None:
    """Report all problems of specs: `modewright check estimator spec/ev_driveline/plant.yaml`."""
    names = list(specs or []) + ([str(path) for path in spec_files(Path())] if every else [])
    if not names:
        raise typer.BadParameter("name a spec, or use --all", param_hint="SPECS")
    problems = ordered(problem for name in names for problem in api.check(name))
    errors = [problem for problem in problems if problem.severity == "error"]
    if as_json:
        show.print_json({"problems": [show.problem_json(problem) for problem in problems]})
    elif problems:
        print(render_all(problems), file=sys.stderr)
    if not as_json:
        console.print(f"{len(names)} specs checked, {len(errors)} problems")
    if errors:
        raise typer.Exit(PROBLEMS)


@app.command(epilog=EXIT_CODES)
def simulate(
    system: System,
    scenario: Scenario,
    sets: Sets = None,
    out: Out = None,
    plot: Plot = None,
    reference: Annotated[
        bool, typer.Option("--reference", help="integrate with scipy, observe with filterpy")
    ] = False,
    as_json: Json = False,
) -> None:
    """Simulate a system: `modewright simulate ev_driveline -s tip_out --plot tip_out.png`."""
    require_writable(out, plot)
    trajectory = api.simulate(system, scenario, _values(sets), reference=reference)
    bands = {
        name.removesuffix(".mode"): name for name in trajectory.modes if name in trajectory.signals
    }
    files: dict[Path, bytes] = {}
    if out:
        files[out] = trajectory.csv().encode()
    if plot:
        from engine.plot import all_panels, picture  # matplotlib takes a second: only if asked for

        title = f"{system}, scenario {scenario}"
        files[plot] = picture(trajectory, all_panels(trajectory), bands, title, _format(plot))
    write_files(files)
    _report_run(trajectory, as_json)
    _announce(files, as_json)


@app.command(epilog=EXIT_CODES)
def lockstep(system: System, scenario: Scenario, sets: Sets = None, as_json: Json = False) -> None:
    """Compare engine and compiled C bit by bit: `modewright lockstep ev_driveline -s tip_out`."""
    trajectory, verdicts = api.lockstep(system, scenario, _values(sets))
    if as_json:
        found = {"lockstep": [show.verdict_json(verdict) for verdict in verdicts]}
        show.print_json({**show.trajectory_json(trajectory), **found})
    else:
        show.print_verdicts(console, verdicts)
    _stop_where(trajectory.stopped is not None or not all(v.is_equal for v in verdicts), trajectory)


@app.command(epilog=EXIT_CODES)
def replay(
    estimator: Annotated[str, typer.Argument(help="a sampled automaton: name or file")],
    recording: Annotated[Path, typer.Argument(help="a CSV file, may be gzipped")],
    mapping: Annotated[str, typer.Option("--map", "-m", help="a map of columns: name or file")],
    variant: Annotated[
        str | None, typer.Option("--variant", help="a variant laid over the estimator")
    ] = None,
    sets: Sets = None,
    out: Out = None,
    plot: Plot = None,
    as_json: Json = False,
) -> None:
    """Run an estimator on a recording, engine and C in lock-step.

    `modewright replay estimator drive.csv --map leaf_can --variant leaf --plot drive.png`
    """
    require_writable(out, plot)
    replayed = api.replay(estimator, recording, mapping, variant, _values(sets))
    trajectory, verdict = replayed.result.trajectory, replayed.verdict
    files: dict[Path, bytes] = {}
    if out:
        files[out] = trajectory.csv().encode()
    if plot:
        from modewright.replay_picture import replay_picture

        title = f"{estimator} on {recording.name}" + (f", variant {variant}" if variant else "")
        files[plot] = replay_picture(replayed, title, _format(plot))
    write_files(files)
    if as_json:
        show.print_json(show.replay_json(replayed))
    else:
        show.print_replay(console, replayed)
    _announce(files, as_json)
    _stop_where(verdict is not None and not verdict.is_equal, trajectory)


@app.command(epilog=EXIT_CODES)
def generate(
    automaton: Annotated[str | None, typer.Argument(help="a sampled automaton")] = None,
    out: Annotated[Path, typer.Option("--out", "-o", help="folder to write to")] = Path(
        "generated"
    ),
    sets: Sets = None,
    every: Annotated[bool, typer.Option("--all", help="all of spec/ into generated/")] = False,
    only_check: Annotated[
        bool, typer.Option("--check", help="with --all: write nothing, fail where stale")
    ] = False,
) -> None:
    """Print C sources: `modewright generate estimator --out build`, `modewright generate --all`."""
    if every == (automaton is not None):
        raise typer.BadParameter("name an automaton or use --all", param_hint="AUTOMATON")
    if only_check:
        lines = stale_files(Path())
        for line in lines:
            print(line, file=sys.stderr)
        if lines:
            print("run `modewright generate --all`", file=sys.stderr)
            raise typer.Exit(PROBLEMS)
        return
    if automaton is not None:
        made = api.generate(automaton, _values(sets))
        files = {out / name: text.encode() for name, text in made.items()}
    else:
        files = generated_files(Path())
    for folder in {path.parent for path in files}:
        _make_folder(folder)
    write_files(files)
    for path in files:
        console.print(f"wrote {path}", highlight=False, soft_wrap=True)


@app.command(epilog=EXIT_CODES)
def explain(
    automaton: Annotated[str, typer.Argument(help="an automaton: name or file")], sets: Sets = None
) -> None:
    """Print the Program that engine and generator share: `modewright explain estimator`."""
    print(program_text(api.program(automaton, _values(sets))), end="")


@app.command(name="demo", epilog=EXIT_CODES)
def run_demo(
    out: Annotated[Path, typer.Option("--out", "-o", help="folder for the picture")] = Path(
        "build"
    ),
) -> None:
    """Simulate the tip-out of the paper, compare engine and C, draw the picture."""
    from modewright import demo

    _make_folder(out)
    if not demo.run(out, console):
        raise typer.Exit(PROBLEMS)


def main() -> None:
    """Run the command line and leave with its exit code."""
    sys.exit(exit_code(lambda: app(standalone_mode=False)))


def _values(sets: list[str] | None) -> dict[str, str]:
    found = {}
    for text in sets or []:
        name, equals, value = text.partition("=")
        if not equals or not name.strip() or not value.strip():
            raise typer.BadParameter(f"`{text}` is not `parameter=value`", param_hint="--set")
        found[name.strip()] = value.strip()
    return found


def _format(path: Path) -> str:
    if path.suffix.lower() not in GRAPHIC_FORMATS:
        raise OutputError(f"{path}: a picture ends with {', '.join(GRAPHIC_FORMATS)}")
    return path.suffix.lower()[1:]


def _make_folder(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(f"{folder}: {error.strerror}") from None


def _announce(files: dict[Path, bytes], as_json: bool) -> None:
    for path in files:
        if not as_json:
            console.print(f"wrote {path}", highlight=False, soft_wrap=True)


def _report_run(trajectory: Trajectory, as_json: bool) -> None:
    if as_json:
        show.print_json(show.trajectory_json(trajectory))
    else:
        console.print(show.events_table(trajectory.events))
    _stop_where(trajectory.stopped is not None, trajectory)


def _stop_where(failed: bool, trajectory: Trajectory) -> None:
    for fault in trajectory.faults:
        print(f"warning: a fault bit is set: {fault}", file=sys.stderr)
    if trajectory.stopped:
        print(f"error: the run stopped: {trajectory.stopped}", file=sys.stderr)
    if failed:
        raise typer.Exit(PROBLEMS)
