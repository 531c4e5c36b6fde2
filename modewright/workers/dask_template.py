"""Cluster template: what workers started on this machine have loaded before they are.

Loaded by name in the process that they are copies of, which goes on without where some package is
missing: the client tells of it.
"""

from __future__ import annotations

import distributed.nanny
import distributed.worker  # noqa: F401
import pyarrow
import pyarrow.parquet

import modewright.runtime.compiled_run
import modewright.workers.dask_worker
from sweep.execution import dask_worker as cluster_worker  # noqa: F401

modewright.cluster_worker.own_fingerprint()
pyarrow.array([0])  # which loads pandas where that is installed
