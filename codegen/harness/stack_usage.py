"""Stack usage: the stack bound of a function over all its call chains (rule C23)."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from codegen.toolchain.compiler import FLAGS, BuildError
from codegen.toolchain.external_tools import ARM_COMPILER, output_of
from codegen.toolchain.target_machine import CORTEX_FLAGS
from codegen.toolchain.tool_verdict import ToolVerdict, tool_version

MAX_STEP_STACK_BYTES = 256
"""Maximum stack of a step [bytes]."""
NODE = re.compile(
    r'node: \{ title: "(?P<name>[^"]+)" '
    r'label: "[^"]*\\n(?P<bytes>\d+) bytes \((?P<kind>[^)]+)\)'
)
"""A function in the call graph of gcc: name, frame size [bytes] and kind."""
EDGE = re.compile(r'edge: \{ sourcename: "(?P<caller>[^"]+)" targetname: "(?P<called>[^"]+)"')
"""A call in the call graph of gcc."""


@dataclass(frozen=True)
class _Calls:
    """A call graph: frame sizes [bytes], functions with a variable frame size, and callees."""

    sizes: Mapping[str, int]
    growing: frozenset[str]
    called: Mapping[str, frozenset[str]]

    def chains(self, name: str, callers: tuple[str, ...] = ()) -> list[tuple[str, ...]]:
        """Return all call chains from a function; a recursive chain ends at the repeated name."""
        chain = (*callers, name)
        if name in callers or name not in self.called:
            return [chain]
        return [
            longer for callee in sorted(self.called[name]) for longer in self.chains(callee, chain)
        ]


@dataclass(frozen=True)
class StackUsage:
    """The stack usage of a function over all call chains, as far as frames are known.

    `stack_bound` is the largest sum of frames [bytes]. `unknown_functions` are those outside of the
    sources (memset, software arithmetic), whose frames the compiler does not report and which count
    0. `recursive_functions` are counted twice, and of `variable_frames`, functions with a frame of
    variable size, the known part counts.
    """

    stack_bound: int
    unknown_functions: tuple[str, ...] = ()
    recursive_functions: tuple[str, ...] = ()
    variable_frames: tuple[str, ...] = ()


def stack_usage(folder: Path, sources: Sequence[str], entry: str) -> StackUsage:
    """Compile C files for a Cortex-M4F and return the stack usage of a function.

    The bound is the largest sum of frames over all call chains; a function of unknown frame counts
    0 and a recursive one twice. Names are sorted. Raises MissingToolError; BuildError also if
    `entry` is not in the compiled code.
    """
    output_of([ARM_COMPILER, *CORTEX_FLAGS, *FLAGS, "-fcallgraph-info=su", "-c", *sources], folder)
    calls = _read("\n".join((folder / f"{Path(s).stem}.ci").read_text() for s in sources))
    if entry not in calls.sizes:
        raise BuildError(f"{entry} is not in the compiled code")
    chains = calls.chains(entry)
    reached = {name for chain in chains for name in chain}
    return StackUsage(
        max(sum(calls.sizes.get(name, 0) for name in chain) for chain in chains),
        tuple(sorted(reached - set(calls.sizes))),
        tuple(sorted({chain[-1] for chain in chains if chain[-1] in chain[:-1]})),
        tuple(sorted(reached & calls.growing)),
    )


def check_stack(folder: Path, sources: Sequence[str], entry: str) -> ToolVerdict:
    """Return the verdict on a stack: at most MAX_STEP_STACK_BYTES, no recursion, fixed frame sizes.

    Functions of unknown frame are named in `about` and are no finding. A compilation error is a
    finding, with `no result` as `about`. Raises MissingToolError.
    """
    tool = f"{ARM_COMPILER} {tool_version(ARM_COMPILER, folder)}"
    try:
        usage = stack_usage(folder, sources, entry)
    except BuildError as error:
        return ToolVerdict("stack", tool, "no result", (str(error).partition("\n")[0],))
    findings = [f"{name} calls itself" for name in usage.recursive_functions]
    findings += [f"{name} takes more or less each time" for name in usage.variable_frames]
    if usage.stack_bound > MAX_STEP_STACK_BYTES:
        findings.append(
            f"{entry} takes {usage.stack_bound} bytes, {MAX_STEP_STACK_BYTES} are allowed"
        )
    beside = (
        f", beside what these take: {', '.join(usage.unknown_functions)}"
        if usage.unknown_functions
        else ""
    )
    return ToolVerdict(
        "stack", tool, f"{entry}: {usage.stack_bound} bytes{beside}", tuple(findings)
    )


def _read(text: str) -> _Calls:
    """Return the call graph in the output of gcc's -fcallgraph-info."""
    nodes = {_own(m["name"]): m for m in NODE.finditer(text)}
    called: dict[str, frozenset[str]] = {}
    for match in EDGE.finditer(text):
        caller = _own(match["caller"])
        called[caller] = called.get(caller, frozenset()) | {_own(match["called"])}
    sizes = {name: int(node["bytes"]) for name, node in nodes.items()}
    growing = frozenset(name for name, node in nodes.items() if node["kind"] != "static")
    return _Calls(sizes, growing, called)


def _own(name: str) -> str:
    """Return the name of a function without the file before it, which static ones have."""
    return name.rpartition(":")[2]
