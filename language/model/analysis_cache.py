"""Once: a fact of an automaton, a mode or a field that is found once and kept beside it.

They are frozen, so what follows from one stays true; a changed copy starts without its facts.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import TypeVar

Owner = TypeVar("Owner")
Fact = TypeVar("Fact")


def cache_on_owner(compute: Callable[[Owner], Fact]) -> Callable[[Owner], Fact]:
    """Return a function that finds a fact of each thing once; nobody changes what it returns."""
    name = f"once {compute.__module__}.{compute.__qualname__}"

    @wraps(compute)
    def cached(thing: Owner) -> Fact:
        kept = vars(thing)
        if name not in kept:
            kept[name] = compute(thing)
        fact: Fact = kept[name]
        return fact

    return cached
