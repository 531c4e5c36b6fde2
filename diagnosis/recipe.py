"""Recipe: what is known of a compiled candidate, kept beside its library for the next run.

Laying effects, checking, lowering and printing take a second, a fit takes less: in a study the same
candidates come again with each case.
"""

from __future__ import annotations

import dataclasses
import hashlib
import json
import os
import tempfile
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any

import codegen
import diagnosis
import language
from codegen.cache import own_folder
from codegen.predictor import Columns
from diagnosis.uncertain import Uncertain
from language.document import Items, Node, Scalar, Table

MAKING = ("candidate", "layers", "recipe", "series", "uncertain")
"""The files of diagnosis that candidates are made by."""


@dataclass(frozen=True)
class Recipe:
    """A candidate but for its library: `columns` of its arrays, `substeps` of a sample, `spans` of
    its states, `uncertain` parameters, `drifts` (states) and their `memories` [s]; `delays` are
    parameters that are one, and `brought` tells which states the effects have.
    """

    columns: Columns
    substeps: int
    spans: tuple[float, ...]
    uncertain: tuple[Uncertain, ...]
    drifts: tuple[str, ...]
    memories: tuple[float, ...]
    delays: tuple[str, ...] = ()
    brought: tuple[bool, ...] = ()


def recipe_key(*parts: str) -> str:
    """Return the key of what candidates of this code are made from."""
    digest = hashlib.sha256(code_digest(MAKING).encode())
    for part in parts:
        digest.update(part.encode() + b"\\0")
    return digest.hexdigest()


def node_text(node: Node | None) -> str:
    """Return a tree of a document as one text, without places."""
    if isinstance(node, Scalar):
        return json.dumps(node.text)
    if isinstance(node, Items):
        return f"[{','.join(node_text(item) for item in node.nodes)}]"
    if isinstance(node, Table):
        return f"{{{','.join(f'{json.dumps(e.key)}:{node_text(e.node)}' for e in node)}}}"
    return ""


def kept(key: str, make: Callable[[], tuple[Recipe, bytes]]) -> tuple[Recipe, Path]:
    """Return the recipe and the library of a key; both are made and kept where they are not."""
    folder = _folder()
    recipe_path, library = folder / f"{key}.json", folder / f"{key}.so"
    with suppress(OSError, ValueError, TypeError, KeyError):
        known = json.loads(recipe_path.read_text())
        if hashlib.sha256(library.read_bytes()).hexdigest() == known.pop("library"):
            return _recipe(known), library
    recipe, data = make()
    seal = hashlib.sha256(data).hexdigest()
    text = json.dumps({**dataclasses.asdict(recipe), "library": seal})
    write_whole(library, data)
    write_whole(recipe_path, text.encode())
    return recipe, library


@cache
def _folder() -> Path:
    """The user's own folder of candidates; one for this process alone where there is none."""
    return own_folder("candidates") or Path(tempfile.mkdtemp(prefix="modewright-"))


@cache
def code_digest(own: tuple[str, ...] = ("*",)) -> str:
    """Return the hash of the code that fits follow from: of `own` files of diagnosis (patterns)."""
    digest = hashlib.sha256()
    files = [file for package in (language, codegen) for file in _sources(_home(package))]
    files += [file for name in own for file in _sources(_home(diagnosis), name)]
    for path in sorted(files):
        digest.update(path.name.encode() + path.read_bytes())
    return digest.hexdigest()


def _home(package: ModuleType) -> Path:
    return Path(str(package.__file__)).parent


def _sources(folder: Path, name: str = "*") -> Iterator[Path]:
    for ending in ("py", "jinja", "yaml", "lark"):
        yield from folder.glob(f"**/{name}.{ending}")


def _recipe(known: dict[str, Any]) -> Recipe:
    given: dict[str, Any] = known["columns"]
    columns: dict[str, Any] = {k: tuple(v) if isinstance(v, list) else v for k, v in given.items()}
    uncertain = tuple(Uncertain(**{**u, "starts": tuple(u["starts"])}) for u in known["uncertain"])
    return Recipe(
        Columns(**columns),
        int(known["substeps"]),
        tuple(known["spans"]),
        uncertain,
        tuple(known["drifts"]),
        tuple(known["memories"]),
        tuple(known["delays"]),
        tuple(known["brought"]),
    )


def write_whole(path: Path, data: bytes) -> None:
    """Write a file of the cache: all of it or nothing."""
    handle, name = tempfile.mkstemp(dir=path.parent)
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(data)
        os.chmod(name, 0o700)
        os.replace(name, path)
    except OSError:
        Path(name).unlink(missing_ok=True)
        raise
