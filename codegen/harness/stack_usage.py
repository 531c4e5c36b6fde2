"""Stack: the most that a step takes of it, along the calls that the compiler reports."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from codegen.toolchain.compiler import FLAGS, BuildError
from codegen.toolchain.external_tools import ARM_COMPILER, output_of
from codegen.toolchain.machine import CORTEX_FLAGS
from codegen.toolchain.tool_verdict import ToolVerdict, tool_version

LIMIT = 256
"""Bytes that a step may take."""
NODE = re.compile(
    r'node: \{ title: "(?P<name>[^"]+)" '
    r'label: "[^"]*\\n(?P<bytes>\d+) bytes \((?P<kind>[^)]+)\)'
)
EDGE = re.compile(r'edge: \{ sourcename: "(?P<caller>[^"]+)" targetname: "(?P<called>[^"]+)"')


@dataclass(frozen=True)
class _Calls:
    """What functions take [bytes], which of them have no fixed size, and whom they call."""

    sizes: Mapping[str, int]
    growing: frozenset[str]
    called: Mapping[str, frozenset[str]]

    def ways(self, name: str, above: tuple[str, ...] = ()) -> list[tuple[str, ...]]:
        """Return all ways down from a function; one that recurs ends where it does."""
        way = (*above, name)
        if name in above or name not in self.called:
            return [way]
        return [longer for one in sorted(self.called[name]) for longer in self.ways(one, way)]


@dataclass(frozen=True)
class StackUsage:
    """The `most` bytes that a function takes with all that it calls, as far as that is known.

    `beside` are functions that are not among the sources (memset, arithmetic in software): the
    compiler does not tell what they take. `recurring` call themselves, `growing` have no fixed
    size.
    """

    most: int
    beside: tuple[str, ...] = ()
    recurring: tuple[str, ...] = ()
    growing: tuple[str, ...] = ()


def stack_usage(folder: Path, sources: Sequence[str], entry: str) -> StackUsage:
    """Compile for a Cortex-M4F and add up what a function takes. Raises ToolMissing, BuildError."""
    output_of([ARM_COMPILER, *CORTEX_FLAGS, *FLAGS, "-fcallgraph-info=su", "-c", *sources], folder)
    calls = _read("\n".join((folder / f"{Path(s).stem}.ci").read_text() for s in sources))
    if entry not in calls.sizes:
        raise BuildError(f"{entry} is not in the compiled code")
    ways = calls.ways(entry)
    met = {name for way in ways for name in way}
    return StackUsage(
        max(sum(calls.sizes.get(name, 0) for name in way) for way in ways),
        tuple(sorted(met - set(calls.sizes))),
        tuple(sorted({way[-1] for way in ways if way[-1] in way[:-1]})),
        tuple(sorted(met & calls.growing)),
    )


def check_stack(folder: Path, sources: Sequence[str], entry: str) -> ToolVerdict:
    """Say whether a step takes no more than the limit, and a fixed number. Raises ToolMissing."""
    tool = f"{ARM_COMPILER} {tool_version(ARM_COMPILER, folder)}"
    try:
        took = stack_usage(folder, sources, entry)
    except BuildError as error:
        return ToolVerdict("stack", tool, "no result", (str(error).partition("\n")[0],))
    found = [f"{name} calls itself" for name in took.recurring]
    found += [f"{name} takes more or less each time" for name in took.growing]
    if took.most > LIMIT:
        found.append(f"{entry} takes {took.most} bytes, {LIMIT} are allowed")
    beside = f", beside what these take: {', '.join(took.beside)}" if took.beside else ""
    return ToolVerdict("stack", tool, f"{entry}: {took.most} bytes{beside}", tuple(found))


def _read(text: str) -> _Calls:
    nodes = {_own(m["name"]): m for m in NODE.finditer(text)}
    called: dict[str, frozenset[str]] = {}
    for match in EDGE.finditer(text):
        caller = _own(match["caller"])
        called[caller] = called.get(caller, frozenset()) | {_own(match["called"])}
    sizes = {name: int(node["bytes"]) for name, node in nodes.items()}
    growing = frozenset(name for name, node in nodes.items() if node["kind"] != "static")
    return _Calls(sizes, growing, called)


def _own(name: str) -> str:
    """Static functions have their file before their name."""
    return name.rpartition(":")[2]
