"""Rivals: other tools of Python, each in an environment of its own below build/."""

from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent.parent
UV = ROOT / ".tools" / "uv"
RIVALS = {
    "diffrax": ("with_diffrax", "diffrax"),
    "pathsim": ("with_pathsim", "pathsim"),
    "jaxonomy": ("with_jaxonomy", "jaxonomy>=3"),
    "scikit-sundae": ("with_sundae", "scikit-sundae"),
}
"""The module that runs the manoeuvre, and the package that it needs."""
COMMON = ("mpmath", "scipy")
SECONDS = 900
"""Longest installation or measurement before it is given up."""


class RivalMissing(Exception):
    """A rival cannot be measured: the message says what is missing."""


def measure_rival(name: str, pairs: int) -> dict[str, Any]:
    """Return a rival's processor time over that of scipy, and its errors. Raises RivalMissing."""
    module, package = RIVALS[name]
    python = _environment(name, package)
    command = [str(python), "-m", "tests.benchmark.run_competitor", module, str(pairs)]
    environ = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = _run(name, command, environ)
    found: dict[str, Any] = json.loads(done.splitlines()[-1])
    return found


def _environment(name: str, package: str) -> Path:
    """Return the Python of a rival's environment, made if it is not there."""
    folder = ROOT / "build" / "rivals" / name
    python = folder / "bin" / "python"
    if not (folder / "ready").exists():
        if not UV.exists():
            raise RivalMissing(f"{name}: {UV} is missing: make setup")
        base = str(ROOT / ".venv" / "bin" / "python")
        _run(name, [str(UV), "venv", "--quiet", "--clear", "--python", base, str(folder)])
        install = [str(UV), "pip", "install", "--quiet", "--python", str(python)]
        _run(name, [*install, package, *COMMON])
        (folder / "ready").touch()
    return python


def _run(name: str, command: list[str], environ: dict[str, str] | None = None) -> str:
    try:
        done = subprocess.run(
            command,
            capture_output=True,
            text=True,
            cwd=ROOT,
            env=environ,
            timeout=SECONDS,
            check=False,
        )
    except subprocess.TimeoutExpired:
        raise RivalMissing(f"{name}: nothing after {SECONDS} s: {' '.join(command)}") from None
    if done.returncode:
        said = (done.stderr or done.stdout).strip().splitlines() or ["no message"]
        raise RivalMissing(f"{name}: {' '.join(command[:3])} ...: {said[-1]}")
    return done.stdout
