"""Once: a fact of an automaton, a mode or a field that is found once and kept beside it.

They are frozen, so what follows from one stays true; a changed copy starts without its facts.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import TypeVar

Thing = TypeVar("Thing")
Fact = TypeVar("Fact")


def once(find: Callable[[Thing], Fact]) -> Callable[[Thing], Fact]:
    """Return a function that finds a fact of each thing once; nobody changes what it returns."""
    name = f"once {find.__module__}.{find.__qualname__}"

    @wraps(find)
    def found(thing: Thing) -> Fact:
        kept = vars(thing)
        if name not in kept:
            kept[name] = find(thing)
        fact: Fact = kept[name]
        return fact

    return found
