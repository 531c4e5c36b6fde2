"""Analysis cache: a decorator that stores the result of an analysis in the analysed object.

The objects are frozen dataclasses, so a result stays valid for the life of its object. A copy made
by `dataclasses.replace` starts without results.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import TypeVar

Owner = TypeVar("Owner")
Fact = TypeVar("Fact")


def cache_on_owner(compute: Callable[[Owner], Fact]) -> Callable[[Owner], Fact]:
    """Decorate a function of one object so that it computes its result once for each object.

    The result is stored in the `__dict__` of the object under the qualified name of the function;
    an exception is not stored. Callers share the result and must not modify it.
    """
    name = f"once {compute.__module__}.{compute.__qualname__}"

    @wraps(compute)
    def cached(thing: Owner) -> Fact:
        """Return the stored result for `thing`; compute and store it at the first call."""
        results = vars(thing)
        if name not in results:
            results[name] = compute(thing)
        fact: Fact = results[name]
        return fact

    return cached
