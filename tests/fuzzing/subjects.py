"""Subjects: small valid files of each format that the product reads, and what reads them."""

from __future__ import annotations

import contextlib
import gzip
import io
import re
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import asammdf
import can
import numpy as np
import pyarrow
import pyarrow.parquet

from codegen.toolchain.templates import template_environment
from modewright.api import recordings, runs, simulation, studies
from modewright.cli.app import app

STUDIES = Path(__file__).parent.parent / "data" / "studies"
SPEC = """\
language: 1
automaton: selector
period: 10 ms
numbers: float64
inputs:
  u: {unit: N*m, range: [-1000, 1000]}
  key: {type: bool, default: false}
discrete: {turns: {type: int, initial: 0, range: [0, 1000]}}
initial: low
modes:
  low: {update: {turns: turns + 1}, transitions: {high: {when: u > 10 N*m or key, wait: 20 ms}}}
  high: {transitions: {low: {when: u < 5 N*m}}}
outputs: [mode, turns]
"""
MACHINE = """\
language: 1
automaton: rig
step: 1 ms
parameters: {J: {value: 2 kg*m^2, range: [1, 3]}, c: {value: 0.5 N*m*s/rad}}
inputs: {T_m: {unit: N*m}}
states: {w: {unit: rad/s, initial: 0 rad/s, range: [-500, 500]}}
flow: {w: J * der(w) = T_m - c * w}
elements: {rotor: {kind: inertia, speed: w, inertia: J}}
outputs: [w]
"""
SCENARIO = """\
language: 1
scenario: push
of: rig
horizon: 0.2 s
inputs: {T_m: {start: 0, steps: {50 ms: 3}}}
record: {every: 5 ms}
"""
MAP = """\
language: 1
map: bench
time: {column: t, unit: s}
dbc: ../car.dbc
columns:
  u: {to: u, unit: N*m, blank: skip}
"""
DBC = """\
VERSION ""
NS_ :
BS_:
BU_: ECU
BO_ 256 Motor: 4 ECU
 SG_ u : 0|16@1- (0.25,0) [0|0] "Nm" ECU
 SG_ gear : 16|8@1+ (1,0) [0|3] "" ECU
CM_ SG_ 256 u "torque";
VAL_ 256 gear 0 "park" 1 "drive" ;
"""
VALUES = [round(20 * np.sin(0.4 * k), 3) for k in range(40)]


@dataclass(frozen=True)
class Subject:
    """A file that is mutated, and the readings of it.

    `neutral` are mutations that change nothing of the content. `digest` returns what is read, for
    the comparison with the unchanged file; it raises what the product raises.
    """

    file: str
    read: Callable[[Path], object]
    neutral: tuple[Callable[[bytes], bytes], ...] = ()


