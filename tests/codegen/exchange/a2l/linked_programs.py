"""Linked: programs around generated C, and where its members lie as the compiler says itself."""

from __future__ import annotations

import struct
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from codegen.emit.c_module import emit_c_files
from codegen.exchange.a2l.description import ModuleDescription
from codegen.toolchain.external_tools import ARM_COMPILER
from language.ir.program import Program

HOST = ("gcc", "-no-pie")
CORTEX = (ARM_COMPILER, "-mcpu=cortex-m4", "-mthumb", "-nostartfiles", "--specs=nosys.specs")
DECLARED = "static {name}_Self self; static {name}_Cal page;"
MAIN = """\
#include "{name}.h"
{declared}
const void *const places[] __attribute__((section(".places"), used)) = {{
    {members}
}};
int main(void)
{{
    {name}_In in = {{0}};
    {name}_Out out;
    {use}
}}
void _start(void);
void __attribute__((weak)) _start(void) {{ (void)main(); }}
"""
USE = """{name}_Init(&{self}, &{page});
    {name}_Step(&{self}, &{page}, &in, &out);"""


@dataclass(frozen=True)
class Target:
    """A compiler with its words, what copies sections, and the bytes of an address."""

    command: Sequence[str]
    copy: str
    pointer: str


TARGETS = {
    "host": Target(HOST, "objcopy", "<Q"),
    "cortex-m4f": Target(CORTEX, "arm-none-eabi-objcopy", "<I"),
}


def link_program(
    program: Program,
    found: ModuleDescription,
    folder: Path,
    target: Target = TARGETS["host"],
    declared: str = DECLARED,
    uses: Sequence[tuple[str, str]] = (("self", "page"),),
    words: Sequence[str] = ("-g",),
) -> Path:
    """Compile the C of a program with a main that knows the address of every member."""
    instance, page = uses[0]
    paths = [f"&{instance}.{m.path}" for m in found.measurements]
    paths += [f"&{page}.{c.path}" for c in found.characteristics]
    text = MAIN.format(
        name=program.name,
        declared=declared.format(name=program.name),
        members=", ".join(f"(const void *){path}" for path in paths),
        use="\n".join(USE.format(name=program.name, self=s, page=p) for s, p in uses),
    )
    files = {**emit_c_files(program), "main.c": text}
    for name, source in files.items():
        (folder / name).write_text(source)
    sources = [name for name in files if name.endswith(".c")]
    command = [*target.command, "-std=gnu99", "-O1", *words, *sources, "-o", "app.elf", "-lm"]
    subprocess.run(command, cwd=folder, check=True, capture_output=True)
    return folder / "app.elf"


def symbol_addresses(
    elf: Path, found: ModuleDescription, target: Target = TARGETS["host"]
) -> dict[str, int]:
    """Return the address of everything that is described, as the linker filled it in."""
    raw = read_section(elf, ".places", target)
    named = [one.name for one in found.measurements] + [one.name for one in found.characteristics]
    return dict(zip(named, (at for (at,) in struct.iter_unpack(target.pointer, raw)), strict=True))


def read_section(elf: Path, name: str, target: Target = TARGETS["host"]) -> bytes:
    """Return the bytes of a section."""
    out = elf.with_suffix(".bin")
    command = [target.copy, "-O", "binary", "--only-section", name, str(elf), str(out)]
    subprocess.run(command, check=True, capture_output=True)
    return out.read_bytes()
