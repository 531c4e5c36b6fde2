"""Makes .venv from uv.lock: exact versions, checked hashes, any package index. `make setup`.

`uv sync` downloads from the addresses written in uv.lock, so it fails where only a mirror can be
reached. Here the lock is exported as pinned requirements with hashes instead, and these are
installed from whatever index the user's pip or uv is configured for. Standard library only.
"""

import fcntl
import hashlib
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from fetch_uv import ADVICE, OUT_OF_REACH, main as fetch_uv_into
from package_index_settings import index_settings

ROOT = Path(__file__).resolve().parent.parent
UV = ROOT / ".tools" / "uv"
VENV = ROOT / ".venv"
STAMP = VENV / ".set-up"
INPUTS = ("pyproject.toml", "uv.lock", "tools/create_venv.py")

# Of the surrounding shell: these would aim uv or Python at another environment.
FOREIGN = (
    "CONDA_PREFIX",
    "PYTHONHOME",
    "PYTHONPATH",
    "UV_PROJECT",
    "UV_PROJECT_ENVIRONMENT",
    "UV_PYTHON",
    "UV_REQUIRE_HASHES",
    "UV_SYSTEM_PYTHON",
    "UV_WORKING_DIR",
    "VIRTUAL_ENV",
)


def set_up() -> int:
    """Bring .venv up to date with uv.lock; do nothing if it is. Returns the exit code."""
    with alone():
        digest = digest_of_inputs()
        if not (is_sound(VENV) and STAMP.is_file() and STAMP.read_text() == digest):
            print("setting up .venv from uv.lock", file=sys.stderr)
            if code := fetch_uv_into(str(UV)) or install(environment_for_uv()):
                return code
            STAMP.write_text(digest)
        STAMP.touch()
    return 0


@contextmanager
def alone() -> Iterator[None]:
    """Hold the lock of the set-up: a second one waits for the first."""
    UV.parent.mkdir(exist_ok=True)
    with (UV.parent / "lock").open("w") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        yield


def digest_of_inputs() -> str:
    """A digest of all that determines the content of .venv."""
    digest = hashlib.sha256()
    for name in INPUTS:
        digest.update((ROOT / name).read_bytes())
    return digest.hexdigest()


def is_sound(venv: Path) -> bool:
    """Whether an environment's Python still runs and is new enough."""
    python = venv / "bin" / "python"
    question = "import sys; sys.exit(sys.version_info < (3, 11))"
    return python.exists() and subprocess.run([python, "-c", question], check=False).returncode == 0


def environment_for_uv() -> dict[str, str]:
    """The environment for uv: the user's, with pip's settings in uv's words."""
    environ = {name: value for name, value in os.environ.items() if name not in FOREIGN}
    environ |= index_settings(os.environ)
    environ["UV_PYTHON_DOWNLOADS"] = "never"
    if not (environ.get("UV_CACHE_DIR") or environ.get("XDG_CACHE_HOME") or has_home(environ)):
        environ["UV_CACHE_DIR"] = str(UV.parent / "cache")
    return environ


def has_home(environ: dict[str, str]) -> bool:
    """Whether there is a home folder in which uv can keep its cache."""
    return os.access(environ.get("HOME") or os.devnull, os.R_OK | os.W_OK | os.X_OK)


def install(environ: dict[str, str]) -> int:
    """Create .venv if need be and install the locked packages and the project itself."""
    with tempfile.TemporaryDirectory() as folder:
        pinned = f"{folder}/requirements.txt"
        steps: list[list[str]] = [
            ["export", "--frozen", "--no-emit-project", "--no-header", "--output-file", pinned],
            # Bytecode is made here, by all cores, and not by the first who import a package.
            ["pip", "sync", "--compile-bytecode", *index_options(environ), pinned],
            # The build backend is in the lock, too: nothing is fetched for building.
            ["pip", "install", "--no-deps", "--no-build-isolation", "--editable", "."],
        ]
        if not is_sound(VENV):
            steps.insert(
                0, ["venv", "--clear", "--no-project", "--python", sys.executable, str(VENV)]
            )
        environ = environ | {"VIRTUAL_ENV": str(VENV)}
        for step in steps:
            command = [str(UV), "--quiet", *step]
            if subprocess.run(command, cwd=ROOT, env=environ, check=False).returncode != 0:
                stop = f"set-up stopped at `uv {step[0]} {step[1]}`, see above"
                print(f"{stop}; for want of a package, {ADVICE}", file=sys.stderr)
                return OUT_OF_REACH
    own = [ROOT / "tests", *sorted(path.parent for path in ROOT.glob("*/__init__.py"))]
    # What cannot be compiled is told where it is imported.
    compiling = [str(VENV / "bin" / "python"), "-m", "compileall", "-qq", "-j", "0"]
    subprocess.run([*compiling, *map(str, own)], check=False)
    return 0


def index_options(environ: dict[str, str]) -> list[str]:
    """The options on indexes for which uv has no variable, or another default than pip."""
    # Every file must have the hash of the lock, so it may come from any of the indexes.
    strategy = environ.get("UV_INDEX_STRATEGY", "unsafe-best-match")
    options = ["--require-hashes", "--index-strategy", strategy]
    return [*options, "--no-index"] if environ.get("UV_NO_INDEX") else options


if __name__ == "__main__":
    sys.exit(set_up())
