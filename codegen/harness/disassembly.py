"""Disassembly: the machine code of generated C for a Cortex-M4F, with the loops it comes from."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import takewhile
from pathlib import Path

from codegen.toolchain.compiler import FLAGS
from codegen.toolchain.external_tools import ARM_COMPILER, ARM_LINES, ARM_OBJECTS, output_of
from codegen.toolchain.machine import CORTEX_FLAGS, CORTEX_LINK_FLAGS

IMAGE_FILE = "image.elf"
FUNCTION = re.compile(r"^[0-9a-f]+ <(?P<name>[^>]+)>:$")
INSTRUCTION = re.compile(r"^ *(?P<at>[0-9a-f]+):\t(?P<name>[^.\s]\S*)(?:\t(?P<operands>[^;@]*))?")
LOOP = re.compile(r"^(?P<margin> *)for \(int32_t \w+ = 0; \w+ < (?P<turns>\d+); \w+\+\+\) \{")
"""How generated C writes a loop, whose end has the margin of its head."""


@dataclass(frozen=True)
class Instruction:
    """`loops` are those of C around it, each with its turns, around what it was inlined into too;
    `target` is the address that its operands name.
    """

    address: str
    name: str
    operands: str
    loops: Mapping[str, int]

    @property
    def target(self) -> str:
        """The address of a branch or call; empty if there is none."""
        found = re.search(r"\b([0-9a-f]+) <", self.operands)
        return found[1] if found else ""


def disassemble(
    folder: Path, sources: Sequence[str], entry: str
) -> Mapping[str, tuple[Instruction, ...]]:
    """Compile and link sources; return what an entry needs: its function and others, by name.

    Raises ToolMissing, BuildError.
    """
    words = [
        *CORTEX_FLAGS,
        *FLAGS,
        "-g",
        *CORTEX_LINK_FLAGS,
        f"-Wl,--entry={entry}",
        "-o",
        IMAGE_FILE,
    ]
    output_of([ARM_COMPILER, *words, *sources, "-lm", "-lc", "-lgcc"], folder)
    functions = _parse_functions(
        output_of([ARM_OBJECTS, "-d", "--no-show-raw-insn", IMAGE_FILE], folder)
    )
    loops = {source: _find_loops((folder / source).read_text()) for source in sources}
    addresses = [match["at"] for found in functions.values() for match in found]
    around = _enclosing_loops(folder, addresses, loops)
    return {
        name: tuple(
            Instruction(one["at"], one["name"], (one["operands"] or "").strip(), around[one["at"]])
            for one in found
        )
        for name, found in functions.items()
    }


def _parse_functions(text: str) -> dict[str, list[re.Match[str]]]:
    """Return the lines of instructions by function; constants between them begin with a dot."""
    lines_by_function: dict[str, list[re.Match[str]]] = {}
    own: list[re.Match[str]] = []
    for line in text.splitlines():
        if head := FUNCTION.match(line):
            own = lines_by_function.setdefault(head["name"], [])
        elif match := INSTRUCTION.match(line):
            own.append(match)
    return lines_by_function


def _find_loops(text: str) -> list[tuple[range, int]]:
    """Return the lines of each loop of generated C and how often it turns."""
    lines = text.splitlines()
    loops = []
    for first, line in enumerate(lines, start=1):
        if match := LOOP.match(line):
            inside = takewhile(lambda one: not one.startswith(match["margin"] + "}"), lines[first:])
            loops.append((range(first, first + 1 + sum(1 for _ in inside)), int(match["turns"])))
    return loops


def _enclosing_loops(
    folder: Path, addresses: Sequence[str], loops: Mapping[str, list[tuple[range, int]]]
) -> dict[str, dict[str, int]]:
    """Return the loops around each address, along all functions that it is inlined into."""
    (folder / "addresses").write_text("\n".join(f"0x{one}" for one in addresses) + "\n")
    text = output_of([ARM_LINES, "-e", IMAGE_FILE, "-i", "-a", "@addresses"], folder)
    loops_by_address: dict[str, dict[str, int]] = {}
    own: dict[str, int] = {}
    for line in text.splitlines():
        if line.startswith("0x"):
            own = loops_by_address.setdefault(f"{int(line, 16):x}", {})
            continue
        place, _, number = line.split(" ")[0].rpartition(":")
        at = int(number) if number.isdigit() else 0
        for lines, turns in loops.get(Path(place).name, ()):
            if at in lines:
                own[f"{Path(place).name}:{lines.start}"] = turns
    return loops_by_address
