"""Fork server: a process that has loaded what workers here need; they are copies of it.

Loading takes a worker about a second of a processor; a copy takes none. It ends with its client.
"""

from __future__ import annotations

import multiprocessing
import os
from multiprocessing import forkserver

FORK_SERVER = "forkserver"
WORKER_ENVIRONMENT = {
    "PYTHONSAFEPATH": "1",  # what stands in the user's folder is not taken for a library
    "OMP_NUM_THREADS": "1",
    "MKL_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
}


def start_fork_server(template: str) -> None:
    """Start it, to load the module `template` while this process goes on; once in a process.

    Nothing is done where a system has no such thing: workers are started by `method()`.
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
    """Return how processes are started here."""
    return FORK_SERVER if FORK_SERVER in multiprocessing.get_all_start_methods() else "spawn"
