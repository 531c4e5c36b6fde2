"""Fork server: a process with loaded libraries from which worker processes are forked.

Loading the libraries takes about a second of processor time in each worker; forking avoids it. The
fork server ends with the process that started it.
"""

from __future__ import annotations

import multiprocessing
import os
from multiprocessing import forkserver

FORK_SERVER = "forkserver"
"""The start method of multiprocessing with a fork server."""
WORKER_ENVIRONMENT = {
    "PYTHONSAFEPATH": "1",  # do not import modules from the user's folder
    "OMP_NUM_THREADS": "1",
    "MKL_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
}
"""Environment of the fork server: safe imports and one thread for each worker."""


def start_fork_server(template: str) -> None:
    """Start the fork server, which loads the module `template` in the background.

    It starts at most once in a process, with WORKER_ENVIRONMENT in its environment; that of this
    process is unchanged afterwards. On systems without fork servers this does nothing.
    """
    if start_method() != FORK_SERVER:
        return
    before = {name: os.environ.get(name) for name in WORKER_ENVIRONMENT}
    os.environ.update(WORKER_ENVIRONMENT)
    try:
        multiprocessing.get_context(FORK_SERVER).set_forkserver_preload([template])
        forkserver.ensure_running()
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


def start_method() -> str:
    """Return the start method of processes: `forkserver` if available, else `spawn`."""
    return FORK_SERVER if FORK_SERVER in multiprocessing.get_all_start_methods() else "spawn"
