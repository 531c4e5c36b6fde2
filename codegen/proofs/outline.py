"""Outline: a function of C in which each choice stands in a function of its own, for a prover.

WP goes through a function way by way: of choices one after the other it never sees the end. The
statements stay those of the module, in the same order; what a part may do is a contract again.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

from codegen.source import STATIC

CHOICE = re.compile(r"^    (?:if|switch|for) \(.*?^    }\n", re.M | re.S)
DECLARED = re.compile(r"^    (?:const )?\w+ \w+(?: =|;)", re.M)


@dataclass(frozen=True)
class Function:
    """A function of a module: where it stands, its name, what it takes, its body."""

    start: int
    end: int
    keyword: str
    name: str
    parameters: str
    body: str

    @property
    def choices(self) -> list[str]:
        """The choices at the outermost level of its body."""
        return CHOICE.findall(self.body)

    @property
    def text(self) -> str:
        """The function as C."""
        return f"{self.keyword}void {self.name}({self.parameters})\n{{\n{self.body}}}\n"


def function_of(text: str, name: str) -> Function:
    """Return a function of a module."""
    head = rf"^((?:{STATIC})?)void {name}\(([^)]*)\)\n{{\n(.*?)^}}\n"
    found = re.search(head, text, re.M | re.S)
    assert found, name
    return Function(*found.span(), found[1], name, found[2], found[3])


def outlined(function: Function) -> list[Function]:
    """Return the parts of a function, then what is left of it, which runs them.

    One with a variable of its own stays whole: so does one with a single choice.
    """
    if len(function.choices) < 2 or DECLARED.search(function.body):
        return [function]
    taken = ", ".join(re.findall(r"\*(\w+)", function.parameters))
    parts: list[Function] = []

    def called(found: re.Match[str]) -> str:
        name = part_name(function.name, len(parts))
        place = (function.start, function.start, function.keyword, name, function.parameters)
        parts.append(Function(*place, found[0]))
        return f"    {name}({taken});\n"

    body = CHOICE.sub(called, function.body)
    whole = (function.start, function.end, function.keyword, function.name, function.parameters)
    return [*parts, Function(*whole, body)]


def part_name(function: str, number: int) -> str:
    """Return what a part of a function is called."""
    return f"{function}_{number + 1}"
