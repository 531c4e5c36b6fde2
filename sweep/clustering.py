"""Clustering: a client of a Dask cluster - started here, or reached - whose workers have our code."""

from __future__ import annotations

import logging
import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from typing import Any

import dask.config
from distributed import Client, LocalCluster, Security

from sweep.address import Address, Credentials
from sweep.cluster_error import ClusterError
from sweep.fingerprint import differences, fingerprint
from sweep.processes import MOST_DEATHS

SECONDS = 30.0
"""How long [s] a scheduler may take to answer, and the first worker to join."""
QUIET = {
    "distributed.scheduler.allowed-failures": MOST_DEATHS - 1,
    "distributed.admin.large-graph-warning-threshold": "1 GB",
}


@contextmanager
def connected(
    address: Address,
    credentials: Credentials,
    own: Callable[[], Mapping[str, str]],
    seconds: float = SECONDS,
) -> Iterator[Client]:
    """Yield a client of a cluster; what was started for it ends with it.

    `own` is done by each worker and returns its fingerprint.
    Raises ClusterError where nobody answers, no worker is there, or one has other code.
    """
    with ExitStack() as stack, dask.config.set(QUIET):
        where: Any = address.url
        if address.count:
            where = stack.enter_context(_local(address.count))
        security = _security(address, credentials)
        try:
            client = stack.enter_context(Client(where, security=security, timeout=seconds))
        except (OSError, ValueError, RuntimeError) as error:
            reason = str(error).splitlines()[0] if str(error) else type(error).__name__
            raise ClusterError(f"{address.url}: no scheduler answers: {reason}") from None
        _require_workers(client, own, seconds)
        yield client


@contextmanager
def _local(count: int) -> Iterator[LocalCluster]:
    """Yield a cluster of processes of this machine, which tell nothing of their own."""
    with LocalCluster(
        n_workers=count,
        threads_per_worker=1,
        processes=True,
        dashboard_address=None,
        silence_logs=logging.CRITICAL,
    ) as cluster:
        yield cluster


def _security(address: Address, credentials: Credentials) -> Security | None:
    """Return the credentials of TLS, from files or from the configuration of Dask."""
    if not address.url.startswith("tls:"):
        return None
    named = {
        "tls_ca_file": credentials.authority,
        "tls_client_cert": credentials.certificate,
        "tls_client_key": credentials.key,
    }
    given = {name: os.fspath(path) for name, path in named.items() if path}
    return Security(require_encryption=True, **given)


def _require_workers(client: Client, own: Callable[[], Mapping[str, str]], seconds: float) -> None:
    """Raise ClusterError unless a worker is there and all that are have our code."""
    try:
        client.wait_for_workers(1, timeout=seconds)
    except TimeoutError:
        raise ClusterError(f"no worker has joined the scheduler within {seconds:g} s") from None
    for name, there in client.run(own, on_error="return").items():
        if isinstance(there, ImportError):
            raise ClusterError(f"worker {name} cannot import modewright: {there}")
        if isinstance(there, BaseException):
            raise ClusterError(f"worker {name}: {there!r}")
        refusal = differences(fingerprint(), there)
        if refusal:
            raise ClusterError(f"worker {name} has other code: {refusal}")
