"""An address says where a cluster is; what others can read is known."""

from __future__ import annotations

import pytest

from sweep.execution.dask_address import Address, parse_address


@pytest.mark.parametrize(
    ("text", "address", "is_open"),
    [
        ("local:4", Address(count=4), False),
        ("tcp://127.0.0.1:8786", Address(0, "tcp://127.0.0.1:8786", "127.0.0.1"), False),
        ("tcp://localhost:8786/", Address(0, "tcp://localhost:8786", "localhost"), False),
        ("tcp://[::1]:8786", Address(0, "tcp://[::1]:8786", "::1"), False),
        ("tcp://head.site:8786", Address(0, "tcp://head.site:8786", "head.site"), True),
        ("tcp://10.0.0.1:8786", Address(0, "tcp://10.0.0.1:8786", "10.0.0.1"), True),
        ("tls://head.site:8786", Address(0, "tls://head.site:8786", "head.site"), False),
    ],
)
def test_an_address_is_of_processes_here_or_of_a_scheduler(
    text: str, address: Address, is_open: bool
) -> None:
    assert parse_address(text) == address
    assert address.is_unprotected == is_open


@pytest.mark.parametrize(
    "text", ["", "local", "local:0", "local:-1", "head:8786", "tcp://head", "tcp://head:99999"]
)
def test_what_is_no_address_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match="is no cluster: `local:4`"):
        parse_address(text)
