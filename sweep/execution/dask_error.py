"""Cluster error: the exception for a cluster that cannot be used.

Blocks that are finished remain in the store.
"""

from __future__ import annotations


class ClusterError(Exception):
    """No scheduler answers, no worker is present, or a worker has different code.

    See the message.
    """
