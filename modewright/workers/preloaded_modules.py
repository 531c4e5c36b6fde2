"""Preloaded modules: modules that the fork server loads for local Dask workers.

If a package is missing, the fork server continues without this module and the client reports it.
"""

from __future__ import annotations

import distributed.nanny
import distributed.worker  # noqa: F401
import pyarrow
import pyarrow.parquet

from modewright.runtime import back_end_choice as compiled_run  # noqa: F401
from modewright.workers import dask_entry_points as dask_worker
from sweep.execution import dask_worker as block_worker  # noqa: F401

dask_worker.own_fingerprint()
pyarrow.array([0])  # loads pandas if it is installed
