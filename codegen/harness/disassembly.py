"""Disassembly: the machine code of generated C for a Cortex-M4F, with the C loops around it."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import takewhile
from pathlib import Path

from codegen.toolchain.compiler import FLAGS
from codegen.toolchain.external_tools import ARM_COMPILER, ARM_LINES, ARM_OBJECTS, output_of
from codegen.toolchain.target_machine import CORTEX_FLAGS, CORTEX_LINK_FLAGS

IMAGE_FILE = "image.elf"
"""The name of the linked program."""
FUNCTION = re.compile(r"^[0-9a-f]+ <(?P<name>[^>]+)>:$")
"""The first line of a function in the output of objdump."""
INSTRUCTION = re.compile(r"^ *(?P<at>[0-9a-f]+):\t(?P<name>[^.\s]\S*)(?:\t(?P<operands>[^;@]*))?")
"""The line of an instruction in the output of objdump."""
LOOP = re.compile(r"^(?P<margin> *)for \(int32_t \w+ = 0; \w+ < (?P<turns>\d+); \w+\+\+\) \{")
"""The first line of a loop in generated C; the end of the loop has the same indentation."""


@dataclass(frozen=True)
class Instruction:
    """A machine instruction.

    `loops` maps each C loop around it, also around functions that it was inlined into, to its
    number of iterations.
    """

    address: str
    name: str
    operands: str
    loops: Mapping[str, int]

    @property
    def target(self) -> str:
        """The target address of a branch or call in hexadecimal; empty if there is none."""
        match = re.search(r"\b([0-9a-f]+) <", self.operands)
        return match[1] if match else ""


def disassemble(
    folder: Path, sources: Sequence[str], entry: str
) -> Mapping[str, tuple[Instruction, ...]]:
    """Compile and link C files for a Cortex-M4F; return the instructions of each function by name.

    `sources` are names of files in `folder`, where the image is written too. Only functions that
    `entry` needs are linked; those of libraries are included. Data between instructions are left
    out. Raises MissingToolError, BuildError.
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
    """Return the matched lines of instructions by function.

    Data between instructions have a name that begins with a dot and are left out.
    """
    lines_by_function: dict[str, list[re.Match[str]]] = {}
    own: list[re.Match[str]] = []
    for line in text.splitlines():
        if head := FUNCTION.match(line):
            own = lines_by_function.setdefault(head["name"], [])
        elif match := INSTRUCTION.match(line):
            own.append(match)
    return lines_by_function


def _find_loops(text: str) -> list[tuple[range, int]]:
    """Return the lines and the number of iterations of each loop of generated C."""
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
    """Return for each address the C loops around it, also those around inlined functions."""
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
