"""Declared: the kind of value that a declaration says."""

from __future__ import annotations

from language.declaration import Input, Parameter, State
from language.experiment import SystemInput
from language.kind import Enumeration, Kind, Whole


def declared_kind(thing: Parameter | Input | State | SystemInput) -> Kind:
    """Return the kind that a declaration says; a whole number lies in its range."""
    if thing.type == "bool":
        return "truth"
    if thing.type == "enum":
        return Enumeration(thing.values)
    if thing.type == "int":
        if isinstance(thing, Parameter) and thing.kind == "fixed" and thing.value is not None:
            return Whole(int(thing.value), int(thing.value))
        limits = getattr(thing, "range", None)
        return Whole(int(limits[0]), int(limits[1])) if limits else Whole()
    return thing.unit.dimension
