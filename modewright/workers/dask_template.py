"""Cluster template: what workers started on this machine have loaded before they are.

Loaded by name in the process that they are copies of, which goes on without where some package is
missing: the client tells of it.
"""

from __future__ import annotations

import distributed.nanny
import distributed.worker  # noqa: F401
import pyarrow
import pyarrow.parquet

from modewright.runtime import compiled_run  # noqa: F401
from modewright.workers import dask_worker
from sweep.execution import dask_worker as block_worker  # noqa: F401

dask_worker.own_fingerprint()
pyarrow.array([0])  # which loads pandas where that is installed
