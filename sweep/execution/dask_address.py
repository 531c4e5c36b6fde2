"""Address: where a study is computed - processes of a cluster here, or a scheduler elsewhere."""

from __future__ import annotations

import ipaddress
import re
from dataclasses import dataclass
from pathlib import Path

ADDRESS_FORMS = "`local:4`, `tcp://host:8786` or `tls://host:8786`"
LOCAL_PATTERN = re.compile(r"local:([1-9]\d{0,3})")
REMOTE_PATTERN = re.compile(r"(tcp|tls)://(\[[0-9A-Fa-f:.%]+\]|[^\s:/\[\]]+):(\d{1,5})/?")


@dataclass(frozen=True)
class Address:
    """`count` workers started here; or, where it is 0, the scheduler at `url`."""

    count: int = 0
    url: str = ""
    host: str = ""

    @property
    def is_unprotected(self) -> bool:
        """Tell whether others can read and write what goes there: no TLS, no loopback."""
        return self.url.startswith("tcp:") and not _is_loopback(self.host)


@dataclass(frozen=True)
class Credentials:
    """Files of TLS in PEM; None: what the configuration of Dask says."""

    authority: Path | None = None
    certificate: Path | None = None
    key: Path | None = None


def parse_address(text: str) -> Address:
    """Return an address from its text. Raises ValueError."""
    local = LOCAL_PATTERN.fullmatch(text)
    if local:
        return Address(count=int(local[1]))
    remote = REMOTE_PATTERN.fullmatch(text)
    if remote and int(remote[3]) < 1 << 16:
        return Address(url=text.rstrip("/"), host=remote[2].strip("[]"))
    raise ValueError(f"`{text}` is no cluster: {ADDRESS_FORMS}")


def _is_loopback(host: str) -> bool:
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"
