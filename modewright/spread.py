"""Spread: several values behind one option, as a shell writes `--train runs/*.csv`."""

from __future__ import annotations

from collections.abc import Sequence

MULTI_VALUE_OPTIONS = ("--train", "--held-out")
"""Options that take values until the next option; each is repeatable as well."""


def expand_arguments(arguments: Sequence[str]) -> list[str]:
    """Return the words of a command line with such an option written before each of its values.

    Only where the command has its argument in front: else it could be among the values.
    """
    if len(arguments) < 2 or arguments[1].startswith("-"):
        return list(arguments)
    result: list[str] = []
    option = ""
    for argument in arguments:
        if argument.startswith("-"):
            option = argument if argument in MULTI_VALUE_OPTIONS else ""
        elif option and result[-1] != option:
            result.append(option)
        result.append(argument)
    return result
