"""Demo data: simulated recordings that the package contains, and their diagnosis.

The recordings of a DemoMachine have an effect that its model lacks; `truth.json` names the effect.
`tests/generators/open_cases/demo_cases.py` writes the files.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Any

from diagnosis.report.diagnosis_report import DiagnosisReport
from language.text.arguments import PathText, to_path
from modewright.api.diagnosis import diagnose
from modewright.runtime.output_files import OutputError, make_folder, write_files


@dataclass(frozen=True)
class DemoMachine:
    """A simulated machine: folder of its recordings, name of its model, and a description."""

    folder: str
    spec: str
    about: str

    @property
    def train(self) -> tuple[str, ...]:
        """The training recordings, relative to the folder of the demo data."""
        return tuple(f"recordings/{self.folder}/train_{number}.csv" for number in (1, 2, 3))

    @property
    def held_out(self) -> str:
        """The held-out recording, relative to the folder of the demo data."""
        return f"recordings/{self.folder}/held_out.csv"

    @property
    def results(self) -> str:
        """The folder of results, relative to the folder of the demo data."""
        return f"found_{self.folder}"


MACHINES = {
    "friction": DemoMachine(
        "friction", "blind_driveline", "an electric driveline with dry friction at the motor"
    ),
    "hysteresis": DemoMachine(
        "hysteresis",
        "paper_driveline",
        "tip-outs of a driveline whose half-shafts lose energy by internal friction",
    ),
}
"""The machines by name; the model of each lacks the effect that its description names."""


@dataclass(frozen=True)
class DemoDiagnosis:
    """The report of a diagnosis beside the true effects: dicts with id, place, parameters."""

    machine: DemoMachine
    report: DiagnosisReport
    truth: tuple[dict[str, Any], ...]

    @property
    def is_right(self) -> bool:
        """Whether the verdict names the true effects at their places and no others."""
        named = {(one.id, one.place) for one in self.report.verdict.effects}
        return named == {(one["id"], one["place"]) for one in self.truth}


def demo_files() -> dict[str, bytes]:
    """Return the files of the demo data by relative path, in order of the paths."""
    root = resources.files("modewright.api") / "demo_data_files"
    folders, files = [("", root)], {}
    while folders:
        prefix, folder = folders.pop()
        for one in folder.iterdir():
            if one.is_dir():
                folders.append((f"{prefix}{one.name}/", one))
            else:
                files[f"{prefix}{one.name}"] = one.read_bytes()
    return dict(sorted(files.items()))


def write_demo_data(folder: PathText) -> list[Path]:
    """Write the demo data into a folder; return the paths.

    Raises OutputError if a file of the same name has other content, and writes nothing then.
    """
    folder = to_path(folder, "folder")
    make_folder(folder)
    files = {folder / name: data for name, data in demo_files().items()}
    for path, data in files.items():
        if os.path.lexists(path) and not (path.is_file() and path.read_bytes() == data):
            raise OutputError(f"{path}: there is another file of this name; name a new folder")
    for parent in dict.fromkeys(path.parent for path in files):
        make_folder(parent)
    write_files(files)
    return list(files)


def diagnose_demo(
    name: str, folder: PathText, tell: Callable[[str], None] = lambda text: None
) -> DemoDiagnosis:
    """Write the demo data into a folder and diagnose one of MACHINES there.

    The report is in the folder `results` of the machine. `tell` is called with lines of progress.
    Raises ValueError for an unknown name, OutputError, and MissingToolError without a C compiler.
    """
    if name not in MACHINES:
        raise ValueError(f"`{name}` is no machine of the demo: {', '.join(MACHINES)}")
    machine, folder = MACHINES[name], to_path(folder, "folder")
    write_demo_data(folder)
    report = diagnose(
        machine.spec,
        [folder / one for one in machine.train],
        [folder / machine.held_out],
        root=folder,
        out=folder / machine.results,
        tell=tell,
    )
    text = (folder / "recordings" / machine.folder / "truth.json").read_text("ascii")
    return DemoDiagnosis(machine, report, tuple(json.loads(text)["effects"]))
