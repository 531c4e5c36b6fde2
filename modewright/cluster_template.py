"""Cluster template: what workers started on this machine have loaded before they are.

Loaded by name in the process that they are copies of.
"""

from __future__ import annotations

import distributed.nanny
import distributed.worker  # noqa: F401

import modewright.cluster_worker
import modewright.compiled
import sweep.cluster_worker  # noqa: F401
from sweep.rows_file import arrow_module

modewright.cluster_worker.own_fingerprint()
arrow_module().array([0])  # which loads pandas where that is installed
