"""Stored answers: all results of a study, read from its exported file."""

from __future__ import annotations

from pathlib import Path

import pyarrow.parquet

from tests.validation.evidence.evidence_store import ROOT
from tests.validation.study.case_score import Answer
from tests.validation.study.result_store import answer_of, product_digest
from tests.validation.study.result_transfer import CODE

RESULTS = ROOT / "docs" / "evidence" / "validation.parquet"


def read_answers(path: Path = RESULTS) -> list[Answer]:
    """Return all answers of a file, in its order."""
    return [answer_of(row) for row in pyarrow.parquet.read_table(path).to_pylist()]


def is_current(path: Path = RESULTS) -> bool:
    """Return whether the results of a file are those of the present code."""
    known = pyarrow.parquet.read_schema(path).metadata or {}
    return bool(known.get(CODE.encode()) == product_digest().encode())
