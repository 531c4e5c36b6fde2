"""Robustness: commands of the diagnosis on random pairs of a spec and faulty recordings.

Each pair runs one command in a process of its own, with a time limit. A failure is a defect, a
hang, an exit code without a reason, invalid JSON, a Python warning, or a word such as nan in what
the user reads. Results are stored for each pair at once; the same command continues the study.
"""

from __future__ import annotations

import argparse
import html
import json
import os
import re
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from pathlib import Path
from random import Random

from tests.validation.evidence.evidence_store import ROOT
from tests.validation.properties.recorded_machine import Machine, Table, machines
from tests.validation.properties.recording_corruption import (
    CORRUPTIONS,
    Draft,
    draw_recording,
)

EXAMPLES = """\
# 300 pairs; the same command continues
python -m tests.validation.properties.robustness --pairs 300 --seed 1
# with real machines, results as JSON
python -m tests.validation.properties.robustness --pairs 300 --recordings DIR --json
# one pair again, with its files and its output
python -m tests.validation.properties.robustness --seed 1 --only 17 --keep build/pair"""
COMMANDS = ("diagnose", "diagnose", "diagnose", "fit", "check", "python")
"""Commands of a pair; `python` is the function of the package."""
FOLDER = ROOT / "build" / "robustness"
TIME_LIMIT = 300.0
"""Time [s] after which a command hangs."""
BUDGET = "25 s"
ENVIRONMENT = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "PYTHONPATH": str(ROOT)}
PYTHON = """\
import json, sys
import modewright
from language.text.diagnostic import SpecError
spec, mapping, effects, train, held_out, anyway = json.loads(sys.argv[1])
try:
    found = modewright.diagnose(spec, train, held_out, mapping, effects, budget=25.0, anyway=anyway)
except (SpecError, ValueError) as error:
    print(f"{type(error).__name__}: {error}", file=sys.stderr)
    sys.exit(1)
print(*found.verdict.messages, *(one.text for one in found.findings), sep="\\n")
print(json.dumps(found.verdict.to_json(), allow_nan=False))
"""
NON_FINITE = re.compile(r"(?<![\w.`'\"#-])[-+]?(?:nan|inf|NaN|Infinity|None)(?:%| %|(?![\w.`'\"]))")
"""A number that is not finite, or None, as a word of a sentence or a cell of a table."""
SOURCE_LINE = re.compile(r"^(?: +\S| {4}).*$", re.MULTILINE)
"""A line of the user's file below a message."""
QUOTED = re.compile(r"`[^`]*`")
TAGS = re.compile(r"<(style|script)\b.*?</\1>|<[^>]*>", re.DOTALL)
REPORT_PATH = re.compile(r"a report is in (\S+)")
FRAME = re.compile(
    r'File "[^"]*?/((?:codegen|diagnosis|engine|language|modewright)/(?:\w+/)*\w+\.py)",'
    r" line (\d+), in (\w+)"
)
USAGE = re.compile(r"each recording counts once|cannot be held out")
"""What a message says of files that are named twice, which is wrong usage."""
EXCEPTION = re.compile(r"(?:\w+\.)*\w+(?::|$)")
WARNING = re.compile(r"\w*Warning: .*")
TEXT_FILES = ("report.html", "verdict.json", "variant.yaml", "scenario.yaml", "fit.yaml")
JSON_OUTPUT = "--json"


@dataclass(frozen=True)
class Pair:
    """A command in a folder with its files."""

    number: int
    spec: str
    corruption: str
    command: str
    arguments: tuple[str, ...]
    files: dict[str, str] = field(repr=False)


