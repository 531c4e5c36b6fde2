"""What generated C takes of a Cortex-M4F: sizes as other tools tell them, instructions of steps."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from fractions import Fraction
from pathlib import Path

import pytest

from codegen.emit.c_module import emit_c_files
from codegen.harness.instruction_count import count_instructions
from codegen.harness.metrics import measure_code
from codegen.toolchain.compiler import FLAGS
from codegen.toolchain.external_tools import ARM_COMPILER, EMULATOR
from codegen.toolchain.target_machine import CORTEX_FLAGS, CORTEX_M4F
from modewright.api.simulation import program
from modewright.cli.app import app
from modewright.cli.common.exit_codes import run_with_exit_code
from tests.codegen.hand_written_c.timing_comparison import duel
from tests.codegen.target.closed_loop import record_driveline

pytestmark = pytest.mark.skipif(
    not (shutil.which(ARM_COMPILER) and shutil.which(EMULATOR)),
    reason="no compiler for ARM, no emulator: make system-packages",
)
SIZED = re.compile(r"^[0-9a-f]+ ([0-9a-f]+) (\w) (\w+)$", re.MULTILINE)


def run(*arguments: str) -> int:
    return run_with_exit_code(lambda: app(list(arguments), standalone_mode=False))


@pytest.mark.parametrize("name", ["estimator_float32", "supervisor"])
def test_sizes_are_those_of_the_symbols(name: str, tmp_path: Path) -> None:
    used = program(name)
    files = emit_c_files(used)
    files["main.c"] = f'#include "{name}.h"\n{name}_Self one;\n{name}_In in;\n{name}_Out out;\n'
    for file, text in files.items():
        (tmp_path / file).write_text(text)
    sources = [file for file in files if file.endswith(".c")]
    command = [ARM_COMPILER, *CORTEX_FLAGS, *FLAGS, "-c", *sources]
    subprocess.run(command, cwd=tmp_path, check=True)
    objects = [file.replace(".c", ".o") for file in sources]
    listing = ["arm-none-eabi-nm", "-S", *objects]
    told = subprocess.run(listing, cwd=tmp_path, check=True, capture_output=True, text=True).stdout
    sizes = {symbol: (kind, int(size, 16)) for size, kind, symbol in SIZED.findall(told)}
    found = measure_code(used)
    assert (found.instance, found.inputs, found.outputs) == tuple(
        sizes[symbol][1] for symbol in ("one", "in", "out")
    )
    assert found.page == sizes[f"{name}_default_cal"][1]
    code = sum(size for kind, size in sizes.values() if kind in "tT")
    assert code <= found.code <= code + 1200, "literal pools and gaps are not of a symbol"
    assert found.data == 0
    assert found.constants > len(found.name)


def test_instructions_are_those_of_the_whole_run() -> None:
    """Another count, of all steps in one loop, has the mean of the steps one by one."""
    tape = record_driveline("float32", Fraction(6, 10), ["est"])["est"]
    found = count_instructions(tape.program, b"".join(tape.inputs))
    (whole, _) = duel(tape, "estimator", 1, CORTEX_M4F).best
    assert len(found.steps) == len(tape.inputs)
    assert whole - 25 < found.mean < whole, "the loop takes some instructions, too"
    assert found.steps[0] == min(found.steps) < found.steps[1], "the first tick only starts"
    most = measure_code(tape.program).longest
    assert most is not None
    assert max(found.steps) <= most, "a step takes no more than its machine code lets it"


def test_arithmetic_in_software_has_no_bound_and_says_so() -> None:
    found = measure_code(program("estimator_simple"))
    assert (found.longest, found.unbounded) == (
        None,
        "__aeabi_dmul has a loop of which no end is known",
    )


def test_the_command_measures_counts_and_draws(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "metrics.html"
    told = ("contactor", "--out", str(out), "--json")
    assert run("metrics", *told) == 0
    (found,) = json.loads(capsys.readouterr().out.partition("\nwrote")[0])["automata"]
    assert found["name"] == "contactor"
    assert found["rom"] == found["code"] + found["constants"] + found["page"]
    assert "<td>contactor</td>" in out.read_text()
    assert run("metrics", "contactor", "--out", str(tmp_path / "metrics.txt")) == 1
    assert run("metrics", "contactor", "--system", "ev_supervisor") == 2
