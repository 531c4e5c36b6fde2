"""Flags: which of them keep the bits, which change them, and what is in the compiled code."""

from __future__ import annotations

import dataclasses
import platform
import re
import shutil
import subprocess
from fractions import Fraction
from pathlib import Path

import pytest

from codegen.emit.c_module import emit_c_files
from codegen.harness.harness import write_harness
from codegen.toolchain.compiler import (
    FLAGS,
    WARNINGS,
    BuildError,
    compile_program,
    find_compiler,
    flags_at_level,
)
from language.ir.number_type import NUMBER_TYPES, NumberType, shortest_decimal
from language.loading.system_reader import with_number_type
from lockstep import tick_log as taping
from lockstep.comparison import compare
from lockstep.tick_log import TickLog
from modewright.api.simulation import load, program
from tests.lockstep.program_strategies import record_ticks

LEVELS = ("-O0", "-O2", "-O3", "-Os", "-O3 -march=native")
"""The optimisations that must not change a bit; the last one may use fused operations."""
FUSED = re.compile(r"\bv?fn?m(?:add|sub|la|ls)", re.IGNORECASE)
"""Instructions that multiply and add with one rounding: x86 vfmadd, ARM fmadd and vfma."""
TINY: dict[NumberType, float] = {"float64": 2.0**-30, "float32": 2.0**-12}
"""(1 + tiny)^2 rounds to 1 + 2 tiny; what is lost is tiny^2."""
LOST = {"float64": "0x3c30000000000000", "float32": "0x33800000"}
NOTHING = {"float64": "0x0000000000000000", "float32": "0x00000000"}
EXACT = {"sqrt", "fabs", "sqrtf", "fabsf", "floorf", "memcpy", "memset"}
"""What generated code may take from the C library: exact to the last bit, or no arithmetic."""
PRODUCT = """\
language: 1
automaton: product
period: 1 ms
numbers: float64
inputs: {u: {unit: "1"}, v: {unit: "1"}}
equations: {rest: u * u - v}
modes: {only: {}}
outputs: [rest]
"""


@pytest.fixture(scope="module", params=NUMBER_TYPES)
def tapes(request: pytest.FixtureRequest) -> dict[str, TickLog]:
    """Both estimators through the first gaps of a tip-out; the plant stays in float64."""
    loaded = load("ev_driveline", "tip_out")
    narrow = with_number_type(loaded.system, request.param).instances
    instances = {**narrow, "plant": loaded.system.instances["plant"]}
    system = dataclasses.replace(loaded.system, instances=instances)
    scenario = dataclasses.replace(loaded.scenario, horizon=Fraction(9, 10))
    return {tape.program.name: tape for tape in taping.record_ticks(system, scenario)[1].values()}


@pytest.fixture(params=NUMBER_TYPES)
def product(tmp_path: Path, request: pytest.FixtureRequest) -> TickLog:
    """u * u - v where the product is rounded to v: 0, or the rounding error if contracted."""
    spec = tmp_path / "product.yaml"
    spec.write_text(PRODUCT.replace("float64", request.param))
    tiny = TINY[request.param]
    return record_ticks(program(str(spec)), [{"input.u": 1.0 + tiny, "input.v": 1.0 + 2.0 * tiny}])


def has_fused_operations() -> bool:
    """Tell whether this CPU multiplies and adds with one rounding."""
    if platform.machine() in ("aarch64", "arm64"):
        return True
    info = Path("/proc/cpuinfo")
    return info.exists() and " fma " in info.read_text()


@pytest.mark.long
@pytest.mark.parametrize("level", LEVELS)
@pytest.mark.parametrize("name", ["estimator", "estimator_simple"])
def test_optimisation_keeps_every_bit_of_a_tip_out(
    tapes: dict[str, TickLog], name: str, level: str
) -> None:
    flags = [flag for flag in FLAGS if flag != "-O2"] + level.split()
    verdict = compare(tapes[name], flags)
    assert verdict.is_equal, str(verdict.first)
    assert verdict.transitions > 0
    assert verdict.ticks in (901, 91)


