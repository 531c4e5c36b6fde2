"""Doctor: check that Python, dependencies, compiler and cache work; suggest remedies."""

from __future__ import annotations

import logging
import platform
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from typing import Literal

from language.text.temporary_files import temporary_folder

MIN_PYTHON = (3, 11)
"""The oldest supported version of Python."""
HealthStatus = Literal["ok", "absent", "fault"]


@dataclass(frozen=True)
class HealthCheck:
    """The result of one check; `absent` means an optional part that is not installed."""

    name: str
    verdict: HealthStatus
    message: str
    help: str = ""


def run_health_checks() -> Iterator[HealthCheck]:
    """Yield the results of all checks in a fixed order.

    This is Python (at least MIN_PYTHON), modewright, each dependency of the package, C compiler,
    cache, and a self-test (lock-step of a new project) if the compiler works. An optional
    dependency that is not installed is `absent`, a required one a `fault`.
    """
    version = platform.python_version()
    is_new = sys.version_info >= MIN_PYTHON
    yield HealthCheck("python", "ok" if is_new else "fault", f"{version}, {sys.executable}")
    place = f"{metadata.version('modewright')}, {Path(__file__).parent}"
    yield HealthCheck("modewright", "ok", place)
    yield from _check_dependencies()
    compiler = _check_compiler()
    yield compiler
    yield _check_cache()
    if compiler.verdict == "ok":
        yield _run_self_test()


def _check_dependencies() -> Iterator[HealthCheck]:
    """Yield the installed version of each dependency, each once; optional ones may be absent."""
    seen: set[str] = set()
    for line in metadata.requires("modewright") or []:
        requirement, _, marker = line.partition(";")
        name = requirement.split("[")[0].split("<")[0].split(">")[0].split("=")[0].split("~")[0]
        name = name.strip()
        if name in seen:
            continue  # several extras have it
        seen.add(name)
        is_optional = "extra" in marker
        try:
            yield HealthCheck(name, "ok", metadata.version(name))
        except metadata.PackageNotFoundError:
            extra = marker.partition("==")[2].strip(" '\"")
            advice = f"pip install 'modewright[{extra}]'" if is_optional else f"pip install {name}"
            verdict: HealthStatus = "absent" if is_optional else "fault"
            yield HealthCheck(name, verdict, "not installed", advice)


def _check_compiler() -> HealthCheck:
    """Return the version of the C compiler, or why there is none."""
    from codegen.toolchain.compiler import BuildError, compiler_version
    from language.text.diagnostic import MissingToolError

    try:
        return HealthCheck("C compiler", "ok", compiler_version())
    except MissingToolError as error:
        message, _, advice = str(error).partition(": ")
        return HealthCheck("C compiler", "fault", message, advice)
    except BuildError as error:
        return HealthCheck("C compiler", "fault", str(error))


def _check_cache() -> HealthCheck:
    """Return folder and size of the cache of compiled programs, or why it is unusable."""
    from codegen.toolchain.build_cache import CACHE_VARIABLE, cache_fault, cache_folder

    try:
        folder = cache_folder()
    except OSError as error:
        hint = f"set {CACHE_VARIABLE} to a folder of yours"
        return HealthCheck("cache", "fault", str(error), hint)
    if fault := cache_fault(folder):
        return HealthCheck("cache", "fault", fault, f"or set {CACHE_VARIABLE} to a folder of yours")
    count = sum(len(path.name) == 64 for path in folder.iterdir())
    return HealthCheck("cache", "ok", f"{folder}, 0700, {count} programs")


def _run_self_test() -> HealthCheck:
    """Simulate the project of `modewright new` and compare it with its compiled C."""
    from modewright.api.new_project import write_skeleton
    from modewright.api.simulation import lockstep

    with temporary_folder() as folder:
        root = folder / "project"
        write_skeleton("self_test", root)
        try:
            trajectory, verdicts = lockstep("self_test", "cold_day", root=root)
        except Exception as error:
            logging.getLogger("modewright").exception("self-test")
            return HealthCheck("self-test", "fault", f"{type(error).__name__}: {error}")
    values = sum(verdict.values for verdict in verdicts)
    differing = sum(verdict.differing for verdict in verdicts)
    message = (
        f"{len(trajectory.events)} transitions, {values} values in engine and C, {differing} differ"
    )
    return HealthCheck("self-test", "fault" if differing else "ok", message)
