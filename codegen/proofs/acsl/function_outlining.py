"""Function outlining: moves each choice of a C function into a function of its own, for the prover.

WP enumerates the paths of a function, whose number grows exponentially with successive choices. The
statements and their order stay the same. Each part has its own contract.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from codegen.emit.c_module import STATIC_PATTERN

CHOICE = re.compile(r"^    (?:if|switch|for) \(.*?^    }\n", re.M | re.S)
INNER = re.compile(r"^( +)(?:if|switch|for) \(.*?^\1}\n", re.M | re.S)
CHOSEN = re.compile(r"^    if \((?:.*\n)*?.*\) \{\n((?: {8}.*\n)+)", re.M)
"""The statements of the first `if` of a function."""
SCRATCH = re.compile(r"    (\w+) scratch;\n    \1 \*const work = &scratch;\n\n?")
"""The declaration of work variables at the start of a function."""
DECLARED = re.compile(r"^    (?:const )?\w+ \w+(?: =|;)", re.M)


@dataclass(frozen=True)
class Function:
    """A function of a module: position in the text, name, parameters and body."""

    start: int
    end: int
    keyword: str
    name: str
    parameters: str
    body: str

    @property
    def choices(self) -> list[str]:
        """The choices and loops at the outermost level of the body."""
        return CHOICE.findall(self.body)

    @property
    def text(self) -> str:
        """The function as C."""
        return f"{self.keyword}void {self.name}({self.parameters})\n{{\n{self.body}}}\n"

    def with_body(self, body: str) -> Function:
        """Return the function with another body."""
        return replace(self, body=body)


def function_of(text: str, name: str) -> Function:
    """Return a function of a module by name."""
    head = rf"^((?:{STATIC_PATTERN})?)void {name}\(([^)]*)\)\n{{\n(.*?)^}}\n"
    found = re.search(head, text, re.M | re.S)
    assert found, name
    return Function(*found.span(), found[1], name, found[2], found[3])


def move_scratch_to_parameter(text: str, name: str) -> str:
    """Return a module in which a function takes its work variables as a parameter.

    Its contract, and those of its parts, can then refer to them. A function without own work
    variables is left as it is.
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
    """Return the parts of a function, then the remaining function, which calls them.

    A function with local variables or with fewer than two choices stays whole.
    """
    if len(function.choices) < 2 or DECLARED.search(function.body):
        return [function]
    return _taken_out(function, [found.span() for found in CHOICE.finditer(function.body)])


def outline_except(function: Function, kept: Sequence[str]) -> list[Function]:
    """Return the parts of a function, then the remaining function, which calls them.

    Parts are the outermost choices that assign none of the locations in `kept`. A function with
    local variables stays whole.
    """
    if DECLARED.search(function.body):
        return [function]
    return _taken_out(function, list(_without(function.body, kept)))


def outline_calls(function: Function, calls: Sequence[str]) -> list[Function]:
    """Return the parts of a function, then the remaining function, which calls them.

    A part is one of some calls with the statements that follow it in its block, up to a choice. The
    last part is the body of the first `if`, if that contains a choice.
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
    """Return the name of a part of a function; numbers begin at 0."""
    return f"{function}_{number + 1}"
