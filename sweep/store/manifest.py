"""Manifest of a store: the file `study.json`, which describes the study of the results."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from language.text.diagnostic import Problem, Source, Span, SpecError
from sweep.definition.description import Description
from sweep.definition.measure import StoreColumn, columns_of
from sweep.definition.study import Presentation, Study, SweepVariable, design_group_size
from sweep.store.digest import STORE_FORMAT, digest_of
from sweep.store.row import Block

MANIFEST_NAME = "study.json"
"""The name of the manifest file."""
MAX_BLOCKS = 100
"""Approximate largest number of blocks of a store."""
MIN_BLOCKS = 8
"""Number of blocks that are kept for the workers when blocks are enlarged for batches."""
MAX_BLOCK_SIZE = 5000
"""Largest number of variants of a block."""
MIN_BATCH_SIZE = 200
"""Smallest size of a block whose variants form one batch."""
ARROW_TYPES = {
    "real": "float64",
    "whole": "int64",
    "text": "string",
    "truth": "bool_",
    "list": "list_",
}
"""The types of columns with the names of the pyarrow types; a list is a list of reals."""


@dataclass(frozen=True)
class Design:
    """The sampling of a study: method, names of random variables, number of points, seed.

    `count` is 0 without random variables. Each point has `replicates` runs with different noise.
    """

    method: str = "random"
    names: tuple[str, ...] = ()
    count: int = 0
    seed: int = 0
    replicates: int = 1

    @property
    def group_size(self) -> int:
        """The number of points of a block or path; 1 for other methods."""
        return design_group_size(self.method, len(self.names))

    @property
    def group_count(self) -> int:
        """The number of blocks or paths; the number of points for other methods."""
        return self.count // self.group_size

    @property
    def has_indices(self) -> bool:
        """Tell whether sensitivity indices can be computed: the method is saltelli or morris."""
        return self.group_size > 1


@dataclass(frozen=True)
class Manifest:
    """The description of a store. `identity` holds digests of the inputs of the results by part.

    `description` holds the sections of the study as text.
    """

    study: str
    digest: str
    identity: Mapping[str, str]
    count: int
    block_size: int
    varied: tuple[StoreColumn, ...]
    words: Mapping[str, Sequence[str]]
    measures: tuple[StoreColumn, ...]
    presentation: Presentation
    design: Design = Design()
    description: Description = field(default_factory=dict)

    @property
    def blocks(self) -> list[Block]:
        """All blocks in their order; the last one may be smaller."""
        starts = range(0, self.count, self.block_size)
        return [Block(start, min(start + self.block_size, self.count)) for start in starts]

    def has(self, block: Block) -> bool:
        """Tell whether a block is exactly one of `blocks`, with the same start and stop."""
        is_inside = 0 <= block.start < self.count and block.start % self.block_size == 0
        return is_inside and block.stop == min(block.start + self.block_size, self.count)


def manifest_of(study: Study, block_size: int | None = None) -> Manifest:
    """Return the manifest of a prepared study.

    `block_size` is the number of variants of a block; None or 0 gives that of `choose_block_size`.
    """
    return Manifest(
        study=study.name,
        digest=digest_of(study.identity),
        identity=study.identity,
        count=study.count,
        block_size=block_size or choose_block_size(study),
        varied=tuple(map(_column_of, study.variables)),
        words={varied.name: varied.words for varied in study.variables if varied.words},
        measures=tuple(column for measure in study.measures for column in columns_of(measure)),
        presentation=study.presentation,
        design=_design_of(study),
        description=study.description,
    )


def _column_of(varied: SweepVariable) -> StoreColumn:
    """Return the column of a variable with its display unit."""
    unit = varied.unit
    factor, offset = float(unit.factor), float(unit.offset)
    return StoreColumn(varied.name, "real", str(unit.dimension), unit.text, factor, offset)


def _design_of(study: Study) -> Design:
    """Return the sampling design of a study."""
    names, sampling = tuple(varied.name for varied in study.random_variables), study.sampling
    return Design(sampling.method, names, sampling.count, sampling.seed, study.replicates)


def choose_block_size(study: Study) -> int:
    """Return the number of variants of a block: count / MAX_BLOCKS, rounded up.

    If only parameters, initial values and inputs vary, so that all variants fit into one batch, it
    is at least MIN_BATCH_SIZE, or count / MIN_BLOCKS if that is smaller, because each block
    prepares its batch once. It is at most MAX_BLOCK_SIZE.
    """
    places = [target for varied in study.variables for target in varied.targets]
    places += [target for setting in study.settings for target in setting.targets]
    is_batch = all(place.kind in ("parameter", "initial", "input") for place in places)
    least = min(MIN_BATCH_SIZE, -(-study.count // MIN_BLOCKS)) if is_batch else 1
    return min(MAX_BLOCK_SIZE, max(least, -(-study.count // MAX_BLOCKS)))


def encode_manifest(manifest: Manifest) -> bytes:
    """Return the bytes of the manifest file: JSON with an indent of 1 and a newline at the end.

    The key `modewright` is the schema version STORE_FORMAT, `seal` the digest of all others.
    """
    shown = manifest.presentation
    data: dict[str, Any] = {
        "modewright": STORE_FORMAT,
        "study": manifest.study,
        "digest": manifest.digest,
        "count": manifest.count,
        "block": manifest.block_size,
        "identity": dict(sorted(manifest.identity.items())),
        "varied": [vars(column) for column in manifest.varied],
        "words": {name: list(words) for name, words in manifest.words.items()},
        "measures": [vars(column) for column in manifest.measures],
        "presentation": {
            "by": list(shown.by), "confidence": shown.confidence, "plots": dict(shown.plots),
        },
        "design": vars(manifest.design),
        "description": manifest.description,
    }  # fmt: skip
    data["seal"] = seal_of(data)
    return (json.dumps(data, indent=1) + "\n").encode()


def seal_of(data: Mapping[str, Any]) -> str:
    """Return the SHA-256 of all entries of a manifest except `seal`, in hexadecimal.

    The order of keys does not matter.
    """
    plain = {key: value for key, value in data.items() if key != "seal"}
    return hashlib.sha256(json.dumps(plain, sort_keys=True).encode()).hexdigest()


def store_error(folder: Path, label: str, help: str = "") -> SpecError:
    """Return a SpecError about a folder, for the caller to raise.

    It has one error of the kind `store`, at line 1 of the folder's path, with a label and a hint.
    """
    return SpecError([Problem("store", file_span(folder), label, help)])


def file_span(path: Path) -> Span:
    """Return the span that stands for a whole file or folder: line 1, column 1 of its path."""
    return Span(Source(str(path)), 1, 1)
