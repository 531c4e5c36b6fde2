"""Missing: what is not installed, and how to get it."""

from __future__ import annotations


class MissingToolError(Exception):
    """A program or package that is needed is not installed; the message says how to get it."""
