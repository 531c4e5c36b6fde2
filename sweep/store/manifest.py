"""Manifest: what the results in a folder are of, as `study.json` there."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from language.text.diagnostic import Problems, Source, Span, SpecError
from sweep.definition.description import Description
from sweep.definition.measure import StoreColumn, columns_of
from sweep.definition.study import Presentation, Study, SweepVariable, design_group_size
from sweep.store.digest import STORE_FORMAT, digest_of
from sweep.store.row import Block

MANIFEST_NAME = "study.json"
MAX_BLOCKS = 100
MIN_BLOCKS = 8
MAX_BLOCK_SIZE = 5000
MIN_BATCH_SIZE = 200
ARROW_TYPES = {
    "real": "float64",
    "whole": "int64",
    "text": "string",
    "truth": "bool_",
    "list": "list_",
}
"""What a column may hold, and the type that pyarrow has for it; a list is one of reals."""


@dataclass(frozen=True)
class Design:
    """How points are drawn: `names` are what is drawn, in its order; nothing: `count` is 0.

    Each point comes `replicates` times, with other noise.
    """

    method: str = "random"
    names: tuple[str, ...] = ()
    count: int = 0
    seed: int = 0
    replicates: int = 1

    @property
    def group_size(self) -> int:
        """How many points belong together: those of a block or a path; else each is alone."""
        return design_group_size(self.method, len(self.names))

    @property
    def group_count(self) -> int:
        """How many blocks or paths there will be; else points."""
        return self.count // self.group_size

    @property
    def has_indices(self) -> bool:
        """Tell whether indices of sensitivity are made of its points."""
        return self.group_size > 1


@dataclass(frozen=True)
class Manifest:
    """What a store is of. `identity` are the digests of all that results depend on, by part.

    `description` are the sections of the study, as they are written.
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
        """All blocks in their order."""
        starts = range(0, self.count, self.block_size)
        return [Block(start, min(start + self.block_size, self.count)) for start in starts]

    def has(self, block: Block) -> bool:
        """Tell whether this is one of the blocks."""
        is_inside = 0 <= block.start < self.count and block.start % self.block_size == 0
        return is_inside and block.stop == min(block.start + self.block_size, self.count)


def manifest_of(study: Study, block_size: int | None = None) -> Manifest:
    """Return the manifest of a prepared study, in blocks of a size that suits it or is given."""
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
    unit = varied.unit
    factor, offset = float(unit.factor), float(unit.offset)
    return StoreColumn(varied.name, "real", str(unit.dimension), unit.text, factor, offset)


def _design_of(study: Study) -> Design:
    names, sampling = tuple(varied.name for varied in study.random_variables), study.sampling
    return Design(sampling.method, names, sampling.count, sampling.seed, study.replicates)


def choose_block_size(study: Study) -> int:
    """Return how many variants are computed and kept at once: about a hundred blocks.

    What goes through one batch is prepared once a block: such blocks are larger, if there are some
    for every worker.
    """
    places = [target for varied in study.variables for target in varied.targets]
    places += [target for setting in study.settings for target in setting.targets]
    is_batch = all(place.kind in ("parameter", "initial", "input") for place in places)
    least = min(MIN_BATCH_SIZE, -(-study.count // MIN_BLOCKS)) if is_batch else 1
    return min(MAX_BLOCK_SIZE, max(least, -(-study.count // MAX_BLOCKS)))


def encode_manifest(manifest: Manifest) -> bytes:
    """Return a manifest as the bytes of its file."""
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
    """Return the SHA-256 of all that a manifest says, but its own seal: a change is seen."""
    plain = {key: value for key, value in data.items() if key != "seal"}
    return hashlib.sha256(json.dumps(plain, sort_keys=True).encode()).hexdigest()


def store_error(folder: Path, kind: str, label: str, help: str = "") -> SpecError:
    """Return a problem of a folder, to be raised."""
    problems = Problems()
    problems.error(kind, file_span(folder), label, help)
    return SpecError(problems.reported)


def file_span(path: Path) -> Span:
    """Return the place of a folder or file as a whole."""
    return Span(Source(str(path)), 1, 1)
