"""Outline: a function of C in which each choice stands in a function of its own, for a prover.

WP goes through a function way by way: of choices one after the other it never sees the end. The
statements stay those of the module, in the same order; what a part may do is a contract again.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from codegen.emit.c_module import STATIC_PATTERN

CHOICE = re.compile(r"^    (?:if|switch|for) \(.*?^    }\n", re.M | re.S)
INNER = re.compile(r"^( +)(?:if|switch|for) \(.*?^\1}\n", re.M | re.S)
CHOSEN = re.compile(r"^    if \((?:.*\n)*?.*\) \{\n((?: {8}.*\n)+)", re.M)
"""What the first choice does where its condition is true."""
SCRATCH = re.compile(r"    (\w+) scratch;\n    \1 \*const work = &scratch;\n\n?")
"""The scratch of a function, at its beginning."""
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

    def with_body(self, body: str) -> Function:
        """The function with another body."""
        return replace(self, body=body)


def function_of(text: str, name: str) -> Function:
    """Return a function of a module."""
    head = rf"^((?:{STATIC_PATTERN})?)void {name}\(([^)]*)\)\n{{\n(.*?)^}}\n"
    found = re.search(head, text, re.M | re.S)
    assert found, name
    return Function(*found.span(), found[1], name, found[2], found[3])


def move_scratch_to_parameter(text: str, name: str) -> str:
    """Return a module in which a function takes the scratch that it has of its own: what it leaves
    there can be said of it, and of its parts.
    """
    function = function_of(text, name)
    found = SCRATCH.match(function.body)
    if found is None:
        return text
    given = f"{function.parameters}, {found[1]} *work"
    made = replace(function, parameters=given, body=function.body[found.end() :])
    text = text[: function.start] + made.text + text[function.end :]
    call = re.compile(rf"^( +){name}\(((?!.*work).*)\);\n", re.M)
    block = rf"\1{{\n\1    {found[1]} scratch;\n\n\1    {name}(\2, &scratch);\n\1}}\n"
    return call.sub(block, text)


def outline_choices(function: Function) -> list[Function]:
    """Return the parts of a function, then what is left of it, which runs them.

    One with a variable of its own stays whole: so does one with a single choice.
    """
    if len(function.choices) < 2 or DECLARED.search(function.body):
        return [function]
    return _taken_out(function, [found.span() for found in CHOICE.finditer(function.body)])


def outline_except(function: Function, kept: Sequence[str]) -> list[Function]:
    """Return the parts of a function, then what is left of it: parts are the outermost choices
    that write none of some places. One with a variable of its own stays whole.
    """
    if DECLARED.search(function.body):
        return [function]
    return _taken_out(function, list(_without(function.body, kept)))


def outline_calls(function: Function, calls: Sequence[str]) -> list[Function]:
    """Return the parts of a function, then what is left of it: some calls and what follows each in
    its block, up to a choice; at last what its first choice does, if there is a choice in that.
    """
    text = "|".join(calls)
    part = re.compile(rf"^( +)(?:{text})\((?:.*\n(?=\1(?!if |switch |for |}})))*.*\n", re.M)
    spans = [found.span() for found in part.finditer(function.body)]
    *parts, rest = _taken_out(function, spans)
    chosen = CHOSEN.search(rest.body)
    if chosen is None or not INNER.search(chosen[1]):
        return [*parts, rest]
    return [*parts, *_taken_out(rest, [chosen.span(1)], len(parts))]


def _without(body: str, kept: Sequence[str]) -> Iterator[tuple[int, int]]:
    place = 0
    while found := INNER.search(body, place):
        writes = any(f"{one} =" in found[0] for one in kept)
        if not writes:
            yield found.span()
        place = body.index("\n", found.start()) + 1 if writes else found.end()


def _taken_out(
    function: Function, spans: Sequence[tuple[int, int]], first: int = 0
) -> list[Function]:
    taken = ", ".join(re.findall(r"\*(\w+)", function.parameters))
    parts: list[Function] = []
    body, place = "", 0
    for start, end in spans:
        name = part_name(function.name, first + len(parts))
        where = (function.start, function.start, function.keyword, name, function.parameters)
        parts.append(Function(*where, function.body[start:end]))
        indent = re.match(" *", function.body[start:end])
        body += function.body[place:start] + f"{indent[0] if indent else ''}{name}({taken});\n"
        place = end
    return [*parts, function.with_body(body + function.body[place:])]


def part_name(function: str, number: int) -> str:
    """Return what a part of a function is called."""
    return f"{function}_{number + 1}"
