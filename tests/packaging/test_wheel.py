"""The wheel, installed into an environment of its own, used beside modules with our names.

In the repository `engine` is a top-level package; in the wheel it is `modewright._engine`, and all
that was written for the one has to work as the other: commands, worker processes, clusters.
"""

from __future__ import annotations

import ast
import json
import os
import shutil
import subprocess
import sys
import sysconfig
import zipfile
from collections.abc import Iterator
from pathlib import Path

import pytest
from build_wheel import layout_of
from rename_imports import wheel_name

from sweep.execution.fingerprint import fingerprint
from tests.diagnosis.rotor_project import COMMAND, write_project

pytestmark = pytest.mark.long

ROOT = Path(__file__).parents[2]
TRACE = ROOT / "tests" / "data" / "paper" / "est_paper_tip_out_1kHz.csv.gz"
STUDIES = ROOT / "tests" / "data" / "studies"
LAYOUT = layout_of(ROOT)
MOVED = sorted(LAYOUT.names.moved)
BUILD = "import sys; from setuptools import build_meta; build_meta.build_{}(sys.argv[1])"
FOREIGN = ("typer", "numpy", "distributed")
"""Packages that we use, and that a user may have a file of."""


def source_files() -> Iterator[Path]:
    """Yield the files of the repository, but those that Git ignores."""
    command = ["git", "ls-files", "--cached", "--others", "--exclude-standard"]
    told = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True).stdout
    for name in told.splitlines():
        if (ROOT / name).is_file():
            yield Path(name)


def built(kind: str, source: Path, out: Path) -> Path:
    """Build a kind of distribution from a folder; nothing is fetched."""
    command = [sys.executable, "-c", BUILD.format(kind), str(out)]
    subprocess.run(command, cwd=source, check=True, capture_output=True)
    (found,) = out.iterdir()
    return found


