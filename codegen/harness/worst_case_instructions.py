"""Worst-case instructions: an upper bound on the instructions of a step, from its machine code.

The bound is the longest path through the control-flow graph of a Cortex-M4F, in which each loop
runs all its iterations. The number of iterations of a loop is that of the `for` loop in C that most
of its instructions come from, according to the line table of the compiler.
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
from language.model.graph_algorithms import strongly_connected_components

CONDITION = re.compile("(eq|ne|cs|hs|cc|lo|mi|pl|vs|vc|hi|ls|ge|lt|gt|le)?")
"""A condition code of ARM, or none."""
Function = tuple[Instruction, ...]
LoopCounts = Mapping[str, int]
"""The number of iterations by C loop."""


class UnboundedError(Exception):
    """No bound is known for some machine code; the message tells why."""


def worst_case_instructions(folder: Path, sources: Sequence[str], entry: str) -> int:
    """Return the maximum number of instructions from the call of a function until it returns.

    The C files are compiled as by `disassemble`. Raises MissingToolError, BuildError, and
    UnboundedError as `longest_path` does.
    """
    return longest_path(disassemble(folder, sources, entry), entry)


def longest_path(functions: Mapping[str, Function], entry: str) -> int:
    """Return the maximum number of instructions of a function with all its callees.

    Every loop counts with all its iterations. Raises UnboundedError for a callee that is not in
    `functions`, a table of branches, and a loop whose number of iterations no C loop tells.
    """
    return _LongestPaths(functions).instructions_of(entry)


class _LongestPaths:
    """The longest paths of functions, each computed once."""

    def __init__(self, functions: Mapping[str, Function]) -> None:
        self.functions = functions
        self.names = {found[0].address: name for name, found in functions.items() if found}
        self.known: dict[str, int] = {}

    def instructions_of(self, name: str) -> int:
        """Return the maximum number of instructions of a function with its callees."""
        if name not in self.known:
            self.known[name] = self._compute(name)
        return self.known[name]

    def _compute(self, name: str) -> int:
        """Return the maximum number of instructions of a function from its control-flow graph."""
        code = self.functions[name]
        inside = {one.address for one in code}
        edges: dict[str, list[str]] = {}
        weights: dict[str, int] = {}
        for one, after in zip(code, (*code[1:], None), strict=True):
            here = one.target in inside
            edges[one.address] = [one.target] if is_branch(one) and here else []
            if after and not never_falls_through(one):
                edges[one.address].append(after.address)
            weights[one.address] = 1 + (self._callee_instructions(one) if is_call(one, here) else 0)
        loops = {one.address: one.loops for one in code}
        return _ControlFlowGraph(name, edges, weights, loops).longest_path(
            list(edges), code[0].address, {}
        )

    def _callee_instructions(self, instruction: Instruction) -> int:
        """Return the maximum number of instructions of the callee of a call.

        Raises UnboundedError if the callee is not known.
        """
        if instruction.target not in self.names:
            raise UnboundedError(
                f"{instruction.name} {instruction.operands} calls what is not known"
            )
        return self.instructions_of(self.names[instruction.target])


@dataclass(frozen=True)
class _ControlFlowGraph:
    """The control-flow graph of a function.

    Nodes are addresses of instructions. `edges` maps a node to its successors, `weights` to the
    number of instructions that it stands for (a call includes its callee), `loops` to the C loops
    around it.
    """

    function: str
    edges: Mapping[str, Sequence[str]]
    weights: Mapping[str, int]
    loops: Mapping[str, Mapping[str, int]]

    def longest_path(
        self, nodes: Sequence[str], entry: str, outer_loops: LoopCounts, loop_head: str = ""
    ) -> int:
        """Return the maximum number of instructions on a path from `entry` through `nodes`.

        `outer_loops` are the loops around the nodes. `loop_head` is the first node of an iteration
        of the innermost one; edges to it are not followed.
        """
        after = self._successors_within(nodes, loop_head)
        most: dict[str, int] = {}
        for group in strongly_connected_components(after):  # successors come first
            members = set(group)
            exits = [most[one] for node in group for one in after[node] if one not in members]
            inside = self.weights[group[0]]
            if len(group) > 1 or group[0] in after[group[0]]:
                entered = {one for node in after if node not in members for one in after[node]}
                inside = self._loop_instructions(group, (entered | {entry}) & members, outer_loops)
            most.update(dict.fromkeys(group, inside + max(exits, default=0)))
        return most[entry]

    def _loop_instructions(
        self, nodes: Sequence[str], heads: Set[str], outer_loops: LoopCounts
    ) -> int:
        """Return the maximum number of instructions of all iterations and of the last test.

        If a loop is entered at several nodes (`heads`), each is tried as the begin of an iteration,
        and the path from another head is added once. Raises UnboundedError if no C loop tells the
        number of iterations.
        """
        bounds: list[int] = []
        for head in sorted(heads):
            with suppress(UnboundedError):
                known = {**outer_loops, **self._loop_counts(nodes, head)}
                iterations = prod(known[name] for name in known if name not in outer_loops)
                longest, *first = (
                    self.longest_path(nodes, one, known, head) for one in (head, *(heads - {head}))
                )
                if iterations > 1:
                    bounds.append(
                        iterations * longest + max(first, default=0) + self._head_instructions(head)
                    )
        if not bounds:
            raise UnboundedError(f"{self.function} has a loop of which no end is known")
        return min(bounds)

    def _loop_counts(self, nodes: Sequence[str], head: str) -> LoopCounts:
        """Return the C loops that contain more than half of a loop's own instructions."""
        groups = strongly_connected_components(self._successors_within(nodes, head))
        own = [group[0] for group in groups if len(group) == 1]
        met = Counter(loop for node in own for loop in self.loops[node].items())
        return {name: turns for (name, turns), count in met.items() if 2 * count > len(own)}

    def _successors_within(self, nodes: Sequence[str], loop_head: str) -> dict[str, list[str]]:
        """Return the successors of each node among the nodes, without the head of the loop."""
        known = set(nodes) - {loop_head}
        return {node: [one for one in self.edges[node] if one in known] for node in nodes}

    def _head_instructions(self, head: str) -> int:
        """Return the number of instructions from the head of a loop through its first branch."""
        count, node = self.weights[head], head
        while len(self.edges[node]) == 1:
            node = self.edges[node][0]
            count += self.weights[node]
        return count


def is_branch(instruction: Instruction) -> bool:
    """Tell whether an instruction is cbz, cbnz, or b with or without a condition code.

    A suffix such as `.n` is ignored; calls (bl, blx) and bx are no branches.
    """
    name = instruction.name.partition(".")[0]
    return name in ("cbz", "cbnz") or (name[:1] == "b" and bool(CONDITION.fullmatch(name[1:])))


def is_call(instruction: Instruction, is_local_target: bool) -> bool:
    """Tell whether an instruction calls a function, or continues in another function (tail call).

    These are bl, blx, and a branch unless `is_local_target`: its target is in the same function.
    Raises UnboundedError for a table of branches (tbb, tbh).
    """
    name = instruction.name.partition(".")[0]
    if name in ("tbb", "tbh"):
        raise UnboundedError("a table of branches is not followed")
    return name in ("bl", "blx") or (is_branch(instruction) and not is_local_target)


def never_falls_through(instruction: Instruction) -> bool:
    """Tell whether the next instruction in memory never follows an instruction.

    These are b and bx without a condition, and `pop` and `ldmia` with `pc` among the operands.
    """
    name = instruction.name.partition(".")[0]
    return name in ("b", "bx") or (name in ("pop", "ldmia") and "pc" in instruction.operands)
