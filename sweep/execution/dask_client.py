"""Clustering: a client of a Dask cluster, started here or reached, whose workers have our code."""

from __future__ import annotations

import logging
import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from typing import Any

import dask.config
from distributed import Client, LocalCluster, Security

from sweep.execution.dask_address import Address, Credentials
from sweep.execution.dask_error import ClusterError
from sweep.execution.fingerprint import describe_differences, fingerprint
from sweep.execution.fork_server import start_method
from sweep.execution.processes import MAX_DEATHS

CONNECT_TIMEOUT = 30.0
"""How long [s] a scheduler may take to answer, and the first worker to join."""
CONNECT_ATTEMPTS = 4
"""How often a scheduler is asked whose first answer comes with something else."""
BUSY_SCHEDULER = "its scheduler was asked {} times, and each answer came with something else"
CLOSE_TIMEOUT = 5.0
"""How long [s] a connection may take to end."""
DASK_LOGGERS = ("distributed", "tornado", "asyncio")
"""Loggers that tell of a lost connection, each in its way."""
DASHBOARD_ADDRESS = "127.0.0.1:0"
"""Dask serves its own pages on any free port of this machine alone."""
NO_CREDENTIALS = (
    "TLS takes an authority, a certificate and its key: --tls-ca, --tls-cert and --tls-key, or "
    "distributed.comm.tls in the configuration of Dask"
)
ALLOWED_FAILURES = "distributed.scheduler.allowed-failures"
DASK_SETTINGS = {
    "distributed.admin.large-graph-warning-threshold": "1 GB",
    "distributed.admin.tick.interval": "1s",
    "distributed.admin.system-monitor.interval": "5s",
    "distributed.worker.profile.enabled": False,  # it looks into workers a hundred times a second
    "distributed.worker.multiprocessing-method": start_method(),
}
"""What Dask does beside computing, seldom."""


@dataclass(frozen=True)
class WorkerSetup:
    """What workers have: `fingerprint` is a function that tells theirs.

    `preload` is a module whose `dask_setup` each that is started here does first.
    """

    fingerprint: Callable[[], Mapping[str, str]]
    preload: str = ""


@contextmanager
def open_client(
    address: Address,
    credentials: Credentials,
    worker_setup: WorkerSetup,
    timeout: float = CONNECT_TIMEOUT,
    max_deaths: int = MAX_DEATHS,
) -> Iterator[Client]:
    """Yield a client of a cluster; what was started for it ends with it.

    `max_deaths` workers started here may die of a block before it is told.
    Raises ClusterError where nobody answers, no worker is there, or one has other code.
    """
    with ExitStack() as stack, dask.config.set({**DASK_SETTINGS, ALLOWED_FAILURES: max_deaths - 1}):
        scheduler: Any = address.url
        if address.count:
            scheduler = stack.enter_context(_local_cluster(address.count, worker_setup.preload))
        security = _tls_security(address, credentials)
        stack.enter_context(_silence_dask_loggers())
        try:
            client = _connect(scheduler, security, timeout)
        except AssertionError:
            raise ClusterError(
                f"{address.url}: {BUSY_SCHEDULER.format(CONNECT_ATTEMPTS)}"
            ) from None
        except (OSError, ValueError, RuntimeError) as error:
            reason = str(error).splitlines()[0] if str(error) else type(error).__name__
            raise ClusterError(f"{address.url}: no scheduler answers: {reason}") from None
        stack.callback(_close_client, client)
        _require_workers(client, worker_setup, timeout)
        yield client


def _connect(scheduler: Any, security: Security | None, timeout: float) -> Client:
    """Return a client; a scheduler that is busy with another one's blocks is asked again.

    Dask asserts that the first answer comes alone, and a message to all clients may come with it.
    """
    for _ in range(CONNECT_ATTEMPTS - 1):
        with suppress(AssertionError):
            return Client(scheduler, security=security, timeout=timeout)
    return Client(scheduler, security=security, timeout=timeout)


@contextmanager
def _silence_dask_loggers() -> Iterator[None]:
    """Leave it to us to tell what goes wrong: Dask would log it, with tracebacks."""
    names = [name for name in logging.root.manager.loggerDict if name.split(".")[0] in DASK_LOGGERS]
    loggers = [logging.getLogger(name) for name in (*DASK_LOGGERS, *names)]
    before = [logger.level for logger in loggers]
    for logger in loggers:
        logger.setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        for logger, level in zip(loggers, before, strict=True):
            logger.setLevel(level)


def _close_client(client: Client) -> None:
    """Close a client; a scheduler that does not answer any more is not waited for."""
    with suppress(Exception):  # all is told by now, and the connection ends with us
        client.close(timeout=CLOSE_TIMEOUT)


@contextmanager
def _local_cluster(count: int, preload: str) -> Iterator[LocalCluster]:
    """Yield a cluster of processes of this machine, which tell nothing of their own."""
    with LocalCluster(
        n_workers=count,
        threads_per_worker=1,
        processes=True,
        dashboard_address=DASHBOARD_ADDRESS,
        silence_logs=logging.CRITICAL,
        preload=[preload] if preload else [],
    ) as cluster:
        yield cluster


def _tls_security(address: Address, credentials: Credentials) -> Security | None:
    """Return the credentials of TLS, from files or from the configuration of Dask."""
    if not address.url.startswith("tls:"):
        return None
    named = {
        "tls_ca_file": credentials.authority,
        "tls_client_cert": credentials.certificate,
        "tls_client_key": credentials.key,
    }
    given = {name: os.fspath(path) for name, path in named.items() if path}
    security = Security(require_encryption=True, **given)
    try:
        context = security.get_connection_args("client")["ssl_context"]
    except OSError as error:  # also what is no certificate
        raise ClusterError(f"{address.url}: its credentials cannot be used: {error}") from None
    if context is None:
        raise ClusterError(f"{address.url}: {NO_CREDENTIALS}")
    return security


def _require_workers(client: Client, worker_setup: WorkerSetup, timeout: float) -> None:
    """Raise ClusterError unless a worker is there and all that are have our code."""
    try:
        client.wait_for_workers(1, timeout=timeout)
    except TimeoutError:
        raise ClusterError(f"no worker has joined the scheduler within {timeout:g} s") from None
    try:
        found = client.run(worker_setup.fingerprint, on_error="return", callback_timeout=timeout)
    except OSError:
        label = f"a worker does not tell its code, or the scheduler not answer, for {timeout:g} s"
        raise ClusterError(label) from None
    for name, there in found.items():
        if isinstance(there, ImportError):
            raise ClusterError(f"worker {name} cannot import modewright: {there}")
        if isinstance(there, BaseException):
            raise ClusterError(f"worker {name}: {there!r}")
        refusal = describe_differences(fingerprint(), there)
        if refusal:
            raise ClusterError(f"worker {name} has other code: {refusal}")
