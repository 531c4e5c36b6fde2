"""Archive: an FMU as the bytes of a zip file, the same bytes whenever it is made."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Mapping

from codegen.fmi.binary import binary_path, build_binary
from codegen.fmi.content import emit_fmu_files, read_headers
from codegen.fmi.variable import Version
from language.ir.program import Program

ZIP_EPOCH = (1980, 1, 1, 0, 0, 0)
"""The earliest time that a zip file can tell: no file in it has another."""
FILE_MODE, EXECUTABLE_MODE = 0o644, 0o755
UNIX = 3
"""Who made an entry, for the permissions that it has."""


def build_fmu(program: Program, version: Version, is_source_only: bool = False) -> bytes:
    """Return an FMU of a Program, with a binary for this machine or with sources alone.

    Raises ValueError as `fmu_files` does; ToolMissing, BuildError where there is a binary to make.
    """
    files = emit_fmu_files(program, version)
    if not is_source_only:
        where = binary_path(program.name, version)
        sources = {path: data for path, data in files.items() if path.endswith((".c", ".h"))}
        files[where] = build_binary(sources, read_headers(version))
    return _zip_files(files)


def _zip_files(files: Mapping[str, bytes]) -> bytes:
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
