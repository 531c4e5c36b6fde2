"""Dask client: start or connect to a cluster and check that its workers have the same code."""

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
from sweep.execution.process_executor import MAX_DEATHS

CONNECT_TIMEOUT = 30.0
"""Longest time [s] until a scheduler answers, and until the first worker joins."""
CONNECT_ATTEMPTS = 4
"""Connection attempts to a scheduler whose first answer contains other messages."""
BUSY_SCHEDULER = "its scheduler was asked {} times, and each answer came with something else"
"""Message after the last attempt."""
CLOSE_TIMEOUT = 5.0
"""Longest time [s] for closing a connection."""
DASK_LOGGERS = ("distributed", "tornado", "asyncio")
"""Loggers that report lost connections."""
DASHBOARD_ADDRESS = "127.0.0.1:0"
"""The dashboard of Dask: any free port, reachable from this machine only."""
NO_CREDENTIALS = (
    "TLS takes an authority, a certificate and its key: --tls-ca, --tls-cert and --tls-key, or "
    "distributed.comm.tls in the configuration of Dask"
)
"""Message for TLS without credentials."""
ALLOWED_FAILURES = "distributed.scheduler.allowed-failures"
"""Dask setting: worker deaths that a task may cause before it fails."""
DASK_SETTINGS = {
    "distributed.admin.large-graph-warning-threshold": "1 GB",
    "distributed.admin.tick.interval": "1s",
    "distributed.admin.system-monitor.interval": "5s",
    "distributed.worker.profile.enabled": False,  # its profiler samples a hundred times a second
    "distributed.worker.multiprocessing-method": start_method(),
}
"""Settings that reduce the background work of Dask."""


@dataclass(frozen=True)
class WorkerSetup:
    """Requirements on workers: `fingerprint` is a function that returns theirs.

    `preload` is a module whose `dask_setup` runs first in each worker that is started here.
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
    """Yield a client of a cluster; a cluster that was started for it is closed at the end.

    `timeout` [s] is the longest time until a scheduler answers, and until the first worker joins. A
    block that kills `max_deaths` local workers fails. Raises ClusterError if no scheduler answers,
    no worker joins, a worker has another fingerprint, or TLS credentials are missing or unusable.
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
    """Return a client of a scheduler.

    The connection is repeated if the scheduler is busy with blocks of another client: Dask asserts
    that the first answer is a single message, but a broadcast may accompany it.
    """
    for _ in range(CONNECT_ATTEMPTS - 1):
        with suppress(AssertionError):
            return Client(scheduler, security=security, timeout=timeout)
    return Client(scheduler, security=security, timeout=timeout)


@contextmanager
def _silence_dask_loggers() -> Iterator[None]:
    """Disable the loggers of Dask, which would log tracebacks of failures that are reported
    here.
    """
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
    """Close a client within CLOSE_TIMEOUT and ignore all errors."""
    with suppress(Exception):  # the results are complete; the connection ends with the process
        client.close(timeout=CLOSE_TIMEOUT)


@contextmanager
def _local_cluster(count: int, preload: str) -> Iterator[LocalCluster]:
    """Yield a cluster of `count` silent worker processes on this machine."""
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
    """Return TLS credentials from files or from the configuration of Dask; None without TLS.

    Raises ClusterError if they are missing or unusable.
    """
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
    except OSError as error:  # includes invalid certificates
        raise ClusterError(f"{address.url}: its credentials cannot be used: {error}") from None
    if context is None:
        raise ClusterError(f"{address.url}: {NO_CREDENTIALS}")
    return security


def _require_workers(client: Client, worker_setup: WorkerSetup, timeout: float) -> None:
    """Raise ClusterError unless a worker joins and all workers have the fingerprint of this
    process.
    """
    try:
        client.wait_for_workers(1, timeout=timeout)
    except TimeoutError:
        raise ClusterError(f"no worker has joined the scheduler within {timeout:g} s") from None
    try:
        found = client.run(worker_setup.fingerprint, on_error="return", callback_timeout=timeout)
    except OSError:
        label = "a worker did not report its code, or the scheduler did not answer"
        raise ClusterError(f"{label}, within {timeout:g} s") from None
    for name, there in found.items():
        if isinstance(there, ImportError):
            raise ClusterError(f"worker {name} cannot import modewright: {there}")
        if isinstance(there, BaseException):
            raise ClusterError(f"worker {name}: {there!r}")
        refusal = describe_differences(fingerprint(), there)
        if refusal:
            raise ClusterError(f"worker {name} has other code: {refusal}")
