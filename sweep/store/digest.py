"""The digest of everything that the results of a study depend on."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping

STORE_FORMAT = 2
"""Form of the results: those of another one are not continued."""


def digest_of(identity: Mapping[str, str]) -> str:
    """Return the SHA-256 of all that results depend on."""
    return hashlib.sha256(
        json.dumps([STORE_FORMAT, dict(sorted(identity.items()))]).encode()
    ).hexdigest()
