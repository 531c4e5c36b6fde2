"""CMake: a project file that builds the C of a Program as a static library."""

from __future__ import annotations

from codegen.emit.c_module import emit_c_files
from codegen.toolchain.compiler import FLAGS
from codegen.toolchain.templates import product_version, render
from language.ir.printer import digest
from language.ir.program import Program

SET_BY_CMAKE = ("-std=c99", "-O2")
"""Flags that CMake sets from its own properties and from the build type."""
CMAKE_FILE = "CMakeLists.txt"
"""The name of the file."""


def emit_cmake_file(program: Program) -> dict[str, str]:
    """Return the CMake file, under its name CMAKE_FILE.

    It builds the C files of `emit_c_files` as a static library and installs its headers. Raises
    ValueError for a Program without a block `step`.
    """
    files = sorted(emit_c_files(program))
    context = {
        "name": program.name,
        "version": product_version(),
        "digest": digest(program),
        "sources": [file for file in files if file.endswith(".c")],
        "headers": [file for file in files if file.endswith(".h")],
        "flags": [flag for flag in FLAGS if flag not in SET_BY_CMAKE],
    }
    return {CMAKE_FILE: render("cmake/cmake_lists.txt.jinja", context)}
