"""Once: what is shipped is read and checked once in a process of tests, an automaton lowered once.

Systems, automata and Programs are frozen. Specs of a test's own are read each time.
"""

from __future__ import annotations

import weakref
from collections.abc import Callable, Collection
from functools import wraps
from pathlib import Path
from typing import ParamSpec, TypeVar

from language.ir.program import Program
from language.model.automaton import Automaton

ROOT = Path(__file__).parents[2]
Given = ParamSpec("Given")
Made = TypeVar("Made")
Lower = Callable[[Automaton, Collection[str]], Program]


def memoise_shipped(load: Callable[Given, Made]) -> Callable[Given, Made]:
    """Return what loads by names, and remembers what it has made of specs that are shipped."""
    known: dict[str, Made] = {}

    @wraps(load)
    def loaded(*given: Given.args, **named: Given.kwargs) -> Made:
        if not _is_shipped(given, named):
            return load(*given, **named)
        key = repr((given, sorted(named.items())))
        if key not in known:
            known[key] = load(*given, **named)
        return known[key]

    return loaded


def memoise_lowering(lower: Callable[..., Program]) -> Callable[..., Program]:
    """Return what lowers automata, and remembers the Program of each as long as there is one."""
    known: dict[int, dict[frozenset[str], Program]] = {}

    @wraps(lower)
    def program_of(automaton: Automaton, varying: Collection[str] = ()) -> Program:
        place = id(automaton)
        if place not in known:
            known[place] = {}
            weakref.finalize(automaton, known.pop, place)
        own = known[place]
        if frozenset(varying) not in own:
            own[frozenset(varying)] = lower(automaton, varying)
        return own[frozenset(varying)]

    return program_of


def _is_shipped(given: tuple[object, ...], named: dict[str, object]) -> bool:
    """Tell whether names mean what is shipped: the project is ours, and none of them is a path."""
    all_given = [one for one in (*given, *named.values()) if one is not None]
    words = [one for one in all_given if isinstance(one, str)]
    roots = [one for one in all_given if isinstance(one, Path)]
    values = [one for one in all_given if isinstance(one, dict)]
    is_plain = len(words) + len(roots) + len(values) == len(all_given)
    is_ours = all(root.resolve() == ROOT for root in roots or [Path.cwd()])
    return is_plain and is_ours and all(word.isidentifier() for word in words)
