"""Names read: the names that the expressions of an automaton read."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping
from typing import Any

from language.expressions.syntax_tree import names
from language.model.automaton import Automaton, Balance, Transition
from language.model.declaration import Formula
from language.text.diagnostic import Span


def names_read_by(automaton: Automaton, include_waits: bool = True) -> Iterator[str]:
    """Yield the names in all expressions of an automaton, in no defined order and with repetitions.

    The expressions of its model are left out. Expressions of `wait` are left out unless
    `include_waits` is set.
    """
    stack: list[Any] = [
        getattr(automaton, field.name)
        for field in dataclasses.fields(automaton)
        if field.name != "model"
    ]
    while stack:
        thing = stack.pop()
        if isinstance(thing, Formula):
            yield from thing.reads
        elif isinstance(thing, Balance):
            yield from (name.path for side in (thing.left, thing.right) for name in names(side))
        elif isinstance(thing, Mapping):
            stack += thing.values()
        elif isinstance(thing, tuple):
            stack += thing
        elif dataclasses.is_dataclass(thing) and not isinstance(thing, Span):
            fields = {field.name: getattr(thing, field.name) for field in dataclasses.fields(thing)}
            if isinstance(thing, Transition) and not include_waits:
                del fields["wait"]
            stack += fields.values()
