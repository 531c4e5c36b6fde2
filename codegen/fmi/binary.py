"""Binary: the sources of an FMU compiled for this machine, under the flags that define the bits."""

from __future__ import annotations

import platform
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from codegen.build import FLAGS, WARNINGS, BuildError, compiler_version, find_compiler, run_compiler
from codegen.fmi.variable import Version
from codegen.objects import substitute_objects

SHARED_LIBRARY_FLAGS = ("-shared", "-fPIC", "-fvisibility=hidden", "-s")
"""Only what the standard names is seen; without symbols, so that bytes do not tell of folders."""


@dataclass(frozen=True)
class Platform:
    """A machine as FMI names it: its folder in each version, and how its libraries end."""

    folders: Mapping[int, str]
    suffix: str


PLATFORMS: Mapping[tuple[str, str], Platform] = {
    ("Linux", "x86_64"): Platform({2: "linux64", 3: "x86_64-linux"}, ".so"),
    ("Linux", "aarch64"): Platform({2: "aarch64-linux", 3: "aarch64-linux"}, ".so"),
    ("Darwin", "x86_64"): Platform({2: "darwin64", 3: "x86_64-darwin"}, ".dylib"),
    ("Darwin", "arm64"): Platform({2: "darwin64", 3: "aarch64-darwin"}, ".dylib"),
}


def binary_path(name: str, version: Version) -> str:
    """Return the path in an FMU of what is compiled for this machine. Raises BuildError."""
    machine = (platform.system(), platform.machine())
    if machine not in PLATFORMS:
        raise BuildError(f"FMI has no name for this machine ({' '.join(machine)}): pack sources")
    found = PLATFORMS[machine]
    return f"binaries/{found.folders[version]}/{name}{found.suffix}"


def build_binary(files: Mapping[str, bytes], headers: Mapping[str, bytes]) -> bytes:
    """Return the library made of the sources of an FMU. Raises ToolMissing, BuildError.

    Headers of the standard are not ours to change: they are read without warnings.
    """
    with tempfile.TemporaryDirectory(prefix="modewright-") as name:
        ours, standard = Path(name) / "sources", Path(name) / "standard"
        ours.mkdir()
        standard.mkdir()
        for path, data in files.items():
            folder = standard if Path(path).name in headers else ours
            (folder / Path(path).name).write_bytes(data)
        compile_command = [*find_compiler(), *FLAGS, *WARNINGS, *SHARED_LIBRARY_FLAGS]
        object_folder = Path(name) / "objects"
        parts = substitute_objects(
            sorted(ours.glob("*.c")), compile_command, compiler_version(), object_folder
        )
        target = Path(name) / "library"
        run_compiler([*compile_command, "-isystem", str(standard), *map(str, parts), "-lm"], target)
        return target.read_bytes()
