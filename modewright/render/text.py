"""Text: format numbers with nouns."""

from __future__ import annotations


def pluralise(number: int, noun: str) -> str:
    """Return a number with its noun: `1 spec`, `2 specs`."""
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"
