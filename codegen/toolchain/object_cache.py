"""Object cache: sources that many programs share, such as ha_math, are compiled once.

The objects are stored beside the programs (build_cache.py) and linked with the other sources.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from codegen.toolchain.build_cache import get_or_build, key_of
from codegen.toolchain.compiler import run_compiler

SHARED_SOURCES = re.compile(r"(ha_mathf?|harness/\w+)\.c$")
"""Sources that do not depend on a Program. A source in `harness` may read all files beside it;
ha_math reads its own header only."""


def is_shared(source: Path) -> bool:
    """Tell whether a source is the same in many programs.

    These are ha_math.c, ha_mathf.c and C files in a folder `harness`.
    """
    return SHARED_SOURCES.search(source.as_posix()) is not None


def object_of(source: Path, command: Sequence[str], version: str, folder: Path) -> Path:
    """Return the object file of a shared source, from the cache if it was compiled before.

    `command` is the compiler with its flags, `version` its version. If the cache cannot be used,
    the object is in a folder below `folder`, which is created. Raises BuildError.
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
    """Return the sources in their order, with each shared one replaced by its object file.

    Arguments are those of `object_of`. Raises BuildError.
    """
    return [object_of(s, command, version, folder) if is_shared(s) else s for s in sources]
