"""Compile cache: metadata and shared libraries of compiled candidates, kept between runs.

Compiling takes about a second, longer than a fit; studies repeat candidates.
"""

from __future__ import annotations

import atexit
import dataclasses
import hashlib
import json
import shutil
import tempfile
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import codegen
import diagnosis
import language
from codegen.predictor.predictor import PredictorColumns
from codegen.toolchain.build_cache import cache_subfolder, read_sealed, write_sealed
from diagnosis.model.parameter import FreeParameter
from language.text.document import MappingNode, ScalarNode, SequenceNode, YamlNode
from language.text.temporary_files import write_atomically

FORMAT = "modewright-candidate/1"
"""Format and schema version of the metadata of a compiled candidate."""

COMPILATION_MODULES = (
    "candidate",
    "compile_cache",
    "parameter",
    "placed_effect",
    "sampled_recording",
    "time_resolution",
)
"""Modules of `diagnosis` on which a compiled candidate depends (part of the cache key)."""


@dataclass(frozen=True)
class CompiledModel:
    """Metadata of a compiled candidate without its library; it is stored as JSON.

    `substeps` is the number of major steps in a sample, `state_ranges` (states,) are the widths of
    ranges, 0 without one, `state_dimensions` the powers of units, `memories` [s] the correlation
    times of disturbances, `delays` the parameters of delays.
    """

    columns: PredictorColumns
    substeps: int
    state_ranges: tuple[float, ...]
    free_parameters: tuple[FreeParameter, ...]
    disturbance_states: tuple[str, ...]
    memories: tuple[float, ...]
    delays: tuple[str, ...] = ()
    is_effect_state: tuple[bool, ...] = ()
    state_dimensions: tuple[tuple[int, ...], ...] = ()


def cache_key(*parts: str) -> str:
    """Return the SHA-256 key (hex) of texts and of the code that compiles candidates."""
    digest = hashlib.sha256(code_digest(COMPILATION_MODULES).encode())
    for part in parts:
        digest.update(part.encode() + b"\0")
    return digest.hexdigest()


def node_text(node: YamlNode | None) -> str:
    """Return a document tree as one line of JSON-like text without positions; "" for None."""
    if isinstance(node, ScalarNode):
        return json.dumps(node.text)
    if isinstance(node, SequenceNode):
        return f"[{','.join(node_text(item) for item in node.nodes)}]"
    if isinstance(node, MappingNode):
        return f"{{{','.join(f'{json.dumps(e.key)}:{node_text(e.node)}' for e in node)}}}"
    return ""


def load_or_compile(
    key: str, compile_model: Callable[[], tuple[CompiledModel, bytes]]
) -> tuple[CompiledModel, Path]:
    """Return the metadata and the library path of a key, from the cache or compiled now.

    An unreadable or damaged entry is compiled again. Raises OSError if the files cannot be written,
    and what `compile_model` raises.
    """
    folder = _cache_folder()
    recipe_path, library = folder / f"{key}.json", folder / f"{key}.so"
    with suppress(OSError, ValueError, TypeError, KeyError):
        metadata = json.loads(read_sealed(recipe_path) or b"")
        metadata.pop("format", None)
        if hashlib.sha256(library.read_bytes()).hexdigest() == metadata.pop("library"):
            return _from_json(metadata), library
    recipe, data = compile_model()
    library_digest = hashlib.sha256(data).hexdigest()
    entries = {**dataclasses.asdict(recipe), "library": library_digest}
    text = json.dumps({"format": FORMAT, **entries})
    write_atomically(library, data, mode=0o700)
    write_sealed(recipe_path, text.encode())
    return recipe, library


@cache
def _cache_folder() -> Path:
    """Return the cache folder of candidates, or a temporary one until the process ends."""
    folder = cache_subfolder("candidates")
    if folder is None:
        folder = Path(tempfile.mkdtemp(prefix="modewright-"))
        atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return folder


@cache
def code_digest(patterns: tuple[str, ...] = ("*",)) -> str:
    """Return the SHA-256 digest (hex) of the sources on which compiled models and fits depend.

    It covers `language`, `codegen` and the files of `diagnosis` whose stem matches a pattern.
    """
    searched = [(language, "*"), (codegen, "*"), *((diagnosis, pattern) for pattern in patterns)]
    files = [
        file
        for package, pattern in searched
        for ending in ("py", "jinja", "yaml", "lark")
        for file in Path(str(package.__file__)).parent.glob(f"**/{pattern}.{ending}")
    ]
    digest = hashlib.sha256()
    for path in sorted(files):
        digest.update(path.name.encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()


def _from_json(data: dict[str, Any]) -> CompiledModel:
    """Return the metadata that a JSON object of the cache holds."""
    free_parameters = tuple(FreeParameter(**_with_tuples(one)) for one in data["free_parameters"])
    columns = PredictorColumns(**_with_tuples(data["columns"]))
    powers = tuple(tuple(one) for one in data["state_dimensions"])
    given = {**_with_tuples(data), "columns": columns, "free_parameters": free_parameters}
    return CompiledModel(**{**given, "state_dimensions": powers})


def _with_tuples(data: dict[str, Any]) -> dict[str, Any]:
    """Return a JSON object with tuples in place of lists."""
    return {key: tuple(one) if isinstance(one, list) else one for key, one in data.items()}