@dataclass(frozen=True)
class Outcome:
    """The failures of a pair, by kind with details; `cpu_s` and `wall_s` are in seconds."""

    number: int
    spec: str
    corruption: str
    command: str
    exit_code: int
    failures: tuple[str, ...]
    cpu_s: float
    wall_s: float
    ends: str = ""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the missing pairs and report the failures by kind; return 1 if there are any."""
    given = _parser().parse_args(arguments)
    recordings = given.recordings.resolve() if given.recordings else None
    numbers = range(given.pairs) if given.only is None else [given.only]
    suffix = "_recordings" if recordings else ""
    store = FOLDER / f"seed_{given.seed}{suffix}.jsonl"
    known = {} if given.again or given.only is not None else _read_outcomes(store)
    for number in numbers:
        if number in known:
            continue
        pair = draw_pair(given.seed, number, recordings)
        outcome = known[number] = run_pair(pair, given.limit, given.keep)
        store.parent.mkdir(parents=True, exist_ok=True)
        if given.only is None:
            with store.open("a", encoding="utf-8") as file:
                file.write(json.dumps(asdict(outcome)) + "\n")
        print(_format(outcome), file=sys.stderr, flush=True)
    outcomes = [known[number] for number in numbers]
    if given.json:
        print(json.dumps(summarise(outcomes), indent=2))
    else:
        print(format_summary(outcomes))
    return int(any(one.failures for one in outcomes))


def draw_pair(seed: int, number: int, recordings: Path | None = None) -> Pair:
    """Return a pair: always the same for a seed and a number."""
    draw = Random(f"robustness {seed} {number}")
    every = machines(recordings)
    machine, corruption = draw.choice(every), CORRUPTIONS[number % len(CORRUPTIONS)]
    others = tuple(one for one in every if one.automaton.name != machine.automaton.name)
    draft = _draw_draft(draw, machine, others)
    corruption(draw, draft)
    if draw.random() < 0.2:
        with suppress(ValueError, KeyError, IndexError):  # the first may leave nothing to corrupt
            draw.choice(CORRUPTIONS)(draw, draft)
    texts = {f"spec/{name}": text for name, text in machine.texts.items()}
    names: dict[str, list[str]] = {"--train": [], "--held-out": []}
    for option, tables in (("--train", draft.train), ("--held-out", draft.held_out)):
        for k, table in enumerate(tables):
            name = f"{option.strip('-')}_{k}.csv"
            names[option].append(name)
            texts[name] = format_table(table)
            for change in draft.text_changes if k == 0 or draw.random() < 0.5 else ():
                texts[name] = change(texts[name])
    for option in draft.repeated:
        names[option].append(names["--train"][0])
    command = draw.choice(COMMANDS)
    arguments, effects = _arguments(draw, machine, draft.map_name, command, names)
    library = ROOT / "spec" / "effects"
    texts |= {f"effects/{name}": (library / name).read_text("utf-8") for name in effects}
    return Pair(
        number,
        machine.automaton.name,
        corruption.__name__,
        command,
        tuple(arguments),
        texts,
    )


def _draw_draft(draw: Random, machine: Machine, others: tuple[Machine, ...]) -> Draft:
    """Return a pair without faults: one to three recordings, perhaps one that is held out."""
    stride, count = draw.choice((2, 5, 10)), draw.choice((60, 120, 250))
    noise = draw.choice((0.0, 0.003, 0.03))
    tables = [
        draw_recording(draw, machine, count, stride, noise)
        for _ in range(draw.choice((1, 1, 2, 3)) + draw.choice((0, 1)))
    ]
    has_held_out = len(tables) > 1 and draw.random() < 0.5
    train = tables[:-1] if has_held_out else tables
    held_out = tables[-1:] if has_held_out else []
    return Draft(machine, others, train, held_out, machine.map_name, stride)


def _arguments(
    draw: Random,
    machine: Machine,
    map_name: str | None,
    command: str,
    names: dict[str, list[str]],
) -> tuple[list[str], list[str]]:
    """Return the arguments of a command, and the effects of the folder `effects` that it needs."""
    mapping = ["--map", map_name] if map_name else []
    anyway = draw.random() < 0.6
    every = sorted(path.name for path in (ROOT / "spec" / "effects").glob("*.yaml"))
    effects = draw.sample(every, 3)
    as_json = [JSON_OUTPUT] if draw.random() < 0.4 else []
    if command == "python":
        data = [machine.spec, map_name, "effects", names["--train"], names["--held-out"], anyway]
        return [json.dumps(data)], effects
    if command == "check":
        spec = ["--spec", machine.spec] if draw.random() < 0.7 else []
        files = [*names["--train"], *names["--held-out"]]
        plot = ["--plot", "check.png"] if draw.random() < 0.4 else []
        return ["recording", "check", *files, *mapping, *spec, *as_json, *plot], []
    files = [word for name in names["--train"] for word in ("--train", name)]
    options = [*mapping, *(["--anyway"] if anyway else []), *as_json]
    if command == "fit":
        uncertain = [one for one in machine.automaton.parameters if draw.random() < 0.5]
        named = ["--parameters", ",".join(uncertain[:3])] if uncertain else []
        chosen = named if draw.random() < 0.5 else []
        return ["fit", machine.spec, *files, *options, *chosen, "--out", "fit.yaml"], []
    files += [word for name in names["--held-out"] for word in ("--held-out", name)]
    options += ["--effects", "effects", "--budget", BUDGET, "--out", "found"]
    return ["diagnose", machine.spec, *files, *options], effects


def format_table(table: Table) -> str:
    """Return the CSV text of a table."""
    head = ",".join(table)
    rows = [",".join(cells) for cells in zip(*table.values(), strict=False)]
    return "\n".join([head, *rows]) + "\n"


def run_pair(pair: Pair, limit: float = TIME_LIMIT, keep: Path | None = None) -> Outcome:
    """Run the command of a pair in a folder of its own, and return its failures."""
    with tempfile.TemporaryDirectory(prefix="robustness") as name:
        folder = Path(name)
        write_files(pair, folder)
        program = ["-c", PYTHON] if pair.command == "python" else ["-m", "modewright"]
        before, begun = _child_cpu(), time.monotonic()
        try:
            done = subprocess.run(
                [sys.executable, *program, *pair.arguments],
                cwd=folder,
                env=os.environ | ENVIRONMENT,
                capture_output=True,
                text=True,
                timeout=limit,
                check=False,
            )
            code, output, errors = done.returncode, done.stdout, done.stderr
            failures = tuple(find_failures(pair, folder, code, output, errors))
        except subprocess.TimeoutExpired:
            code, output, errors = -1, "", ""
            failures = (f"hang: no end after {limit:g} s",)
        wall = time.monotonic() - begun
        if keep is not None:
            shutil.copytree(folder, keep, dirs_exist_ok=True)
            (keep / "command.txt").write_text(" ".join(map(json.dumps, pair.arguments)) + "\n")
            (keep / "stdout.txt").write_text(output)
            (keep / "stderr.txt").write_text(errors)
        last = [line for line in (errors + output).strip().splitlines() if line.strip()][-1:]
        facts = pair.number, pair.spec, pair.corruption, pair.command
        return Outcome(*facts, code, failures, _child_cpu() - before, wall, "".join(last)[:200])


def write_files(pair: Pair, folder: Path) -> None:
    """Write the files of a pair into a folder."""
    for file, text in pair.files.items():
        (folder / file).parent.mkdir(parents=True, exist_ok=True)
        (folder / file).write_bytes(text.encode())


def find_failures(pair: Pair, folder: Path, code: int, output: str, errors: str) -> Iterator[str]:
    """Yield a text `kind: detail` for each failure of a command."""
    if "Traceback (most recent call last)" in errors + output:
        yield f"traceback: {_innermost_frame(errors + output)}"
    report = REPORT_PATH.search(errors)
    if report:
        path = Path(report[1])
        yield f"defect: {_innermost_frame(path.read_text('utf-8'))}"
        path.unlink()
    elif code not in (0, 1) and not (code == 2 and USAGE.search(errors)):
        yield f"exit code: {code} {' '.join(errors.split())[-200:]}"
    if code and not errors.strip() and not output.strip():
        yield f"silent: exit code {code} without a message"
    for warning in dict.fromkeys(WARNING.findall(errors)):
        yield f"warning: {warning}"
    texts = {"stdout": output, "stderr": errors}
    for name in TEXT_FILES:
        for path in folder.rglob(name):
            texts[name] = path.read_text("utf-8")
    if code == 0 and pair.command == "diagnose" and "verdict.json" not in texts:
        yield "no verdict: exit code 0"
    for name, text in texts.items():
        is_json = name == "verdict.json" or (name == "stdout" and JSON_OUTPUT in pair.arguments)
        if is_json and text.strip():
            yield from _json_failures(name, text)
        if name == "report.html":
            text = html.unescape(TAGS.sub("\n", text))
        yield from _words(name, text)


def _json_failures(name: str, text: str) -> Iterator[str]:
    """Yield a failure if a text is no strict JSON."""
    constants: list[str] = []
    try:
        json.loads(text, parse_constant=constants.append)
    except ValueError as error:
        yield f"json: {name} {error}"
    if constants:
        yield f"json: {name} has {constants[0]}"


def _words(name: str, text: str) -> Iterator[str]:
    """Yield a failure for each line that has a number that is not finite, or None, as a word."""
    found = dict.fromkeys(
        line.strip()
        for line in QUOTED.sub("``", text).splitlines()
        if NON_FINITE.search(line) and not (name == "stderr" and SOURCE_LINE.fullmatch(line))
    )
    for line in list(found)[:3]:
        yield f"word: {name}: {line[:160]}"


def _innermost_frame(text: str) -> str:
    """Return the last frame of a traceback with its exception."""
    frames = FRAME.findall(text)
    lines = [line for line in text.splitlines() if EXCEPTION.match(line)]
    last = lines[-1][:160] if lines else ""
    return f"{frames[-1][0]}:{frames[-1][1]} {frames[-1][2]}: {last}" if frames else last


def _child_cpu() -> float:
    """Return the CPU time [s] of the processes that have ended."""
    use = resource.getrusage(resource.RUSAGE_CHILDREN)
    return use.ru_utime + use.ru_stime


def _read_outcomes(store: Path) -> dict[int, Outcome]:
    """Return the stored outcomes by number."""
    lines = store.read_text("utf-8").splitlines() if store.exists() else []
    found = [json.loads(line) for line in lines]
    return {one["number"]: Outcome(**{**one, "failures": tuple(one["failures"])}) for one in found}


def summarise(outcomes: Sequence[Outcome]) -> dict[str, object]:
    """Return the numbers of a study as an object for JSON."""
    kinds = Counter(failure.partition(":")[0] for one in outcomes for failure in one.failures)
    return {
        "pairs": len(outcomes),
        "failed": sum(bool(one.failures) for one in outcomes),
        "kinds": dict(kinds.most_common()),
        "exit_codes": dict(sorted(Counter(str(one.exit_code) for one in outcomes).items())),
        "cpu_s": round(sum(one.cpu_s for one in outcomes), 1),
        "longest_s": round(max((one.wall_s for one in outcomes), default=0.0), 1),
        "failures": [asdict(one) for one in outcomes if one.failures],
    }


def format_summary(outcomes: Sequence[Outcome]) -> str:
    """Return the numbers of a study as text."""
    facts = summarise(outcomes)
    lines = [_format(one) for one in outcomes if one.failures]
    lines.append(f"{facts['pairs']} pairs, {facts['failed']} failed, {facts['cpu_s']} s of CPU")
    lines.append(f"exit codes {facts['exit_codes']}, the longest took {facts['longest_s']} s")
    lines.append(f"failures by kind: {facts['kinds'] or 'none'}")
    return "\n".join(lines)


def _format(outcome: Outcome) -> str:
    """Return an outcome in one line, with its failures in further lines."""
    head = f"{outcome.number}: {outcome.command} {outcome.spec}, {outcome.corruption}"
    tail = f"exit {outcome.exit_code}, {outcome.cpu_s:.1f} s: {outcome.ends}"
    return "\n".join([f"{head}: {tail}", *(f"    {failure}" for failure in outcome.failures)])


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m tests.validation.properties.robustness",
        description=__doc__,
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--pairs", type=int, default=300, help="number of pairs (300)")
    parser.add_argument("--seed", type=int, default=1, help="seed of the pairs (1)")
    parser.add_argument("--recordings", type=Path, help="folder of real machines, as further specs")
    parser.add_argument("--limit", type=float, default=TIME_LIMIT, help="time limit [s] (300)")
    parser.add_argument("--only", type=int, help="run one pair, and store nothing")
    parser.add_argument("--keep", type=Path, help="copy the files and the output of pairs here")
    parser.add_argument("--again", action="store_true", help="run stored pairs again")
    parser.add_argument("--json", action="store_true", help="print the summary as JSON")
    return parser


if __name__ == "__main__":
    sys.exit(main())
