"""Spread: several values behind one option, as a shell writes `--train runs/*.csv`."""

from __future__ import annotations

from collections.abc import Sequence

SEVERAL = ("--train", "--held-out")
"""Options that take values until the next option; each is repeatable as well."""


def spread(words: Sequence[str]) -> list[str]:
    """Return the words of a command line with such an option written before each of its values.

    Only where the command has its argument in front: else it could be among the values.
    """
    if len(words) < 2 or words[1].startswith("-"):
        return list(words)
    found: list[str] = []
    option = ""
    for word in words:
        if word.startswith("-"):
            option = word if word in SEVERAL else ""
        elif option and found[-1] != option:
            found.append(option)
        found.append(word)
    return found
