"""Table: columns of a store, read one at a time: a million variants fit into little memory."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from sweep.definition.measure import StoreColumn
from sweep.store.block_file import import_arrow
from sweep.store.row import DONE
from sweep.store.store import Store

Reals = NDArray[np.float64]
Values = TypeVar("Values", float, Reals)


@dataclass(frozen=True)
class PooledColumn:
    """Numbers of a column: one of each variant, or several from a list; `rows` says of which."""

    values: Reals
    rows: NDArray[np.int64]


def to_display_unit(values: Values, column: StoreColumn) -> Values:
    """Return values [SI] in the unit in which their column is shown."""
    with np.errstate(over="ignore"):
        return (values - column.offset) / column.factor


@dataclass(frozen=True)
class StudyTable:
    """The finished variants of a store, in the order of their numbers."""

    store: Store

    def read_reals(self, name: str) -> Reals:
        """Return a column (n_variants,) as reals; NaN where a variant has no such number."""
        parts = [
            np.asarray(part.cast("float64").to_numpy(zero_copy_only=False), dtype=np.float64)
            for part in self._read_parts(name)
        ]
        found = np.concatenate(parts) if parts else np.zeros(0)
        return np.where(np.isfinite(found), found, np.nan)

    def read_pooled(self, name: str) -> PooledColumn:
        """Return the numbers of a column of reals, whole numbers or lists; none are left out."""
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
        """Return a column of texts as places (n_variants,) in a list of the different ones."""
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
        """How many variants ended how."""
        places, names = self.read_categories("status")
        return {name: int(np.sum(places == k)) for k, name in enumerate(names)}

    @cached_property
    def is_done(self) -> NDArray[np.bool_]:
        """Tell of which variants (n_variants,) the measures count."""
        places, names = self.read_categories("status")
        return places == names.index(DONE) if DONE in names else np.zeros(len(places), dtype=bool)

    @cached_property
    def draws(self) -> NDArray[np.int64]:
        """Of which independent draw each variant (n_variants,) is.

        A draw is a sample, or a whole block or path; where nothing is drawn, it is the noise of a
        replicate. All points of the grid, scenarios and variants see the same draws.
        """
        design = self.store.manifest.design
        if not design.count:
            return self.read_reals("replicate").astype(np.int64)
        return self.read_reals("sample").astype(np.int64) // design.group_size

    def _read_parts(self, name: str) -> list[Any]:
        parquet = import_arrow().parquet
        paths = self.store.paths()
        return [
            parquet.read_table(path, columns=[name]).column(0).combine_chunks() for path in paths
        ]
