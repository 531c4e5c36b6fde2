"""FMU archive: packs an FMU as a zip file whose bytes do not depend on the time of the build."""

from __future__ import annotations

import io
import platform
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from codegen.exchange.fmi.fmu_files import emit_fmu_files, read_headers
from codegen.exchange.fmi.variable import Version
from codegen.toolchain.compiler import (
    FLAGS,
    WARNINGS,
    BuildError,
    compiler_version,
    find_compiler,
    run_compiler,
)
from codegen.toolchain.object_cache import substitute_objects
from language.ir.program import Program
from language.text.temporary_files import temporary_folder

SHARED_LIBRARY_FLAGS = ("-shared", "-fPIC", "-fvisibility=hidden", "-s")
"""Flags of a shared library that exports only the functions of the standard. It has no symbols, so
its bytes do not contain names of folders."""


@dataclass(frozen=True)
class Platform:
    """A platform in FMI: its folder by version, and the suffix of its libraries."""

    folders: Mapping[int, str]
    suffix: str


PLATFORMS: Mapping[tuple[str, str], Platform] = {
    ("Linux", "x86_64"): Platform({2: "linux64", 3: "x86_64-linux"}, ".so"),
    ("Linux", "aarch64"): Platform({2: "aarch64-linux", 3: "aarch64-linux"}, ".so"),
    ("Darwin", "x86_64"): Platform({2: "darwin64", 3: "x86_64-darwin"}, ".dylib"),
    ("Darwin", "arm64"): Platform({2: "darwin64", 3: "aarch64-darwin"}, ".dylib"),
}
"""The supported platforms by operating system and processor."""


def binary_path(name: str, version: Version) -> str:
    """Return the path in an FMU of the binary for this machine.

    It is `binaries/<platform>/<name><suffix>`. Raises BuildError for a machine that is not in
    PLATFORMS.
    """
    machine = (platform.system(), platform.machine())
    if machine not in PLATFORMS:
        raise BuildError(f"FMI has no name for this machine ({' '.join(machine)}): pack sources")
    target = PLATFORMS[machine]
    return f"binaries/{target.folders[version]}/{name}{target.suffix}"


def build_binary(files: Mapping[str, bytes], headers: Mapping[str, bytes]) -> bytes:
    """Compile the sources of an FMU and return the contents of the shared library.

    `files` are sources and headers by path; folders are dropped. A file whose name is in `headers`
    (those of the standard) is a system header, for which the compiler gives no warnings. Raises
    MissingToolError, BuildError.
    """
    with temporary_folder() as folder:
        ours, standard, target = (folder / name for name in ("sources", "standard", "library"))
        ours.mkdir()
        standard.mkdir()
        for path, data in files.items():
            place = standard if Path(path).name in headers else ours
            (place / Path(path).name).write_bytes(data)
        compile_command = [*find_compiler(), *FLAGS, *WARNINGS, *SHARED_LIBRARY_FLAGS]
        object_folder = folder / "objects"
        parts = substitute_objects(
            sorted(ours.glob("*.c")), compile_command, compiler_version(), object_folder
        )
        run_compiler([*compile_command, "-isystem", str(standard), *map(str, parts), "-lm"], target)
        return target.read_bytes()


ZIP_EPOCH = (1980, 1, 1, 0, 0, 0)
"""The earliest time that a zip file can hold; every entry has it."""

FILE_MODE, EXECUTABLE_MODE = 0o644, 0o755
"""Permissions of files and of binaries."""

UNIX = 3
"""The system code of Unix in a zip entry, which makes its permissions valid."""


def build_fmu(program: Program, version: Version, is_source_only: bool = False) -> bytes:
    """Return an FMU of a Program as the bytes of a zip file.

    It contains the files of `emit_fmu_files`, and a binary for this machine unless
    `is_source_only`. The entries have the time ZIP_EPOCH. Raises ValueError as `emit_fmu_files`
    does; MissingToolError and BuildError if a binary is built.
    """
    files = emit_fmu_files(program, version)
    if not is_source_only:
        where = binary_path(program.name, version)
        sources = {path: data for path, data in files.items() if path.endswith((".c", ".h"))}
        files[where] = build_binary(sources, read_headers(version))
    return _zip_files(files)


def _zip_files(files: Mapping[str, bytes]) -> bytes:
    """Return a zip file with the files in the order of their paths; binaries are executable."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        for path in sorted(files):
            entry = zipfile.ZipInfo(path, ZIP_EPOCH)
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.create_system = UNIX
            mode = EXECUTABLE_MODE if path.startswith("binaries/") else FILE_MODE
            entry.external_attr = mode << 16
            archive.writestr(entry, files[path])
    return buffer.getvalue()
