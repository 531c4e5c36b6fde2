"""Study table: read single columns of a store, so that a million variants fit into memory."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from engine.results.array_types import Reals
from language.text.regular_file import open_regular_file
from sweep.definition.measure import StoreColumn
from sweep.store.block_file import import_arrow
from sweep.store.row import DONE
from sweep.store.store import Store

Values = TypeVar("Values", float, Reals)


@dataclass(frozen=True)
class PooledColumn:
    """The numbers of a column, several for each variant if it is a list.

    `rows` (n,) holds the row of the variant of each value (n,).
    """

    values: Reals
    rows: NDArray[np.int64]


def to_display_unit(values: Values, column: StoreColumn) -> Values:
    """Return values [SI] in the display unit of their column: (value - offset) / factor."""
    with np.errstate(over="ignore"):
        return (values - column.offset) / column.factor


@dataclass(frozen=True)
class StudyTable:
    """The stored variants of a study in the order of their numbers."""

    store: Store

    def read_reals(self, name: str) -> Reals:
        """Return a column (n_variants,) as floats; NaN for missing and infinite values.

        A truth value is 0 or 1. Texts and lists cannot be read.
        """
        parts = [
            np.asarray(part.cast("float64").to_numpy(zero_copy_only=False), dtype=np.float64)
            for part in self._read_parts(name)
        ]
        found = np.concatenate(parts) if parts else np.zeros(0)
        return np.where(np.isfinite(found), found, np.nan)

    def read_pooled(self, name: str) -> PooledColumn:
        """Return all numbers of a column of reals, integers, truth values or lists.

        Missing and infinite values are left out; the elements of lists are not checked.
        """
        if next((c.type for c in self.store.manifest.measures if c.name == name), "") != "list":
            values = self.read_reals(name)
            rows = np.flatnonzero(~np.isnan(values))
            return PooledColumn(values[rows], rows)
        found, places, first = [], [], 0
        for part in self._read_parts(name):
            found.append(np.asarray(part.flatten().to_numpy(), dtype=np.float64))
            sizes = part.value_lengths().fill_null(0).to_numpy(zero_copy_only=False)
            places.append(np.repeat(np.arange(first, first + len(part)), sizes))
            first += len(part)
        if not found:
            return PooledColumn(np.zeros(0), np.zeros(0, dtype=np.int64))
        return PooledColumn(np.concatenate(found), np.concatenate(places))

    def read_categories(self, name: str) -> tuple[NDArray[np.int64], list[str]]:
        """Return a column of texts as indices (n_variants,) into the list of different texts.

        The list is in the order of first occurrence.
        """
        known: dict[str, int] = {}
        parts = []
        for part in self._read_parts(name):
            coded = part.dictionary_encode()
            own = [known.setdefault(text, len(known)) for text in coded.dictionary.to_pylist()]
            places = np.asarray(own, dtype=np.int64)
            parts.append(places[coded.indices.to_numpy(zero_copy_only=False)])
        return (np.concatenate(parts) if parts else np.zeros(0, dtype=np.int64)), list(known)

    @cached_property
    def counts(self) -> dict[str, int]:
        """The number of stored variants by status; a status that does not occur is absent."""
        places, names = self.read_categories("status")
        return {name: int(np.sum(places == k)) for k, name in enumerate(names)}

    @cached_property
    def is_done(self) -> NDArray[np.bool_]:
        """Mask (n_variants,) of the variants with the status `done`, whose measures count."""
        places, names = self.read_categories("status")
        return places == names.index(DONE) if DONE in names else np.zeros(len(places), dtype=bool)

    @cached_property
    def draws(self) -> NDArray[np.int64]:
        """The index of the independent draw of each variant (n_variants,).

        A draw is a sample, a block or a path; without random variables it is a replicate. All grid
        points, scenarios and system variants share the same draws.
        """
        design = self.store.manifest.design
        if not design.count:
            return self.read_reals("replicate").astype(np.int64)
        return self.read_reals("sample").astype(np.int64) // design.group_size

    def _read_parts(self, name: str) -> list[Any]:
        """Return a column of each block file as a pyarrow array."""
        parquet, parts = import_arrow().parquet, []
        for path in self.store.paths():
            with open_regular_file(path) as file:
                parts.append(parquet.read_table(file, columns=[name]).column(0).combine_chunks())
        return parts
