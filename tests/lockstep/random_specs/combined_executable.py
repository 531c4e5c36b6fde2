"""Batch: the C of many Programs in one executable, each run by its name."""

from __future__ import annotations

import subprocess
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

from codegen.harness.harness import write_harness
from codegen.toolchain.compiler import compiler_version, find_compiler, flags_at_level
from codegen.toolchain.object_cache import is_shared, object_of
from language.ir.program import Program
from lockstep.comparison import Verdict, compare_output
from lockstep.tick_log import TickLog

ERRORS = ("-Werror=discarded-qualifiers", "-Werror=incompatible-pointer-types")
"""Warnings that are errors: what they name has no defined behaviour. Others are not asked for."""
FLAGS = (*flags_at_level("O1"), *ERRORS)
QUICK = (*flags_at_level("O0"), *ERRORS)
"""Where a difference has to be seen that an optimiser has no part in."""
SECONDS = 300
MAIN = "int main(void)"
DISPATCH = """\
#include <string.h>
%s
int main(int count, char **words)
{
    if (count != 2) {
        return 2;
    }
%s
    return 3;
}
"""


class Batch:
    """Compiles once, then runs any of its Programs on records of inputs."""

    def __init__(
        self, programs: Sequence[Program], folder: Path, flags: Sequence[str] = FLAGS
    ) -> None:
        """Write and compile the C of the Programs; two compilers run side by side."""
        folder.mkdir(parents=True, exist_ok=True)
        names = [program.name for program in programs]
        assert len(set(names)) == len(names)
        sources = [path for program in programs for path in _sources(program, folder)]
        pieces = [f'    if (strcmp(words[1], "{n}") == 0) {{ return run_{n}(); }}' for n in names]
        declared = "\n".join(f"int run_{name}(void);" for name in names)
        (folder / "main.c").write_text(DISPATCH % (declared, "\n".join(pieces)))
        unique = list(dict.fromkeys([*sources, folder / "main.c"]))
        with ThreadPoolExecutor(2) as pool:
            objects = list(pool.map(partial(_compiled, flags), unique))
        self._target = folder / "batch"
        _done([*find_compiler(), *map(str, objects), "-lm", "-o", str(self._target)])

    def run(self, program: Program, records: bytes) -> bytes:
        """Return the output records of a Program for records of inputs."""
        command = [str(self._target), program.name]
        done = subprocess.run(command, input=records, capture_output=True, timeout=SECONDS)
        assert done.returncode == 0, done.returncode
        return done.stdout

    def verdict(self, tape: TickLog) -> Verdict:
        """Return what the comparison of a tape with the C of its Program gives."""
        return compare_output(tape, self.run(tape.program, b"".join(tape.inputs)))


def _sources(program: Program, folder: Path) -> list[Path]:
    """Return what is compiled: module and harness as one unit, and the mathematics."""
    written = write_harness(program, folder)
    harness = (folder / "main.c").read_text()
    assert MAIN in harness
    unit = folder / f"unit_{program.name}.c"
    renamed = harness.replace(MAIN, f"int run_{program.name}(void)")
    unit.write_text(f'#include "{program.name}.c"\n{renamed}')
    own = (f"{program.name}.c", "main.c")
    return [unit, *(path for path in written if path.name not in own)]


def _compiled(flags: Sequence[str], source: Path) -> Path:
    if is_shared(source):
        return object_of(
            source, [*find_compiler(), *flags], compiler_version(), source.parent / "room"
        )
    target = source.with_suffix(".o")
    _done([*find_compiler(), *flags, "-c", str(source), "-o", str(target)])
    return target


def _done(command: list[str]) -> None:
    done = subprocess.run(command, capture_output=True, text=True, timeout=SECONDS)
    assert done.returncode == 0, done.stderr[:2000]
