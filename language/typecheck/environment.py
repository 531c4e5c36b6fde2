"""Scope: what names mean at one place of a document."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from language.expressions.units import Unit
from language.typecheck.lookup_table import LookupTable
from language.typecheck.types import ExprType


@dataclass(frozen=True)
class NameEnvironment:
    """What names mean at one place: their dimensions, and the modes that `in(...)` may name.

    `angles` are the units of the parameters that are declared in a unit of angle, `memory` the
    functions with memory that may be used, `tables` what `lookup` reads,
    `mode` the mode that reads, `owners` a mode for each equation that any mode has, `events` those
    of a chart, which are no values.
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
