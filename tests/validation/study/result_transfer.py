"""Result transfer: results of a study in one file, with which it continues on another machine."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import pyarrow
import pyarrow.parquet

from sweep.definition.measure import StoreColumn
from sweep.store.row import Block, Row
from sweep.store.store import Store

CODE = "code"
"""Key of the digest of the code in the metadata of a file."""
SHARED = ("number", "variant", "scenario", "sample", "replicate", "seed", "status", "message")


def rows_of(store: Store) -> Iterator[dict[str, Any]]:
    """Return what is kept in a store, one case after the other."""
    for path in store.paths():
        yield from pyarrow.parquet.read_table(path).to_pylist()


def export_results(stores: Mapping[str, Store], path: Path, code: str) -> int:
    """Write the results in the stores of some groups to one file; return how many it has.

    Results of other groups that the file has already are kept if they are of the same code.
    """
    files = [one for store in stores.values() for one in store.paths()]
    tables = [pyarrow.parquet.read_table(one).replace_schema_metadata(None) for one in files]
    marks = {CODE: code, **{name: store.manifest.digest for name, store in stores.items()}}
    if path.exists():
        old = pyarrow.parquet.read_table(path)
        known = {key.decode(): value.decode() for key, value in (old.schema.metadata or {}).items()}
        if known.get(CODE) == code:
            is_other = [name not in stores for name in old["variant"].to_pylist()]
            tables.append(old.filter(pyarrow.array(is_other)).replace_schema_metadata(None))
            marks = known | marks
    if not tables:
        return 0
    table = pyarrow.concat_tables(tables).replace_schema_metadata(marks)
    pyarrow.parquet.write_table(table, path, compression="zstd", compression_level=19)
    return int(table.num_rows)


def import_results(store: Store, group: str, path: Path) -> int:
    """Put the cases of a group that a file holds into its store; return how many were missing.

    Results of other code, cases or seeds are left where they are.
    """
    if not path.exists():
        return 0
    table = pyarrow.parquet.read_table(path)
    marks = table.schema.metadata or {}
    if marks.get(group.encode()) != store.manifest.digest.encode():
        return 0
    known = store.finished_starts()
    found = [_row(one, store) for one in table.to_pylist() if one["variant"] == group]
    missing = [row for row in found if row.number not in known]
    for row in missing:
        store.write_rows(Block(row.number, row.number + 1), [row])
    return len(missing)


def _row(cells: Mapping[str, Any], store: Store) -> Row:
    shared = {name: cells[name] for name in SHARED}
    kinds = store.manifest.varied, store.manifest.measures
    values, measures = (_some(cells, one) for one in kinds)
    return Row(**shared, values=values, measures=measures)


def _some(cells: Mapping[str, Any], columns: Sequence[StoreColumn]) -> dict[str, Any]:
    return {column.name: cells[column.name] for column in columns}
