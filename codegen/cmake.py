"""CMake: a file by which CMake builds the C of a Program as a library, with the flags it needs."""

from __future__ import annotations

from codegen.build import FLAGS
from codegen.rendering import render, version
from codegen.source import c_files
from language.printing import digest
from language.program import Program

OWN = ("-std=c99", "-O2")
"""What CMake sets by its own properties, and by the kind of a build."""
FILE = "CMakeLists.txt"


def cmake_file(program: Program) -> dict[str, str]:
    """Return the file by its name: a static library, and its header to install.

    Raises ValueError where a Program has no C.
    """
    files = sorted(c_files(program))
    context = {
        "name": program.name,
        "version": version(),
        "digest": digest(program),
        "sources": [file for file in files if file.endswith(".c")],
        "headers": [file for file in files if file.endswith(".h")],
        "flags": [flag for flag in FLAGS if flag not in OWN],
    }
    return {FILE: render("cmake_lists.txt.jinja", context)}