@pytest.fixture(scope="module")
def source(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A clone, but for tests and documents: nothing is written into the project."""
    clone = tmp_path_factory.mktemp("clone")
    for path in source_files():
        if path.parts[0] not in ("docs", "generated", "tests"):
            (clone / path).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(ROOT / path, clone / path)
    return clone


@pytest.fixture(scope="module")
def wheel(source: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel of the source distribution, as an index would have both."""
    archive = built("sdist", source, tmp_path_factory.mktemp("sdist"))
    unpacked = tmp_path_factory.mktemp("unpacked")
    shutil.unpack_archive(archive, unpacked)
    (folder,) = unpacked.iterdir()
    return built("wheel", folder, tmp_path_factory.mktemp("wheel"))


@pytest.fixture(scope="module")
def site(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The site-packages of an environment that holds the wheel, and our dependencies by a file."""
    folder = tmp_path_factory.mktemp("environment") / "venv"
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", str(folder)], check=True)
    uv = [str(ROOT / ".tools" / "uv"), "pip", "install", "--quiet", "--offline", "--no-deps"]
    python = str(folder / "bin" / "python")
    subprocess.run([*uv, "--no-config", "--python", python, str(wheel)], check=True)
    (site,) = folder.glob("lib/python*/site-packages")
    (site / "dependencies.pth").write_text(sysconfig.get_path("purelib") + "\n")
    return site


@pytest.fixture(scope="module")
def python(site: Path) -> Path:
    return site.parents[2] / "bin" / "python"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A user's project, beside modules with our names that fail when they are imported."""
    made = write_project(tmp_path_factory.mktemp("user") / "project")
    for path in STUDIES.glob("spec/*.yaml"):
        shutil.copy(path, made / "spec")
    for k, name in enumerate((*MOVED, "tests", *FOREIGN)):
        as_folder = k % 2 or (made / name).is_dir()
        file = made / name / "__init__.py" if as_folder else made / f"{name}.py"
        file.parent.mkdir(exist_ok=True)
        file.write_text(f"raise RuntimeError('{name} of the user')\n")
    return made


def run(command: list[str | Path], folder: Path, given: str = "") -> str:
    environ = {k: v for k, v in os.environ.items() if not k.startswith(("PYTHON", "VIRTUAL"))}
    environ["MODEWRIGHT_CACHE"] = str(folder / "cache")
    done = subprocess.run(
        [str(part) for part in command],
        cwd=folder,
        env=environ,
        input=given,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def content(wheel: Path) -> set[str]:
    """Return the files of a wheel but those about it."""
    names = zipfile.ZipFile(wheel).namelist()
    return {name for name in names if ".dist-info/" not in name}


def test_every_file_of_the_packages_is_in_the_wheel_and_no_other(wheel: Path) -> None:
    own = {"modewright", *MOVED}
    files = [path.as_posix() for path in source_files() if path.parts[0] in own]
    places = {wheel_name(top, LAYOUT.names).replace(".", "/"): top for top in own}
    wanted = {
        place + file.removeprefix(top)
        for place, top in places.items()
        for file in files
        if file.startswith(f"{top}/")
    }
    assert len(wanted) == len(files) > 500
    assert content(wheel) == wanted


def test_a_clone_and_a_source_distribution_give_the_same_wheel(
    source: Path, wheel: Path, tmp_path: Path
) -> None:
    stale = source / "build" / "lib" / "modewright" / "stale.py"
    stale.parent.mkdir(parents=True)
    stale.write_text("")
    (tmp_path / "out").mkdir()
    other = built("wheel", source, tmp_path / "out")
    first, second = zipfile.ZipFile(wheel), zipfile.ZipFile(other)
    assert content(other) == content(wheel)
    assert all(first.read(name) == second.read(name) for name in content(wheel))


def test_an_editable_installation_has_the_packages_where_they_lie(
    source: Path, tmp_path: Path
) -> None:
    archive = zipfile.ZipFile(built("editable", source, tmp_path))
    paths = [name for name in archive.namelist() if ".dist-info/" not in name]
    assert len(paths) == 1 and paths[0].endswith(".pth")
    assert archive.read(paths[0]).decode().split() == [str(source)]


NOT_INSTALLED = "modewright needs to be installed; it cannot run from a zip archive"


@pytest.mark.parametrize("name", ["wheel", "archive.zip"])
@pytest.mark.parametrize(
    "command",
    [
        ["-m", "modewright", "check", "estimator"],
        ["-m", "modewright.cli.app"],
        ["-m", "modewright.lsp.background_check"],
        ["-c", "import modewright"],
        ["-c", "from modewright import simulate"],
    ],
    ids=" ".join,
)
def test_a_zip_archive_on_the_path_is_refused_in_one_line(
    wheel: Path, tmp_path: Path, name: str, command: list[str]
) -> None:
    archive = wheel if name == "wheel" else shutil.copy(wheel, tmp_path / name)
    environ = {k: v for k, v in os.environ.items() if not k.startswith("PYTHON")}
    environ["PYTHONPATH"] = os.pathsep.join((str(archive), sysconfig.get_path("purelib")))
    words = [sys.executable, "-S", *command]
    done = subprocess.run(words, cwd=tmp_path, env=environ, capture_output=True, text=True)
    assert done.returncode == 1 and done.stdout == ""
    *trace, last = done.stderr.splitlines()
    assert NOT_INSTALLED in last
    assert not trace or command[0] == "-c"  # an import in a script shows its place


def test_no_module_of_the_wheel_imports_a_top_level_package_of_ours(wheel: Path) -> None:
    archive, seen = zipfile.ZipFile(wheel), set()
    for name in content(wheel):
        if name.endswith(".py"):
            for node in ast.walk(ast.parse(archive.read(name))):
                if isinstance(node, ast.ImportFrom) and node.module:
                    seen.add(node.module.partition(".")[0])
                elif isinstance(node, ast.Import):
                    seen |= {alias.name.partition(".")[0] for alias in node.names}
    assert "modewright" in seen and not seen & set(MOVED)


def test_site_packages_gets_one_folder(site: Path) -> None:
    found = {path.name for path in site.iterdir() if not path.name.startswith("_virtualenv")}
    about = {name for name in found if name.endswith(".dist-info")}
    assert len(about) == 1
    assert found - about == {"modewright", "dependencies.pth"}


def test_python_dash_m_does_not_look_into_the_working_folder(python: Path, folder: Path) -> None:
    told = run([python, "-m", "modewright", "check", "estimator"], folder)
    assert told == "1 spec checked, 0 problems\n"


OWN = f"""
import {", ".join(MOVED)}
own = [{", ".join(f"{name}.OWN" for name in MOVED)}]
"""
OURS = """
import modewright as mw
problems = mw.check("estimator")
names = [*mw.generate("estimator")][:1] + [mw.sweep.__name__, mw.lockstep.__name__]
"""


@pytest.mark.parametrize("script", [OWN + OURS, OURS + OWN], ids=["theirs first", "ours first"])
def test_modules_of_a_user_with_our_names_and_ours_work_in_one_process(
    script: str, python: Path, tmp_path: Path
) -> None:
    for k, name in enumerate(MOVED):
        file = tmp_path / name / "__init__.py" if k % 2 else tmp_path / f"{name}.py"
        file.parent.mkdir(exist_ok=True)
        file.write_text(f"OWN = '{name}'\n")
    (tmp_path / "script.py").write_text(f"{script}\nprint(own, problems, names)\n")
    told = run([python, tmp_path / "script.py"], tmp_path)
    assert told == f"{MOVED} [] ['estimator.h', 'sweep', 'lockstep']\n"


EVERY_MODULE = """
import importlib, pkgutil, modewright
names = [m.name for m in pkgutil.walk_packages(modewright.__path__, "modewright.")]
print(len([importlib.import_module(name) for name in names if not name.endswith("__main__")]))
"""


def test_every_module_of_the_wheel_can_be_imported(python: Path, folder: Path) -> None:
    told = run([python, "-P", "-c", EVERY_MODULE], folder)
    assert int(told) >= len(LAYOUT.names.modules) - 2


@pytest.mark.parametrize(
    "arguments",
    [
        ["--help"],
        ["doctor"],
        ["simulate", "ev_driveline", "-s", "tip_out", "--plot", "run.svg"],
        ["generate", "estimator", "--out", "c"],
        ["demo", "recordings", "--out", "demo"],
        ["demo", "diagnose", "--out", "demo"],
        ["fmu", "estimator", "--out", "estimator.fmu"],
        ["replay", "estimator", TRACE, "--map", "reference_trace"],
        [*COMMAND, "--out", "found"],
        ["sweep", "alone", "--out", "processes", "--workers", "2"],
        ["sweep", "alone", "--out", "cluster", "--cluster", "local:2"],
    ],
    ids=lambda arguments: "-".join(str(part) for part in arguments[:4:3]),
)
def test_the_installed_command_works_in_a_folder_with_our_names(
    arguments: list[str | Path], python: Path, folder: Path
) -> None:
    assert run([python.parent / "modewright", *arguments], folder)


FINGERPRINT = (
    "from modewright.workers.dask_entry_points import own_fingerprint as f; print(dict(f()))"
)


def test_results_of_the_wheel_are_not_taken_for_those_of_the_repository(
    python: Path, folder: Path
) -> None:
    """Imports differ, so the digests of the code do: a worker of the other kind is refused."""
    there = ast.literal_eval(run([python, "-P", "-c", FINGERPRINT], folder))
    assert there.keys() == fingerprint().keys()
    assert {name for name in there if there[name] != fingerprint()[name]} == {"modewright"}


def framed(*messages: dict[str, object]) -> str:
    texts = [json.dumps({"jsonrpc": "2.0", **message}) for message in messages]
    return "".join(f"Content-Length: {len(text)}\r\n\r\n{text}" for text in texts)


def test_the_language_server_and_its_background_process_start(python: Path, folder: Path) -> None:
    start: dict[str, object] = {"processId": None, "rootUri": None, "capabilities": {}}
    given = framed(
        {"id": 1, "method": "initialize", "params": start},
        {"method": "initialized", "params": {}},
        {"id": 2, "method": "shutdown"},
        {"method": "exit"},
    )
    told = run([python.parent / "modewright", "lsp"], folder, given)
    assert '"capabilities"' in told and '"id":2' in told.replace(" ", "")
    path = str(folder / "spec" / "spinner.yaml")
    asked = {"path": path, "root": str(folder), "texts": {}, "encoding": "utf-16"}
    proving: list[str | Path] = [python, "-P", "-m", "modewright.lsp.background_check"]
    assert json.loads(run(proving, folder, json.dumps(asked))) == []
