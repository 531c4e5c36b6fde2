"""Study digest: the hash of everything on which the results of a study depend."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping

STORE_FORMAT = 2
"""Schema version of a store. Results of another version are not continued."""


def digest_of(identity: Mapping[str, str]) -> str:
    """Return the SHA-256 of the identity (digests by part) and of STORE_FORMAT, in hexadecimal.

    The order of the parts does not matter.
    """
    return hashlib.sha256(
        json.dumps([STORE_FORMAT, dict(sorted(identity.items()))]).encode()
    ).hexdigest()
