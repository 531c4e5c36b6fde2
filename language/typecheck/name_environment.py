"""Name environment: the meaning of names at one place of a document."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from language.expressions.units import Unit
from language.typecheck.lookup_table import LookupTable
from language.typecheck.types import ExprType


@dataclass(frozen=True)
class NameEnvironment:
    """The meaning of names at one place: their types, and the modes that `in(...)` may name.

    A type of None belongs to a declaration with a problem. `location` describes the place for
    messages. `angle_units` has the units of parameters declared in a unit of angle,
    `memory_functions` the functions with memory allowed here, `tables` the lookup tables. `mode` is
    the mode of the expression and `equation_owners` gives one mode for each equation of any mode.
    `events` are the events of a chart, which have no value.
    """

    types: Mapping[str, ExprType | None]
    modes: frozenset[str] = frozenset()
    location: str = "here"
    angle_units: Mapping[str, Unit] = field(default_factory=dict)
    memory_functions: frozenset[str] = frozenset()
    tables: Mapping[str, LookupTable] = field(default_factory=dict)
    mode: str = ""
    equation_owners: Mapping[str, str] = field(default_factory=dict)
    events: frozenset[str] = frozenset()
