"""Pointers: what a contract takes for granted of those that a function is given."""

from __future__ import annotations

import re
from collections.abc import Iterator

SCRATCH = "_Work *const work = &self->work;"
"""In the C of an automaton that keeps the values of a step in its instance."""


def is_inside(text: str) -> bool:
    """Tell whether C keeps the values of a step in its instance."""
    return SCRATCH in text


def required(parameters: str, work_is_inside: bool) -> Iterator[str]:
    """Yield that pointers are valid, and what they point to apart: `work` maybe in `self`."""
    pointers = re.findall(r"(const [^,*]*)?\*(\w+)", parameters)
    names = [name for _, name in pointers]
    for constant, name in pointers:
        yield f"requires \\valid{'_read' if constant else ''}({name});"
    if work_is_inside and "self" in names and "work" in names:
        yield "requires work == &self->work;"
        names.remove("work")
    if len(names) > 1:
        yield f"requires \\separated({', '.join(names)});"
