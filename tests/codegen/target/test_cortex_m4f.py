"""The C on an emulated Cortex-M4F: the same bits, and controls that must fail."""

from __future__ import annotations

import shutil
from fractions import Fraction
from pathlib import Path

import pytest

from codegen.toolchain.compiler import FLAGS, BuildError, flags_at_level
from codegen.toolchain.external_tools import ARM_COMPILER, EMULATOR
from codegen.toolchain.target_machine import CORTEX_M4F, run_in_qemu
from language.ir.number_type import NUMBER_TYPES, NumberType
from lockstep.comparison import compare
from lockstep.tick_log import TickLog
from modewright.api.simulation import lockstep, program
from tests.codegen.target.closed_loop import record_driveline, record_supervisor
from tests.lockstep.program_strategies import record_ticks
from tests.lockstep.test_compiler_flags import PRODUCT, TINY

pytestmark = pytest.mark.skipif(
    not (shutil.which(ARM_COMPILER) and shutil.which(EMULATOR)),
    reason="no compiler for ARM, no emulator: make system-packages",
)
LEVELS = ("O0", "Os")
"""The two whose code is least alike; `make verify` compares O2 and O3 too."""


@pytest.fixture(scope="module", params=NUMBER_TYPES)
def tapes(request: pytest.FixtureRequest) -> dict[str, TickLog]:
    number: NumberType = request.param
    short = Fraction(3, 2)
    return {
        **record_driveline(number, short, ["plant", "est", "simple"]),
        **record_supervisor(number, Fraction(20)),
    }


@pytest.mark.parametrize("level", LEVELS)
@pytest.mark.parametrize("name", ["plant", "est", "simple", "sup"])
def test_the_target_computes_the_same_bits(
    tapes: dict[str, TickLog], name: str, level: str
) -> None:
    verdict = compare(tapes[name], flags_at_level(level), machine=CORTEX_M4F)
    assert verdict.is_equal, str(verdict.first)
    assert verdict.transitions > 0
    assert verdict.ticks == len(tapes[name].values) >= 150


def product(folder: Path, number: NumberType) -> TickLog:
    """u * u - v where the product is rounded to v: 0, or the rounding error if contracted."""
    spec = folder / "product.yaml"
    spec.write_text(PRODUCT.replace("float64", number))
    tiny = TINY[number]
    return record_ticks(program(str(spec)), [{"input.u": 1.0 + tiny, "input.v": 1.0 + 2.0 * tiny}])


@pytest.mark.parametrize(
    "flags", [("-std=c99", "-O2", "-ffp-contract=fast"), ("-std=gnu99", "-O2")]
)
def test_a_compiler_that_contracts_is_caught(tmp_path: Path, flags: tuple[str, ...]) -> None:
    tape = product(tmp_path, "float32")
    assert compare(tape, FLAGS, machine=CORTEX_M4F).is_equal
    verdict = compare(tape, flags, machine=CORTEX_M4F)
    assert verdict.first is not None
    assert verdict.first.signal == "rest"


def test_fast_math_is_refused_by_the_code_itself(tmp_path: Path) -> None:
    with pytest.raises(BuildError, match="exact only without fast-math"):
        compare(product(tmp_path, "float32"), (*FLAGS, "-ffast-math"), machine=CORTEX_M4F)


def test_a_program_that_fails_on_the_target_is_told(tmp_path: Path) -> None:
    image = tmp_path / "image"
    image.write_bytes(b"no program")
    with pytest.raises(BuildError, match="the emulated program ended with"):
        run_in_qemu(image, b"")


def test_the_command_takes_a_target() -> None:
    trajectory, verdicts = lockstep("supervised", "day", target="cortex-m4f")
    assert trajectory.stopped is None
    assert [verdict.differing for verdict in verdicts] == [0]
    assert verdicts[0].ticks > 100
