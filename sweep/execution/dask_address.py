"""Cluster address: parse the address of a local cluster or of a remote Dask scheduler."""

from __future__ import annotations

import ipaddress
import re
from dataclasses import dataclass
from pathlib import Path

ADDRESS_FORMS = "`local:4`, `tcp://host:8786` or `tls://host:8786`"
"""The valid forms of an address, for messages."""
LOCAL_PATTERN = re.compile(r"local:([1-9]\d{0,3})")
REMOTE_PATTERN = re.compile(r"(tcp|tls)://(\[[0-9A-Fa-f:.%]+\]|[^\s:/\[\]]+):(\d{1,5})/?")


@dataclass(frozen=True)
class Address:
    """A cluster: `count` local workers, or the scheduler at `url` if `count` is 0."""

    count: int = 0
    url: str = ""
    host: str = ""

    @property
    def is_unprotected(self) -> bool:
        """Tell whether others can read and change the traffic.

        This is the case for `tcp:` unless the host is `localhost` or a loopback IP address.
        """
        return self.url.startswith("tcp:") and not _is_loopback(self.host)


@dataclass(frozen=True)
class Credentials:
    """PEM files for TLS; None refers to the configuration of Dask."""

    authority: Path | None = None
    certificate: Path | None = None
    key: Path | None = None


def parse_address(text: str) -> Address:
    """Return the address that a text denotes, in one of ADDRESS_FORMS.

    A local cluster has 1 to 9999 workers, a port is below 65536; a slash at the end is dropped.
    Raises ValueError for other texts.
    """
    local = LOCAL_PATTERN.fullmatch(text)
    if local:
        return Address(count=int(local[1]))
    remote = REMOTE_PATTERN.fullmatch(text)
    if remote and int(remote[3]) < 1 << 16:
        return Address(url=text.rstrip("/"), host=remote[2].strip("[]"))
    raise ValueError(f"`{text}` is no cluster: {ADDRESS_FORMS}")


def _is_loopback(host: str) -> bool:
    """Return whether a host is `localhost` or a loopback IP address."""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"
