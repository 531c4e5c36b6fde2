"""Member: the members of the structures of a module, with what is told of each (rule C11)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from codegen.comment import comment as safe
from codegen.expression import literal
from codegen.names import CNames, c_member, c_type
from codegen.usage import ON_PAGE
from language.number import NumberType, decimal
from language.program import MODE, Constant, Program, Variable
from language.units import shown_unit

SOLVED = {
    "A": "the linear part of the rates",
    "E": "e^(A h), h the whole step",
    "F": "the integral of e^(A t) over the whole step",
    "Eh": "e^(A h/2)",
    "Fh": "the integral of e^(A t) over half of the step",
    "Phi": "e^(A T) of the observer, T the period",
    "Gamma": "what inputs that are held over the period add to the states",
    "G": "what f that is held over the period adds to the states",
    "C": "measurements by states",
    "L": "the gain of the correction",
}
"""Matrices of solved numbers, by their letter."""
GROUPS = {
    "state": "",
    "discrete": "discrete variables",
    "latched": "inputs of this tick",
    "equation": "",
    "before": "inputs of the tick before",
    "innovation": "measurements less what was predicted",
    "timer": "ticks that a guard was true",
    "check": "invariants that hold",
}
"""Nested structs of the instance, in order, with what is in them."""


@dataclass(frozen=True)
class Page:
    """A calibration page: the `qualifiers` of what points to it, and the constants it `holds`."""

    qualifiers: str
    holds: frozenset[str]

    @property
    def holds_solved(self) -> bool:
        """Tell whether solved numbers are calibrated with what they were solved for."""
        return "solved" in self.holds


CONSTANTS = Page("const", ON_PAGE)
"""Nobody writes to it while it is read, and solved numbers are constants: on this machine."""
PAGE = Page("const volatile", ON_PAGE | {"solved"})
"""On an ECU: a tool may write to it, the solved numbers included (rule C14)."""


@dataclass(frozen=True)
class Field:
    """A member of a struct with its comment."""

    type: str
    name: str
    comment: str
    value: str = ""
    size: int = 0
    title: str = ""


def page_of(program: Program) -> list[Field]:
    """Return the members of the calibration page, tables among them, with their defaults."""
    return [_constant(c, program.number) for c in program.constants if c.kind == "tunable"]


def members(program: Program, page: Page) -> dict[str, Any]:
    """The members of the structures."""
    number, constants, variables = program.number, program.constants, program.variables
    solved = _solved([c for c in constants if c.kind == "solved"], number)
    return {
        "calibration": page_of(program),
        "derived": [_constant(c, number) for c in constants if c.kind == "derived"],
        "constants": [_constant(c, number) for c in constants if c.name.startswith("constant.")],
        "axes": [_constant(c, number) for c in constants if c.name.startswith("axis.")],
        "solved": [] if page.holds_solved else solved,
        "solved_on_page": solved if page.holds_solved else [],
        "page": f"{page.qualifiers} {program.name}_Cal",
        "inputs": [field_of(v, number) for v in program.inputs],
        "is_new": [field_of(v, number) for v in variables if v.name.startswith("is_new.")],
        "groups": _groups(program),
        "memory": [field_of(v, number) for v in variables if v.name.startswith("memory.")],
        "outputs": _outputs(program),
    }


def field_of(variable: Variable, number: NumberType) -> Field:
    """Return a variable as a member."""
    comment = shown_unit(variable.unit) if variable.type == "real" else variable.about
    if variable.type == "real" and variable.about:
        comment = f"{shown_unit(variable.unit)}; {variable.about}"
    member = c_member(variable.name)
    return Field(c_type(variable, number), member, safe(comment), size=variable.size)


def _solved(constants: list[Constant], number: NumberType) -> list[Field]:
    """Return solved numbers, `solved.<mode>_<letter>.<row>.<column>` where they are of a matrix,
    the first of each with its title.
    """
    begun = {""}
    found = []
    for constant in constants:
        group, *entry = constant.name.split(".")[1:]
        about = SOLVED.get(group.rpartition("_")[2], "") if entry else ""
        title = safe(f"{group}_row__column: {about}") if about else ""
        found.append(replace(_constant(constant, number), title="" if title in begun else title))
        begun.add(title)
    return found


def _constant(constant: Constant, number: NumberType) -> Field:
    comment = "; ".join(text for text in (shown_unit(constant.unit), constant.key) if text)
    if constant.range:
        low, high = (
            str(int(end)) if constant.type == "whole" else decimal(end, number)
            for end in constant.range
        )
        comment += f"; {low} to {high}"
    value = literal(constant.value, number)
    if constant.items:
        value = f"{{{', '.join(literal(item, number) for item in constant.items)}}}"
    kind = c_type(constant, number)
    comment = "; ".join(text for text in (comment, constant.about) if text)
    return Field(kind, c_member(constant.name), safe(comment), value, len(constant.items))


def _groups(program: Program) -> list[tuple[str, str, list[Field]]]:
    found = []
    for group, about in GROUPS.items():
        inside = [v for v in program.variables if v.name.startswith(f"{group}.")]
        fields = [field_of(v, program.number) for v in inside]
        if fields:
            found.append((group, about, fields))
    return found


def _outputs(program: Program) -> list[dict[str, str]]:
    types = {v.name: c_type(v, program.number) for v in program.variables}
    known = {v.name: v for v in program.variables}
    place = CNames(program)
    return [
        {
            "type": types[wire.source],
            "name": wire.name,
            "comment": _told(program, known[wire.source], wire.unit),
            "source": place(wire.source),
        }
        for wire in program.outputs
    ]


def _told(program: Program, shown: Variable, unit: str) -> str:
    """Return what an output is in: its unit, or what its numbers stand for."""
    if shown.name == MODE:
        return f"{program.name}_MODE_*"
    return shown_unit(unit) if shown.type == "real" else shown.about
