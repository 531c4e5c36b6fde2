"""Stack: the most that a step takes of it, along the calls that the compiler reports."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from codegen.build import FLAGS
from codegen.machine import ARM_COMPILER, CORTEX
from codegen.proofs.proof import Proof, told, version_of

LIMIT = 256
"""Bytes that a step may take."""
NODE = re.compile(r'node: \{ title: "(?P<name>[^"]+)" label: "[^"]*\\n(?P<bytes>\d+) bytes ')
EDGE = re.compile(r'edge: \{ sourcename: "(?P<caller>[^"]+)" targetname: "(?P<called>[^"]+)"')


@dataclass(frozen=True)
class _Calls:
    """What functions take [bytes], and whom they call."""

    sizes: Mapping[str, int]
    called: Mapping[str, tuple[str, ...]]

    def deepest(self, name: str, above: tuple[str, ...] = ()) -> int:
        """Return what a function takes with all that it calls. Raises ValueError if it recurs."""
        if name in above:
            raise ValueError(f"{name} calls itself")
        inner = [self.deepest(one, (*above, name)) for one in self.called.get(name, ())]
        return self.sizes.get(name, 0) + max(inner, default=0)


def stack(folder: Path, sources: Sequence[str], entry: str) -> Proof:
    """Compile for a Cortex-M4F and add up what a step takes. Raises ToolMissing, BuildError."""
    command = [ARM_COMPILER, *CORTEX, *FLAGS, "-fcallgraph-info=su", "-c", *sources]
    done = told(command, folder)
    tool = f"{ARM_COMPILER} {version_of(ARM_COMPILER, folder)}"
    if done.returncode:
        return Proof("stack", tool, "does not compile", tuple(done.stderr.splitlines()[:1]))
    calls = _read("\n".join((folder / f"{Path(s).stem}.ci").read_text() for s in sources))
    took = calls.deepest(entry)
    found = (f"{entry} takes {took} bytes, {LIMIT} are allowed",) if took > LIMIT else ()
    return Proof("stack", tool, f"{entry}: {took} bytes", found)


def _read(text: str) -> _Calls:
    sizes = {_own(m["name"]): int(m["bytes"]) for m in NODE.finditer(text)}
    called: dict[str, tuple[str, ...]] = {}
    for match in EDGE.finditer(text):
        caller = _own(match["caller"])
        called[caller] = (*called.get(caller, ()), _own(match["called"]))
    return _Calls(sizes, called)


def _own(name: str) -> str:
    """Static functions have their file before their name."""
    return name.rpartition(":")[2]
