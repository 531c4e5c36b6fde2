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

from codegen.harness.disassembly import Instruction, disassemble
from language.model.graphs import strongly_connected_components

CONDITION = re.compile("(eq|ne|cs|hs|cc|lo|mi|pl|vs|vc|hi|ls|ge|lt|gt|le)?")
Function = tuple[Instruction, ...]
LoopCounts = Mapping[str, int]
"""Loops of C with how often each turns."""


class Unbounded(Exception):
    """Machine code of which no bound is known; the message says what of it."""


def worst_case_instructions(folder: Path, sources: Sequence[str], entry: str) -> int:
    """Return the most instructions from the call of a function until it returns.

    Raises ToolMissing, BuildError, Unbounded.
    """
    return longest_path(disassemble(folder, sources, entry), entry)


def longest_path(functions: Mapping[str, Function], entry: str) -> int:
    """Return the most instructions of a function and of all that it calls. Raises Unbounded."""
    return _LongestPaths(functions).instructions_of(entry)


class _LongestPaths:
    """The longest ways through some functions, each found once."""

    def __init__(self, functions: Mapping[str, Function]) -> None:
        self.functions = functions
        self.names = {found[0].address: name for name, found in functions.items() if found}
        self.known: dict[str, int] = {}

    def instructions_of(self, name: str) -> int:
        """Return the most instructions of a function and of what it calls."""
        if name not in self.known:
            self.known[name] = self._compute(name)
        return self.known[name]

    def _compute(self, name: str) -> int:
        code = self.functions[name]
        inside = {one.address for one in code}
        edges: dict[str, list[str]] = {}
        weights: dict[str, int] = {}
        for one, after in zip(code, (*code[1:], None), strict=True):
            here = one.target in inside
            edges[one.address] = [one.target] if is_branch(one) and here else []
            if after and not has_no_fall_through(one):
                edges[one.address].append(after.address)
            weights[one.address] = 1 + (self._callee_instructions(one) if is_call(one, here) else 0)
        loops = {one.address: one.loops for one in code}
        return _ControlFlowGraph(name, edges, weights, loops).longest_path(
            list(edges), code[0].address, {}
        )

    def _callee_instructions(self, instruction: Instruction) -> int:
        if instruction.target not in self.names:
            raise Unbounded(f"{instruction.name} {instruction.operands} calls what is not known")
        return self.instructions_of(self.names[instruction.target])


@dataclass(frozen=True)
class _ControlFlowGraph:
    """The instructions of a function: what follows each, how many it stands for, what loops of C
    are around it.
    """

    function: str
    edges: Mapping[str, Sequence[str]]
    weights: Mapping[str, int]
    loops: Mapping[str, Mapping[str, int]]

    def longest_path(
        self, nodes: Sequence[str], entry: str, outer_loops: LoopCounts, loop_head: str = ""
    ) -> int:
        """Return the most instructions on a way from an entry through some instructions.

        `outer_loops` are the loops around them, `loop_head` is where a turn of the innermost one begins.
        """
        after = self._successors_within(nodes, loop_head)
        most: dict[str, int] = {}
        for group in strongly_connected_components(after):  # each after those that it leads to
            members = set(group)
            left = [most[one] for node in group for one in after[node] if one not in members]
            own = self.weights[group[0]]
            if len(group) > 1 or group[0] in after[group[0]]:
                begun = {one for node in after if node not in members for one in after[node]}
                own = self._loop_instructions(group, (begun | {entry}) & members, outer_loops)
            most.update(dict.fromkeys(group, own + max(left, default=0)))
        return most[entry]

    def _loop_instructions(
        self, nodes: Sequence[str], heads: Set[str], outer_loops: LoopCounts
    ) -> int:
        """Return the most instructions of all turns of a loop, and of the last look at its end.

        Where it is entered at several places, a turn begins at one of them, and the others lead
        there once.
        """
        found: list[int] = []
        for head in sorted(heads):
            with suppress(Unbounded):
                known = {**outer_loops, **self._loop_counts(nodes, head)}
                turns = prod(known[name] for name in known if name not in outer_loops)
                turn, *first = (
                    self.longest_path(nodes, one, known, head) for one in (head, *(heads - {head}))
                )
                if turns > 1:
                    found.append(
                        turns * turn + max(first, default=0) + self._head_instructions(head)
                    )
        if not found:
            raise Unbounded(f"{self.function} has a loop of which no end is known")
        return min(found)

    def _loop_counts(self, nodes: Sequence[str], head: str) -> LoopCounts:
        """Return the loops of C that most instructions of a loop are in, but for those of inner
        ones.
        """
        groups = strongly_connected_components(self._successors_within(nodes, head))
        own = [group[0] for group in groups if len(group) == 1]
        met = Counter(loop for node in own for loop in self.loops[node].items())
        return {name: turns for (name, turns), count in met.items() if 2 * count > len(own)}

    def _successors_within(self, nodes: Sequence[str], loop_head: str) -> dict[str, list[str]]:
        """Return what follows each of some instructions among them, but for a new turn."""
        known = set(nodes) - {loop_head}
        return {node: [one for one in self.edges[node] if one in known] for node in nodes}

    def _head_instructions(self, head: str) -> int:
        """Return the instructions from the head of a loop to its first branch."""
        count, node = self.weights[head], head
        while len(self.edges[node]) == 1:
            node = self.edges[node][0]
            count += self.weights[node]
        return count


def is_branch(instruction: Instruction) -> bool:
    """Tell whether an instruction goes on elsewhere, or may."""
    name = instruction.name.partition(".")[0]
    return name in ("cbz", "cbnz") or (name[:1] == "b" and bool(CONDITION.fullmatch(name[1:])))


def is_call(instruction: Instruction, is_local_target: bool) -> bool:
    """Tell whether an instruction calls a function, or ends with one that does the rest."""
    name = instruction.name.partition(".")[0]
    if name in ("tbb", "tbh"):
        raise Unbounded("a table of branches is not followed")
    return name in ("bl", "blx") or (is_branch(instruction) and not is_local_target)


def has_no_fall_through(instruction: Instruction) -> bool:
    """Tell whether what stands behind an instruction does not follow it."""
    name = instruction.name.partition(".")[0]
    return name in ("b", "bx") or (name in ("pop", "ldmia") and "pc" in instruction.operands)
