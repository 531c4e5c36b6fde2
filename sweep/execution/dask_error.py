"""Cluster error: a cluster that cannot be used, or no longer; what is finished is kept."""

from __future__ import annotations


class ClusterError(Exception):
    """Nobody answers, no worker is there, or one has other code; the message says which."""
