"""Dask worker: check, compute and encode a block in a process of a cluster.

A worker computes only for clients with the same fingerprint. It unpacks a study once.
"""

from __future__ import annotations

import pickle
import threading
import traceback
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache

from engine.batch.batch import BatchRunner
from sweep.definition.study import Study
from sweep.execution.block_computation import compute_rows
from sweep.execution.fingerprint import describe_differences, fingerprint
from sweep.execution.prepare_study import program_digests
from sweep.store.block_file import encode_block
from sweep.store.manifest import Manifest, manifest_of
from sweep.store.row import Block

COMPUTE_LOCK = threading.Lock()
"""A process computes one block at a time, also if its worker has several threads."""


@dataclass(frozen=True)
class Answer:
    """The file of a block, the reason of a refusal, or the traceback of a defect."""

    file: bytes = b""
    refusal: str = ""
    defect: str = ""


def pack_study(study: Study) -> bytes:
    """Return a prepared study as bytes: a pickle compressed with zlib."""
    return zlib.compress(pickle.dumps(study, protocol=pickle.HIGHEST_PROTOCOL))


def answer_block(
    client_fingerprint: Mapping[str, str], packed_study: bytes, block: Block, run: BatchRunner
) -> Answer:
    """Return the file of a block of a packed study, or why it was not computed.

    The answer has a `refusal` for a client with another fingerprint (the study is then not
    unpacked) and for a study whose Programs differ here. Any exception becomes a `defect`, its
    traceback; none is raised.
    """
    refusal = describe_differences(client_fingerprint, fingerprint())
    if refusal:  # before unpickling: different code may have different classes
        return Answer(refusal=f"has other code: {refusal}")
    try:
        with COMPUTE_LOCK:
            study, manifest, refusal = _unpack_study(packed_study)
            if refusal:
                return Answer(refusal=refusal)
            return Answer(encode_block(manifest, block, compute_rows(study, block, run)))
    except Exception:
        return Answer(defect=traceback.format_exc())


@lru_cache(maxsize=2)
def _unpack_study(packed_study: bytes) -> tuple[Study, Manifest, str]:
    """Return the study, its manifest and the reason of a refusal (a Program that differs), or
    empty.
    """
    study: Study = pickle.loads(zlib.decompress(packed_study))
    other = [
        name for name, own in program_digests(study).items() if study.identity.get(name) != own
    ]
    refusal = f"makes another {other[0]}" if other else ""
    return study, manifest_of(study), refusal