def write_project(folder: Path) -> Path:
    """Write a project with one file of each format; return the folder."""
    spec = folder / "spec"
    spec.mkdir(parents=True)
    for name, text in (("selector", SPEC), ("rig", MACHINE), ("push", SCENARIO), ("bench", MAP)):
        (spec / f"{name}.yaml").write_text(text, "utf-8")
    (folder / "car.dbc").write_text(DBC, "utf-8")
    rows = [f"{0.01 * k:.2f},{value},{k % 2}" for k, value in enumerate(VALUES)]
    (folder / "run.csv").write_text("\n".join(["t,u,key", *rows]) + "\n", "utf-8")
    stamps = np.array([0.01 * k for k in range(len(VALUES))])
    table = pyarrow.table({"t": stamps, "u": VALUES})
    pyarrow.parquet.write_table(table, folder / "run.parquet")
    with contextlib.redirect_stdout(io.StringIO()):
        measured = asammdf.MDF(version="4.10")
        flags = np.array([k % 7 == 3 for k in range(len(VALUES))])
        names = {"val_0": 0, "text_0": "off", "val_1": 1, "text_1": "on", "default": b"?"}
        bits = np.array([k % 2 for k in range(len(VALUES))], dtype=np.uint8)
        raw = np.round(np.array(VALUES) * 10).astype(np.int16)
        measured.append(
            [
                asammdf.Signal(np.array(VALUES), stamps, "Nm", "u", invalidation_bits=flags),
                asammdf.Signal(bits, stamps, name="key", conversion=names),
                asammdf.Signal(raw, stamps, "A", "i", conversion={"a": 0.1, "b": 0.0}),
            ]
        )
        note = np.array([f"note {k}".encode() for k in range(20)])
        measured.append([asammdf.Signal(note, stamps[:20], name="note", encoding="utf-8")])
        measured.save(folder / "run.mf4")
        measured.close()
    frames = [int(value / 0.25) & 0xFFFF for value in VALUES]
    words = [f"{raw & 255:02X}{raw >> 8:02X}0100" for raw in frames]
    log = [f"({1.0 + 0.01 * k:.6f}) can0 100#{word}" for k, word in enumerate(words)]
    (folder / "run.log").write_text("\n".join(log) + "\n", "utf-8")
    asc = [f"{0.01 * k:.6f} 1 100 Rx d 4 {bytes.fromhex(w).hex(' ')}" for k, w in enumerate(words)]
    head = ["date Mon Jan 1 10:00:00.000 am 2024", "base hex timestamps absolute"]
    (folder / "run.asc").write_text("\n".join([*head, *asc]) + "\n", "utf-8")
    starts = [f"{10000 * k},00000100,false,0,4,{word}" for k, word in enumerate(words)]
    frame_rows = [",".join([row[:-9], *re.findall("..", row[-8:])]) for row in starts]
    first = "Time Stamp,ID,Extended,Bus,LEN,D1,D2,D3,D4"
    (folder / "frames.csv").write_text("\n".join([first, *frame_rows]) + "\n", "utf-8")
    trc = [f"{k + 1:6})   {10 * k:8}.0  Rx  0100  4  {bytes.fromhex(w).hex(' ')}" for k, w in
           enumerate(words)]  # fmt: skip
    (folder / "run.trc").write_text("\n".join([";$FILEVERSION=1.1", *trc]) + "\n", "utf-8")
    with can.BLFWriter(folder / "run.blf") as writer:
        for k, word in enumerate(words):
            data = bytes.fromhex(word)
            writer(can.Message(1.0 + 0.01 * k, 0x100, is_extended_id=False, channel=0, data=data))
    (folder / "run.csv.gz").write_bytes(gzip.compress((folder / "run.csv").read_bytes()))
    trajectory = simulation.simulate("rig", "push", root=folder)
    for name in ("sim.csv", "other.csv", "sim.parquet"):
        runs.save(trajectory, folder / name)
    shutil.copytree(STUDIES / "spec", folder / "study" / "spec")
    studies.sweep("grid", folder / "study" / "out", samples=None, workers=1, root=folder / "study")
    return folder


def replay(name: str) -> Callable[[Path], object]:
    """Return a reading that replays a recording."""

    def read(folder: Path) -> object:
        found = simulation.replay("selector", folder / name, "bench", root=folder, compiled=False)
        signals = found.result.trajectory.signals
        return [(key, values.tobytes()) for key, values in signals.items()]

    return read


def check(folder: Path, name: str) -> object:
    """Read a recording without a map, as `recording check` does."""
    found = recordings.check_recordings([folder / name], databases=[str(folder / "car.dbc")])
    return [(one.name, one.low, one.high) for one in found.check.channels]


def compare(name: str) -> Callable[[Path], object]:
    """Return a reading that compares a run with an equal one."""

    def read(folder: Path) -> object:
        found = runs.compare(folder / name, folder / "other.csv")
        return [found.is_within, found.samples]

    return read


def run_command(*words: str) -> Callable[[Path], object]:
    """Return a reading by the command line; the result is what is printed."""

    def read(folder: Path) -> object:
        text = io.StringIO()
        with contextlib.redirect_stdout(text):
            code = app([word.format(folder) for word in words], standalone_mode=False)
        return code or text.getvalue()

    return read


