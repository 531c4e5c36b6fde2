"""Isolated process: one case diagnosed in a folder of a random name, by a process of its own."""

from __future__ import annotations

import json
import os
import secrets
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib.resources import files
from pathlib import Path
from typing import Any

from tests.validation.evidence.evidence_store import ROOT
from tests.validation.study.generator_table import IN_CASE_FOLDER

MAX_TIME = 900.0
"""Time after which a diagnosis is ended [s]."""
FILES = {"added_inertia": ("compliance",), "second_gap": ("backlash", "second_gap")}
"""The files of the library that contain an effect, if they are not one of its name."""
ENVIRONMENT = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "PYTHONPATH": str(ROOT)}


@dataclass(frozen=True)
class Result:
    """A verdict and the numbers of its decision, as JSON; empty without a verdict, see `message`.

    Times are in seconds; `cpu_s` contains `compiler_s`, the time of the C compiler. `simpler` is
    what each simpler method names.
    """

    verdict: Mapping[str, Any] = field(default_factory=dict)
    decision: Mapping[str, Any] = field(default_factory=dict)
    cpu_s: float = 0.0
    compiler_s: float = 0.0
    wall_s: float = 0.0
    message: str = ""
    simpler: Mapping[str, str] = field(default_factory=dict)


def diagnose_case(
    case: Path, spec: str, without: tuple[str, ...] = (), with_baselines: bool = False
) -> Result:
    """Diagnose a copy of a case on one core, with some effects removed from the library.

    `spec` is a spec of the product or `IN_CASE_FOLDER`.
    """
    with tempfile.TemporaryDirectory(prefix="diagnosis") as folder:
        copy, result = Path(folder) / secrets.token_hex(8), Path(folder) / "result.json"
        shutil.copytree(case, copy)
        options = [] if spec == IN_CASE_FOLDER else ["--spec", spec]
        if without:
            options += ["--effects", str(_copy_library(Path(folder) / "effects", without))]
        if with_baselines:
            options.append("--baselines")
        module = "tests.validation.study.isolated_diagnosis"
        command = [sys.executable, "-m", module, str(copy), str(result), *options]
        try:
            done = subprocess.run(
                command,
                cwd=folder,
                env=os.environ | ENVIRONMENT,
                capture_output=True,
                text=True,
                timeout=MAX_TIME,
                check=False,
            )
        except subprocess.TimeoutExpired:
            message = f"no verdict after {MAX_TIME:g} s"
            return Result(cpu_s=MAX_TIME, wall_s=MAX_TIME, message=message)
        if done.returncode or not result.exists():
            last = done.stderr.strip().splitlines()[-1:]
            return Result(message=f"exit code {done.returncode}: {' '.join(last)}")
        return Result(**json.loads(result.read_text()))


def _copy_library(folder: Path, without: tuple[str, ...]) -> Path:
    """Copy the effect library without some effects to a folder; return the folder.

    Raises FileNotFoundError for an effect that the library does not have.
    """
    shutil.copytree(Path(str(files("spec"))) / "effects", folder)
    for file in {file for name in without for file in FILES.get(name, (name,))}:
        (folder / f"{file}.yaml").unlink()
    return folder
