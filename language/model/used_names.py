"""Used names: the names that the expressions of an automaton read."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping
from typing import Any

from language.expressions.syntax_tree import names
from language.model.automaton import Automaton, Balance, Mode, Transition
from language.model.declaration import Formula
from language.text.diagnostic import Span


def names_read_by(automaton: Automaton, include_waits: bool = True) -> Iterator[str]:
    """Yield the names in all expressions of an automaton, in no defined order and with repetitions.

    Conditions, balances (both sides), assignments, start values and derived parameters are
    included, those of the automaton's `model` are not. Expressions of `wait` are left out if
    `include_waits` is false.
    """
    for part in formulas_of(automaton, include_waits):
        if isinstance(part, Formula):
            yield from part.reads
        else:
            yield from (name.path for side in (part.left, part.right) for name in names(side))


def formulas_of(automaton: Automaton, include_waits: bool = True) -> Iterator[Formula | Balance]:
    """Yield all expressions of an automaton as `names_read_by` reads them, in no defined order."""
    stack: list[Any] = [
        getattr(automaton, field.name)
        for field in dataclasses.fields(automaton)
        if field.name != "model"
    ]
    while stack:
        part = stack.pop()
        if isinstance(part, Formula | Balance):
            yield part
        elif isinstance(part, Mapping):
            stack += part.values()
        elif isinstance(part, tuple):
            stack += part
        elif dataclasses.is_dataclass(part) and not isinstance(part, Span):
            fields = {field.name: getattr(part, field.name) for field in dataclasses.fields(part)}
            if isinstance(part, Transition) and not include_waits:
                del fields["wait"]
            stack += fields.values()


def mode_formulas(mode: Mode) -> Iterator[Formula]:
    """Yield all formulas of a mode: the equations, then those of `action_formulas`."""
    yield from mode.equations.values()
    yield from action_formulas(mode)


def action_formulas(mode: Mode) -> Iterator[Formula]:
    """Yield the formulas of a mode other than its equations and balances.

    They are updates, entries, exits and process noise, then guard, reset and `until` of a rewind of
    each transition. Waits are left out.
    """
    for stage in (mode.update, mode.entry, mode.exit):
        yield from stage.values()
    if mode.observer:
        yield from mode.observer.process_noise.values()
    for transition in mode.transitions:
        yield transition.when
        yield from transition.reset.values()
        if transition.rewind:
            yield transition.rewind.until