def continue_study(folder: Path) -> object:
    """Continue a finished study; nothing is computed if its store is as it was."""
    found = studies.sweep("grid", folder / "study" / "out", workers=1, root=folder / "study")
    return found.lost_blocks


def generate(folder: Path) -> object:
    """Print C with the cached templates of the folder."""
    template_environment.cache_clear()
    read = run_command("generate", "{0}/spec/selector.yaml", "--out", "{0}/c")
    read(folder)
    return (folder / "c" / "selector.c").read_bytes()


def simulate(folder: Path) -> object:
    """Simulate the machine in its scenario."""
    run = simulation.simulate("rig", "push", root=folder, compiled=False)
    return [(name, values.tobytes()) for name, values in run.signals.items()]


def propose(name: str) -> Callable[[Path], object]:
    """Return a reading that proposes a map of a recording."""
    return lambda folder: recordings.propose_map(
        folder / name, "selector", [str(folder / "car.dbc")], root=folder
    ).partition("columns:")[2]


def crlf(data: bytes) -> bytes:
    return data.replace(b"\n", b"\r\n")


def mark(data: bytes) -> bytes:
    return b"\xef\xbb\xbf" + data


def blank_end(data: bytes) -> bytes:
    return data + b"\n\n"


def quoted(data: bytes) -> bytes:
    lines = [b",".join(b'"' + c + b'"' for c in one.split(b",")) for one in data.split(b"\n")[:-1]]
    return b"\n".join(lines) + b"\n"


def semicolons(data: bytes) -> bytes:
    return data.replace(b",", b";")


def comment(data: bytes) -> bytes:
    return b"# a comment\n" + data


def spaces(data: bytes) -> bytes:
    return data.replace(b",", b" , ")


TEXT = (crlf, blank_end)
SUBJECTS: dict[str, Subject] = {
    "csv": Subject(
        "run.csv", replay("run.csv"), (*TEXT, mark, quoted, semicolons, comment, spaces)
    ),
    "csv without map": Subject("run.csv", lambda f: check(f, "run.csv"), (*TEXT, mark)),
    "proposal from csv": Subject("run.csv", propose("run.csv"), TEXT),
    "proposal from dbc": Subject("car.dbc", propose("run.log"), TEXT),
    "mf4 without map": Subject("run.mf4", lambda f: check(f, "run.mf4")),
    "log without map": Subject("run.log", lambda f: check(f, "run.log"), TEXT),
    "parquet": Subject("run.parquet", replay("run.parquet")),
    "mf4": Subject("run.mf4", replay("run.mf4")),
    "candump": Subject("run.log", replay("run.log"), TEXT),
    "asc": Subject("run.asc", replay("run.asc"), TEXT),
    "trc": Subject("run.trc", replay("run.trc"), TEXT),
    "blf": Subject("run.blf", replay("run.blf")),
    "table of frames": Subject("frames.csv", replay("frames.csv"), TEXT),
    "csv in gzip": Subject("run.csv.gz", replay("run.csv.gz")),
    "dbc": Subject("car.dbc", replay("run.log"), TEXT),
    "map": Subject("spec/bench.yaml", replay("run.csv"), (*TEXT, mark, comment)),
    "spec": Subject(
        "spec/selector.yaml",
        run_command("check", "{}/spec/selector.yaml"),
        (*TEXT, mark, comment),
    ),
    "machine": Subject("spec/rig.yaml", simulate, (*TEXT, comment)),
    "scenario": Subject("spec/push.yaml", simulate, (*TEXT, comment)),
    "side file": Subject("sim.csv.json", compare("sim.csv"), TEXT),
    "run": Subject("sim.csv", compare("sim.csv"), (crlf,)),
    "run in parquet": Subject("sim.parquet", compare("sim.parquet")),
    "store": Subject("study/out/*", continue_study),
    "cache": Subject("cache/templates/*", generate),
}
