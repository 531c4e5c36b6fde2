"""Doctor: whether what modewright needs is there and works, each with what would help."""

from __future__ import annotations

import logging
import platform
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from importlib import import_module, metadata
from pathlib import Path
from typing import Literal

from modewright.neighbours import NEIGHBOURS

OLDEST_PYTHON = (3, 11)
Verdict = Literal["ok", "absent", "fault"]


@dataclass(frozen=True)
class Finding:
    """One thing that was looked at; `absent` is what is not needed for most."""

    name: str
    verdict: Verdict
    told: str
    help: str = ""


def findings() -> Iterator[Finding]:
    """Yield what is found, one after the other; the last is a self-test that compiles."""
    version = platform.python_version()
    is_new = sys.version_info >= OLDEST_PYTHON
    yield Finding("python", "ok" if is_new else "fault", f"{version}, {sys.executable}")
    yield _own_packages()
    yield from _packages()
    compiler = _compiler()
    yield compiler
    yield _cache()
    if compiler.verdict == "ok":
        yield _self_test()


def _own_packages() -> Finding:
    """Tell whether our packages are ours: a folder `engine/` of the user's may hide one."""
    base = Path(__file__).resolve().parent.parent
    hidden = []
    for name in NEIGHBOURS:
        file = import_module(name).__file__
        if file is None or Path(file).resolve().parent.parent != base:
            hidden.append(f"{name} is {file}")
    if hidden:
        return Finding("modewright", "fault", "; ".join(hidden), "rename that folder or package")
    return Finding("modewright", "ok", f"{metadata.version('modewright')}, {base}")


def _packages() -> Iterator[Finding]:
    for line in metadata.requires("modewright") or []:
        requirement, _, marker = line.partition(";")
        name = requirement.split("[")[0].split("<")[0].split(">")[0].split("=")[0].split("~")[0]
        name = name.strip()
        is_optional = "extra" in marker
        try:
            yield Finding(name, "ok", metadata.version(name))
        except metadata.PackageNotFoundError:
            extra = marker.partition("==")[2].strip(" '\"")
            advice = f"pip install 'modewright[{extra}]'" if is_optional else f"pip install {name}"
            verdict: Verdict = "absent" if is_optional else "fault"
            yield Finding(name, verdict, "not installed", advice)


def _compiler() -> Finding:
    from codegen.build import BuildError, compiler_version
    from language.missing import ToolMissing

    try:
        return Finding("C compiler", "ok", compiler_version())
    except ToolMissing as error:
        told, _, advice = str(error).partition(": ")
        return Finding("C compiler", "fault", told, advice)
    except BuildError as error:
        return Finding("C compiler", "fault", str(error))


def _cache() -> Finding:
    from codegen.cache import VARIABLE, cache_fault, cache_folder

    try:
        folder = cache_folder()
    except RuntimeError as error:
        return Finding("cache", "fault", str(error), f"set {VARIABLE} to a folder of yours")
    if fault := cache_fault(folder):
        return Finding("cache", "fault", fault, f"or set {VARIABLE} to a folder of yours")
    count = sum(len(path.name) == 64 for path in folder.iterdir())
    return Finding("cache", "ok", f"{folder}, 0700, {count} programs")


def _self_test() -> Finding:
    """Simulate the project of `modewright new` and compare it with its compiled C."""
    from modewright.api import lockstep
    from modewright.skeleton import write_skeleton

    with tempfile.TemporaryDirectory(prefix="modewright-") as folder:
        root = Path(folder) / "project"
        write_skeleton("self_test", root)
        try:
            trajectory, verdicts = lockstep("self_test", "cold_day", root=root)
        except Exception as error:
            logging.getLogger("modewright").exception("self-test")
            return Finding("self-test", "fault", f"{type(error).__name__}: {error}")
    values = sum(verdict.values for verdict in verdicts)
    differing = sum(verdict.differing for verdict in verdicts)
    told = (
        f"{len(trajectory.events)} transitions, {values} values in engine and C, {differing} differ"
    )
    return Finding("self-test", "fault" if differing else "ok", told)
