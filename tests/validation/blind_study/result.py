"""Result: what a sealed diagnosis says of a case in a folder of a random name."""

from __future__ import annotations

import json
import os
import secrets
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import Any

from tests.validation.evidence.evidence_store import ROOT

LONGEST = 900.0
"""Time after which a diagnosis is given up [s]."""
FILES = {"added_inertia": ("compliance",), "second_gap": ("backlash", "second_gap")}
"""The files of the library that hold an effect, where they are not one of its name."""
ALONE = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "PYTHONPATH": str(ROOT)}


@dataclass(frozen=True)
class Result:
    """A verdict as JSON text, empty where there is none; `message` says why. Times in seconds.

    `compiler_s` is what the C compiler took of `cpu_s`. `sindy` and `free_gain` are what simpler
    methods name (see baseline).
    """

    verdict: str
    cpu_s: float
    compiler_s: float
    wall_s: float
    message: str = ""
    sindy: str = ""
    free_gain: str = ""


def diagnose_case(case: Path, without: tuple[str, ...] = (), is_compared: bool = True) -> Result:
    """Diagnose a copy of a case on one core, with some effects taken out of the library.

    Simpler methods are asked where they are compared with.
    """
    with tempfile.TemporaryDirectory(prefix="sealed") as folder:
        copy = Path(folder) / secrets.token_hex(8)
        shutil.copytree(case, copy)
        found = Path(folder) / "found.json"
        library = [str(_library(Path(folder) / "effects", without))] if without else []
        alone = [] if is_compared else ["--alone"]
        given = [str(copy), str(found), *library, *alone]
        command = [sys.executable, "-m", "tests.validation.blind_study.isolated_diagnosis", *given]
        try:
            done = subprocess.run(
                command,
                cwd=folder,
                env=os.environ | ALONE,
                capture_output=True,
                text=True,
                timeout=LONGEST,
                check=False,
            )
        except subprocess.TimeoutExpired:
            return Result("", LONGEST, 0.0, LONGEST, f"no verdict after {LONGEST:g} s")
        if done.returncode or not found.exists():
            last = done.stderr.strip().splitlines()[-1:]
            return Result("", 0.0, 0.0, 0.0, f"exit code {done.returncode}: {' '.join(last)}")
        kept: dict[str, Any] = json.loads(found.read_text())
    took = (kept[name] for name in ("cpu_s", "compiler_s", "wall_s"))
    return Result(json.dumps(kept["verdict"]), *took, **kept["baselines"])


def _library(folder: Path, without: tuple[str, ...]) -> Path:
    """Copy the effects that are shipped but some of them."""
    with_all = Path(str(files("spec"))) / "effects"
    shutil.copytree(with_all, folder)
    for name in without:
        for file in FILES.get(name, (name,)):
            (folder / f"{file}.yaml").unlink()
    return folder
