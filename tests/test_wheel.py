"""The wheel, installed into an environment of its own, used in a folder with the same names."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import sysconfig
import tomllib
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
TRACE = ROOT / "tests" / "data" / "paper" / "est_paper_tip_out_1kHz.csv.gz"
BUILD = "import sys; from setuptools.build_meta import build_wheel; build_wheel(sys.argv[1])"
HOSTILE = (
    "spec",
    "engine",
    "codegen",
    "language",
    "expectation",
    "lockstep",
    "sweep",
    "diagnosis",
    "tests",
)


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel of a copy of what is packaged: nothing is written into the project."""
    copy = tmp_path_factory.mktemp("source")
    with (ROOT / "pyproject.toml").open("rb") as file:
        packages = tomllib.load(file)["tool"]["setuptools"]["packages"]
    for name in {package.split(".")[0] for package in packages}:
        shutil.copytree(ROOT / name, copy / name, ignore=shutil.ignore_patterns("__pycache__"))
    for name in ("pyproject.toml", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, copy)
    out = tmp_path_factory.mktemp("wheel")
    command = [sys.executable, "-c", BUILD, str(out)]
    subprocess.run(command, cwd=copy, check=True, capture_output=True)
    (found,) = out.glob("*.whl")
    return found


@pytest.fixture(scope="module")
def python(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The Python of an environment that holds the wheel, and our dependencies by a path file."""
    folder = tmp_path_factory.mktemp("environment") / "venv"
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", str(folder)], check=True)
    python = folder / "bin" / "python"
    uv = [str(ROOT / ".tools" / "uv"), "pip", "install", "--quiet", "--offline", "--no-deps"]
    subprocess.run([*uv, "--no-config", "--python", str(python), str(wheel)], check=True)
    (site,) = folder.glob("lib/python*/site-packages")
    (site / "dependencies.pth").write_text(sysconfig.get_path("purelib") + "\n")
    return python


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A user's folder whose packages have our names and fail when they are imported."""
    made = tmp_path_factory.mktemp("user")
    for name in HOSTILE:
        (made / name).mkdir()
        (made / name / "__init__.py").write_text(f"raise RuntimeError('{name} of the user')\n")
    (made / "typer.py").write_text("raise RuntimeError('typer of the user')\n")
    return made


def run(command: list[str | Path], folder: Path) -> str:
    environ = {k: v for k, v in os.environ.items() if not k.startswith(("PYTHON", "VIRTUAL"))}
    environ["MODEWRIGHT_CACHE"] = str(folder / "cache")
    done = subprocess.run(
        [str(part) for part in command], cwd=folder, env=environ, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_the_wheel_holds_specs_templates_and_the_skeleton_but_no_tests(wheel: Path) -> None:
    names = zipfile.ZipFile(wheel).namelist()
    for name in (
        "spec/ev_driveline/plant.yaml",
        "codegen/templates/module.c.jinja",
        "codegen/templates/fmi/fmi_3.c.jinja",
        "codegen/fmi/headers/fmi3Functions.h",
        "language/expression.lark",
        "modewright/skeleton_files/room.yaml",
        "diagnosis/drifts/drift_of_balance.yaml",
        "diagnosis/templates/report.html.jinja",
        "spec/verdict.schema.json",
        "engine/py.typed",
    ):
        assert name in names
    assert [name for name in names if name.startswith(("tests/", "docs/", "generated/"))] == []


@pytest.mark.long
@pytest.mark.parametrize(
    "arguments",
    [
        ["demo", "--out", "shown"],
        ["generate", "estimator", "--out", "c"],
        ["replay", "estimator", TRACE, "--map", "reference_trace"],
        ["new", "warm_room"],
        ["effects", "road_grade", "--at", "blind_driveline"],
    ],
    ids=lambda arguments: str(arguments[0]),
)
def test_the_installed_command_works_in_a_folder_with_our_names(
    arguments: list[str | Path], python: Path, folder: Path
) -> None:
    assert run([python.parent / "modewright", *arguments], folder)


def test_python_dash_m_does_not_look_into_the_working_folder(python: Path, folder: Path) -> None:
    told = run([python, "-m", "modewright", "check", "estimator"], folder)
    assert told == "1 spec checked, 0 problems\n"


def test_a_script_beside_such_folders_gets_our_packages(python: Path, folder: Path) -> None:
    script = folder / "work" / "script.py"
    script.parent.mkdir(exist_ok=True)
    for name in ("engine", "language", "spec"):
        shutil.copytree(folder / name, script.parent / name, dirs_exist_ok=True)
    script.write_text("import modewright as mw\nprint(mw.check('estimator'))\n")
    assert run([python, script], folder) == "[]\n"


def test_a_package_of_our_name_that_was_loaded_before_is_told(python: Path, tmp_path: Path) -> None:
    (tmp_path / "engine.py").write_text("")
    script = "import engine\ntry: import modewright\nexcept ImportError as error: print(error)"
    told = run([python, "-c", script], tmp_path)
    assert "modewright has a package `engine`" in told and "import modewright first" in told
