"""Pluralisation: format numbers with nouns."""

from __future__ import annotations


def pluralise(number: int, noun: str) -> str:
    """Return a number with its noun, with an `s` appended unless it is 1: `1 spec`, `0 specs`."""
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"
