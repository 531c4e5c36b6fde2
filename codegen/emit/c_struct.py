"""C structures: the members of a module's structures with their comments (rules C11 and C14)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from codegen.emit.c_comment import sanitise_comment
from codegen.emit.c_expression import format_literal
from codegen.emit.c_names import CNames, c_member, c_type
from codegen.passes.block_usage import PAGE_GROUPS
from language.expressions.units import display_unit
from language.ir.number_type import NumberType, shortest_decimal
from language.ir.program import MODE_VARIABLE, Constant, Program, Variable

SOLVED_MATRICES = {
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
"""Meaning of the matrices of solved numbers, by their letter."""
STRUCT_GROUPS = {
    "state": "",
    "discrete": "discrete variables",
    "latched": "inputs of this tick",
    "equation": "",
    "before": "inputs of the tick before",
    "innovation": "measurements less what was predicted",
    "timer": "ticks that a guard was true",
    "check": "invariants that hold",
}
"""Nested structures of the instance in their order, with comments."""


@dataclass(frozen=True)
class PageLayout:
    """The layout of a calibration page.

    `qualifiers` are the C qualifiers of a pointer to it. `groups` are the groups of constants on
    it.
    """

    qualifiers: str
    groups: frozenset[str]

    @property
    def holds_solved(self) -> bool:
        """Tell whether solved numbers are on the page: the group `solved` is in `groups`."""
        return "solved" in self.groups


HOST_PAGE = PageLayout("const", PAGE_GROUPS)
"""The page on this machine: nobody writes to it during a step, and solved numbers are constants."""
ECU_PAGE = PageLayout("const volatile", PAGE_GROUPS | {"solved"})
"""The page on an ECU: a tool may write to it at any time; it holds solved numbers too (rule
C14).
"""


@dataclass(frozen=True)
class StructMember:
    """A member of a structure: C type, name and comment.

    `value` is the C text of its default, `size` the length of an array (0 for a scalar), `title` a
    comment above it.
    """

    type: str
    name: str
    comment: str
    value: str = ""
    size: int = 0
    title: str = ""


def calibration_members(program: Program) -> list[StructMember]:
    """Return the tunable constants as members of the calibration page, in Program order.

    `value` is the default, for a table the list of its values in braces.
    """
    return [
        _constant_member(c, program.number_type) for c in program.constants if c.kind == "tunable"
    ]


def struct_members(program: Program, layout: PageLayout) -> dict[str, Any]:
    """Return the template context with the members of all structures of a module.

    Keys: calibration, derived, constants, axes, solved, solved_on_page, page (C type), inputs,
    is_new, groups, memory, outputs. The solved numbers are under `solved_on_page` if the page holds
    them, else under `solved`; the other list is empty.
    """
    number, constants, variables = program.number_type, program.constants, program.variables
    solved = _solved_members([c for c in constants if c.kind == "solved"], number)
    return {
        "calibration": calibration_members(program),
        "derived": [_constant_member(c, number) for c in constants if c.kind == "derived"],
        "constants": [
            _constant_member(c, number) for c in constants if c.name.startswith("constant.")
        ],
        "axes": [_constant_member(c, number) for c in constants if c.name.startswith("axis.")],
        "solved": [] if layout.holds_solved else solved,
        "solved_on_page": solved if layout.holds_solved else [],
        "page": f"{layout.qualifiers} {program.name}_Cal",
        "inputs": [member_of(v, number) for v in program.inputs],
        "is_new": [member_of(v, number) for v in variables if v.name.startswith("is_new.")],
        "groups": _group_members(program),
        "memory": [member_of(v, number) for v in variables if v.name.startswith("memory.")],
        "outputs": _output_members(program),
    }


def member_of(variable: Variable, number: NumberType) -> StructMember:
    """Return a variable as a member.

    The comment is the unit of a real, followed by `; ` and its `about`, if any; for other types it
    is `about` alone, which may be empty. `size` is the length of an array, 0 for a scalar.
    """
    comment = display_unit(variable.unit) if variable.type == "real" else variable.about
    if variable.type == "real" and variable.about:
        comment = f"{display_unit(variable.unit)}; {variable.about}"
    member = c_member(variable.name)
    return StructMember(
        c_type(variable, number), member, sanitise_comment(comment), size=variable.size
    )


def _solved_members(constants: list[Constant], number: NumberType) -> list[StructMember]:
    """Return solved numbers as members.

    Entries of a matrix have names `solved.<mode>_<letter>.<row>.<column>`. The first entry of each
    matrix has a title.
    """
    titled = {""}
    members = []
    for constant in constants:
        group, *entry = constant.name.split(".")[1:]
        about = SOLVED_MATRICES.get(group.rpartition("_")[2], "") if entry else ""
        title = sanitise_comment(f"{group}_row__column: {about}") if about else ""
        members.append(
            replace(_constant_member(constant, number), title="" if title in titled else title)
        )
        titled.add(title)
    return members


def _constant_member(constant: Constant, number: NumberType) -> StructMember:
    """Return a constant as a member; the comment holds unit, key path, range and `about`."""
    comment = "; ".join(text for text in (display_unit(constant.unit), constant.key) if text)
    if constant.range:
        low, high = (
            str(int(end)) if constant.type == "whole" else shortest_decimal(end, number)
            for end in constant.range
        )
        comment += f"; {low} to {high}"
    value = format_literal(constant.value, number)
    if constant.items:
        value = f"{{{', '.join(format_literal(item, number) for item in constant.items)}}}"
    kind = c_type(constant, number)
    comment = "; ".join(text for text in (comment, constant.about) if text)
    return StructMember(
        kind, c_member(constant.name), sanitise_comment(comment), value, len(constant.items)
    )


def _group_members(program: Program) -> list[tuple[str, str, list[StructMember]]]:
    """Return name, comment and members of each nonempty structure inside the instance."""
    found = []
    for group, about in STRUCT_GROUPS.items():
        inside = [v for v in program.variables if v.name.startswith(f"{group}.")]
        fields = [member_of(v, program.number_type) for v in inside]
        if fields:
            found.append((group, about, fields))
    return found


def _output_members(program: Program) -> list[dict[str, str]]:
    """Return the template contexts of the outputs: type, name, comment and source in C."""
    types = {v.name: c_type(v, program.number_type) for v in program.variables}
    known = {v.name: v for v in program.variables}
    c_names = CNames(program)
    return [
        {
            "type": types[wire.source],
            "name": wire.name,
            "comment": _output_comment(program, known[wire.source], wire.unit),
            "source": c_names(wire.source),
        }
        for wire in program.outputs
    ]


def _output_comment(program: Program, source: Variable, unit: str) -> str:
    """Return the comment of an output: the unit of a real, or the meaning of a number."""
    if source.name == MODE_VARIABLE:
        return f"{program.name}_MODE_*"
    return display_unit(unit) if source.type == "real" else source.about