def test_contraction_is_forbidden_and_would_be_found(product: TickLog) -> None:
    assert "-ffp-contract=off" in FLAGS
    assert {"-std=c99", "-fno-fast-math"} <= {*FLAGS}
    assert compare(product, (*FLAGS, "-march=native")).is_equal
    verdict = compare(product, ("-std=c99", "-O2", "-march=native", "-ffp-contract=fast"))
    assert verdict.is_equal == (not has_fused_operations())
    if verdict.first:
        assert verdict.first.signal == "rest"
        number = product.program.number_type
        lost = shortest_decimal(TINY[number] ** 2, number)
        assert verdict.first.engine == f"0.0 ({NOTHING[number]})"
        assert verdict.first.compiled == f"{lost} ({LOST[number]})"


@pytest.mark.long
@pytest.mark.parametrize("named", ["gcc", "clang-19"])
def test_every_compiler_gives_the_same_bits(tapes: dict[str, TickLog], named: str) -> None:
    if shutil.which(named) is None:
        pytest.skip(f"{named} is not installed: make system-packages")
    for level in ("O0", "O2", "O3"):
        verdict = compare(tapes["estimator"], flags_at_level(level), named)
        assert verdict.is_equal, f"-{level}: {verdict.first}"


@pytest.mark.parametrize("flag", ["-ffast-math", "-Ofast"])
def test_generated_code_refuses_fast_math(product: TickLog, flag: str) -> None:
    with pytest.raises(BuildError, match="exact only without fast-math"):
        compare(product, ("-std=c99", "-O2", flag))


def test_generated_code_refuses_excess_precision(product: TickLog) -> None:
    """The x87 unit computes with 64 bits; elsewhere the header must give the same answer."""
    if platform.machine() == "x86_64":
        with pytest.raises(BuildError, match="without excess precision"):
            compare(product, (*FLAGS, "-mfpmath=387"))
    text = emit_c_files(product.program)["product.c"]
    assert "#if defined(__FAST_MATH__) || (FLT_EVAL_METHOD != 0)\n#error" in text


def test_warnings_are_errors(tmp_path: Path) -> None:
    source = tmp_path / "main.c"
    source.write_text("int main(void)\n{\n    int unused;\n    return 0;\n}\n")
    with pytest.raises(BuildError, match="Werror"):
        compile_program([source], tmp_path / "program", [*FLAGS, "-Werror"])
    wanted = {"-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wdouble-promotion", "-Wshadow"}
    assert wanted <= {*WARNINGS}


@pytest.mark.parametrize(
    "name", ["estimator", "estimator_simple", "leaf", "estimator_float32", "hko"]
)
def test_objects_need_nothing_inexact_from_a_library(name: str, tmp_path: Path) -> None:
    for found in objects(name, tmp_path, FLAGS):
        lines = output("nm", "--undefined-only", str(found)).splitlines()
        needed = {line.split()[-1].lstrip("_") for line in lines}
        foreign = {symbol for symbol in needed if not symbol.startswith(("ha_", name))}
        assert foreign <= EXACT | {"GLOBAL_OFFSET_TABLE_"}


@pytest.mark.parametrize("name", ["estimator", "estimator_simple"])
def test_no_fused_operation_even_where_the_cpu_has_them(name: str, tmp_path: Path) -> None:
    for found in objects(name, tmp_path, (*FLAGS, "-O3", "-march=native")):
        assert not FUSED.search(output("objdump", "--disassemble", str(found)))


def test_the_search_for_fused_operations_finds_them(product: TickLog, tmp_path: Path) -> None:
    flags = ("-std=c99", "-O2", "-march=native", "-ffp-contract=fast")
    folder = tmp_path / "c"
    folder.mkdir()
    write_harness(product.program, folder)
    made = compiled(folder / "product.c", flags)
    text = output("objdump", "--disassemble", str(made))
    assert bool(FUSED.search(text)) == has_fused_operations()


def objects(name: str, folder: Path, flags: tuple[str, ...]) -> list[Path]:
    """Return the compiled objects of an automaton, without the harness."""
    sources = write_harness(program(name), folder)
    return [
        compiled(path, flags) for path in sources if path.parent == folder and path.name != "main.c"
    ]


def compiled(source: Path, flags: tuple[str, ...]) -> Path:
    target = source.with_suffix(".o")
    output(*find_compiler(), *flags, "-c", str(source), "-o", str(target))
    return target


def output(*command: str) -> str:
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout
