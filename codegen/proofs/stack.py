"""Stack: the most that a step takes of it, along the calls that the compiler reports."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from codegen.build import FLAGS
from codegen.machine import CORTEX
from codegen.proofs.proof import Proof, told, version_of
from codegen.tool import ARM_COMPILER

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


def stack(folder: Path, sources: Sequence[str], entry: str) -> Proof:
    """Compile for a Cortex-M4F and add up what a step takes. Raises ToolMissing, BuildError.

    Functions that are not among the sources (memset, arithmetic in software) are named: the
    compiler does not tell what they take.
    """
    command = [ARM_COMPILER, *CORTEX, *FLAGS, "-fcallgraph-info=su", "-c", *sources]
    done = told(command, folder)
    tool = f"{ARM_COMPILER} {version_of(ARM_COMPILER, folder)}"
    if done.returncode:
        return Proof("stack", tool, "does not compile", tuple(done.stderr.splitlines()[:1]))
    calls = _read("\n".join((folder / f"{Path(s).stem}.ci").read_text() for s in sources))
    if entry not in calls.sizes:
        return Proof("stack", tool, "no result", (f"{entry} is not in the compiled code",))
    ways = calls.ways(entry)
    took = max(sum(calls.sizes.get(name, 0) for name in way) for way in ways)
    met = {name for way in ways for name in way}
    beside = ", ".join(sorted(met - set(calls.sizes)))
    found = [f"{way[-1]} calls itself" for way in ways if way[-1] in way[:-1]]
    found += [f"{name} takes more or less each time" for name in sorted(met & calls.growing)]
    if took > LIMIT:
        found.append(f"{entry} takes {took} bytes, {LIMIT} are allowed")
    about = f"{entry}: {took} bytes" + (f", beside what these take: {beside}" if beside else "")
    return Proof("stack", tool, about, tuple(dict.fromkeys(found)))


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
