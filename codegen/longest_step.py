"""Longest step: the most instructions of a step on a Cortex-M4F, read from its machine code.

Loops run to their end, of each branch the longer side is taken: no step ever takes more. How often
a loop turns is known from the `for` of C that most of its instructions come from, as the line table
of the compiler tells.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence, Set
from contextlib import suppress
from dataclasses import dataclass
from math import prod
from pathlib import Path

from codegen.disassembly import Instruction, disassembled
from language.graph import components

CONDITION = re.compile("(eq|ne|cs|hs|cc|lo|mi|pl|vs|vc|hi|ls|ge|lt|gt|le)?")
Function = tuple[Instruction, ...]
Turns = Mapping[str, int]
"""Loops of C with how often each turns."""


class Unbounded(Exception):
    """Machine code of which no bound is known; the message says what of it."""


def longest_step(folder: Path, sources: Sequence[str], entry: str) -> int:
    """Return the most instructions from the call of a function until it returns.

    Raises ToolMissing, BuildError, Unbounded.
    """
    return longest_way(disassembled(folder, sources, entry), entry)


def longest_way(functions: Mapping[str, Function], entry: str) -> int:
    """Return the most instructions of a function and of all that it calls. Raises Unbounded."""
    return _Ways(functions).of(entry)


class _Ways:
    """The longest ways through some functions, each found once."""

    def __init__(self, functions: Mapping[str, Function]) -> None:
        self.functions = functions
        self.names = {found[0].address: name for name, found in functions.items() if found}
        self.known: dict[str, int] = {}

    def of(self, name: str) -> int:
        """Return the most instructions of a function and of what it calls."""
        if name not in self.known:
            self.known[name] = self._found(name)
        return self.known[name]

    def _found(self, name: str) -> int:
        code = self.functions[name]
        inside = {one.address for one in code}
        edges: dict[str, list[str]] = {}
        weights: dict[str, int] = {}
        for one, after in zip(code, (*code[1:], None), strict=True):
            here = one.target in inside
            edges[one.address] = [one.target] if is_branch(one) and here else []
            if after and not ends(one):
                edges[one.address].append(after.address)
            weights[one.address] = 1 + (self._called(one) if leaves(one, here) else 0)
        loops = {one.address: one.loops for one in code}
        return _Loops(name, edges, weights, loops).longest(list(edges), code[0].address, {})

    def _called(self, one: Instruction) -> int:
        if one.target not in self.names:
            raise Unbounded(f"{one.name} {one.operands} calls what is not known")
        return self.of(self.names[one.target])


@dataclass(frozen=True)
class _Loops:
    """The instructions of a function: what follows each, how many it stands for, what loops of C
    are around it.
    """

    function: str
    edges: Mapping[str, Sequence[str]]
    weights: Mapping[str, int]
    loops: Mapping[str, Mapping[str, int]]

    def longest(self, nodes: Sequence[str], entry: str, around: Turns, again: str = "") -> int:
        """Return the most instructions on a way from an entry through some instructions.

        `around` are the loops around them, `again` is where a turn of the innermost one begins.
        """
        after = self._inside(nodes, again)
        most: dict[str, int] = {}
        for group in components(after):  # each after those that it leads to
            members = set(group)
            left = [most[one] for node in group for one in after[node] if one not in members]
            own = self.weights[group[0]]
            if len(group) > 1 or group[0] in after[group[0]]:
                begun = {one for node in after if node not in members for one in after[node]}
                own = self._loop(group, (begun | {entry}) & members, around)
            most.update(dict.fromkeys(group, own + max(left, default=0)))
        return most[entry]

    def _loop(self, nodes: Sequence[str], heads: Set[str], around: Turns) -> int:
        """Return the most instructions of all turns of a loop, and of the last look at its end.

        Where it is entered at several places, a turn begins at one of them, and the others lead
        there once.
        """
        found: list[int] = []
        for head in sorted(heads):
            with suppress(Unbounded):
                known = {**around, **self._turns(nodes, head)}
                turns = prod(known[name] for name in known if name not in around)
                turn, *first = (
                    self.longest(nodes, one, known, head) for one in (head, *(heads - {head}))
                )
                if turns > 1:
                    found.append(turns * turn + max(first, default=0) + self._look(head))
        if not found:
            raise Unbounded(f"{self.function} has a loop of which no end is known")
        return min(found)

    def _turns(self, nodes: Sequence[str], head: str) -> Turns:
        """Return the loops of C that most instructions of a loop are in, but for those of inner
        ones.
        """
        groups = components(self._inside(nodes, head))
        own = [group[0] for group in groups if len(group) == 1]
        met = Counter(loop for node in own for loop in self.loops[node].items())
        return {name: turns for (name, turns), count in met.items() if 2 * count > len(own)}

    def _inside(self, nodes: Sequence[str], again: str) -> dict[str, list[str]]:
        """Return what follows each of some instructions among them, but for a new turn."""
        known = set(nodes) - {again}
        return {node: [one for one in self.edges[node] if one in known] for node in nodes}

    def _look(self, head: str) -> int:
        """Return the instructions from the head of a loop to its first branch."""
        count, node = self.weights[head], head
        while len(self.edges[node]) == 1:
            node = self.edges[node][0]
            count += self.weights[node]
        return count


def is_branch(one: Instruction) -> bool:
    """Tell whether an instruction goes on elsewhere, or may."""
    name = one.name.partition(".")[0]
    return name in ("cbz", "cbnz") or (name[:1] == "b" and bool(CONDITION.fullmatch(name[1:])))


def leaves(one: Instruction, here: bool) -> bool:
    """Tell whether an instruction calls a function, or ends with one that does the rest."""
    name = one.name.partition(".")[0]
    if name in ("tbb", "tbh"):
        raise Unbounded("a table of branches is not followed")
    return name in ("bl", "blx") or (is_branch(one) and not here)


def ends(one: Instruction) -> bool:
    """Tell whether what stands behind an instruction does not follow it."""
    name = one.name.partition(".")[0]
    return name in ("b", "bx") or (name in ("pop", "ldmia") and "pc" in one.operands)
