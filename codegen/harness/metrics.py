"""Code metrics: ROM, RAM, stack and worst-case instructions of generated C on a Cortex-M4F."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from codegen.emit.c_module import emit_c_files
from codegen.harness.stack_usage import stack_usage
from codegen.harness.worst_case_instructions import UnboundedError, worst_case_instructions
from codegen.toolchain.compiler import FLAGS
from codegen.toolchain.external_tools import ARM_COMPILER, ARM_SIZE, output_of
from codegen.toolchain.target_machine import CORTEX_FLAGS
from language.ir.program import Program
from language.text.temporary_files import temporary_folder

STRUCTURES = ("Self", "In", "Out")
"""The structures whose sizes are measured."""
SIZE_PROBE = "const char of_{structure}[sizeof({name}_{structure})] = {{0}};\n"
"""A C array whose section has the size of a structure."""
SECTION = re.compile(r"^(\.[\w.]+)\s+(\d+)\s+\d+", re.MULTILINE)
"""The line of a section in the output of size: name and size [bytes]."""
SECTION_KINDS = {".text": "code", ".rodata": "constants", ".data": "data", ".bss": "data"}
"""The contents of a section by the first part of its name."""


@dataclass(frozen=True)
class Metrics:
    """Sizes [bytes] and worst-case instructions of generated C.

    ROM: `code`, its `constants`, and the calibration `page`. RAM: `data` outside of instances, one
    `instance`, and the structures of `inputs` and `outputs`. `stack` is the stack of a step;
    `beside` names called functions whose stack is unknown. `longest` is the maximum number of
    instructions of a step, or None; `unbounded` then tells why there is no bound.
    """

    name: str
    number: str
    code: int
    constants: int
    page: int
    data: int
    instance: int
    inputs: int
    outputs: int
    stack: int
    beside: tuple[str, ...]
    longest: int | None
    unbounded: str

    @property
    def rom(self) -> int:
        """The sum of code, constants and the default page [bytes]."""
        return self.code + self.constants + self.page


def measure_code(program: Program) -> Metrics:
    """Compile the C of a Program for a Cortex-M4F with `-O2` and measure it.

    The function that is measured is `<program>_Step`. Without a bound of its instructions `longest`
    is None. Raises MissingToolError, BuildError.
    """
    name = program.name
    with temporary_folder() as folder:
        files = emit_c_files(program)
        probes = "".join(SIZE_PROBE.format(structure=one, name=name) for one in STRUCTURES)
        for file, text in {**files, "probe.c": f'#include "{name}.h"\n{probes}'}.items():
            (folder / file).write_text(text)
        sources = [file for file in files if file.endswith(".c")]
        section_sizes = _section_sizes(folder, sources)
        sizes = _section_sizes(folder, ["probe.c"])
        stack = stack_usage(folder, sources, f"{name}_Step")
        longest, unbounded = _worst_case(folder, sources, f"{name}_Step")
    kinds: Counter[str] = Counter()
    for section, size in section_sizes.items():
        kinds[SECTION_KINDS.get("." + section.split(".")[1], "")] += size
    return Metrics(
        name,
        program.number_type,
        code=kinds["code"],
        constants=kinds["constants"],
        page=section_sizes[f".calibration.{name}"],
        data=kinds["data"],
        instance=sizes[".rodata.of_Self"],
        inputs=sizes[".rodata.of_In"],
        outputs=sizes[".rodata.of_Out"],
        stack=stack.stack_bound,
        beside=stack.unknown_functions,
        longest=longest,
        unbounded=unbounded,
    )


def _worst_case(folder: Path, sources: Sequence[str], entry: str) -> tuple[int | None, str]:
    """Return the maximum number of instructions of a step, or None and the reason."""
    try:
        return worst_case_instructions(folder, sources, entry), ""
    except UnboundedError as error:
        return None, str(error)


def _section_sizes(folder: Path, sources: Sequence[str]) -> Counter[str]:
    """Return the size [bytes] of each section, summed over the compiled C files."""
    output_of([ARM_COMPILER, *CORTEX_FLAGS, *FLAGS, "-fdata-sections", "-c", *sources], folder)
    objects = [f"{Path(source).stem}.o" for source in sources]
    sizes: Counter[str] = Counter()
    for line in SECTION.finditer(output_of([ARM_SIZE, "-A", "-d", *objects], folder)):
        sizes[line[1]] += int(line[2])
    return sizes
