"""Objects: what is the same in many programs - mathematics, records - is compiled once.

They are kept beside the programs (cache.py), and linked to what is a program's own.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from codegen.toolchain.build_cache import get_or_build, key_of
from codegen.toolchain.compiler import run_compiler

SHARED_SOURCES = re.compile(r"(ha_mathf?|harness/\w+)\.c$")
"""Sources that do not follow from a Program. What is beside one of them in `harness` it may read,
ha_math its own header alone.
"""


def is_shared(source: Path) -> bool:
    """Tell whether a source is the same in many programs."""
    return SHARED_SOURCES.search(source.as_posix()) is not None


def object_of(source: Path, command: Sequence[str], version: str, folder: Path) -> Path:
    """Return the object of a shared source, kept from an earlier time if there was one.

    `command` are the compiler and its flags, `version` is what it says of itself. Without a cache
    the object is made in `folder`. Raises BuildError.
    """
    read = None if source.parent.name == "harness" else [source, source.with_suffix(".h")]
    key = key_of([source], [*command, "-c"], version, read)
    fallback_folder = folder / source.stem
    fallback_folder.mkdir(parents=True, exist_ok=True)
    compile_command = [*command, "-c", str(source)]
    return get_or_build(
        key, lambda made: run_compiler(compile_command, made), fallback_folder, "objects"
    )


def substitute_objects(
    sources: Sequence[Path], command: Sequence[str], version: str, folder: Path
) -> list[Path]:
    """Return the sources with an object in place of each one that is shared. Raises BuildError."""
    return [object_of(s, command, version, folder) if is_shared(s) else s for s in sources]
