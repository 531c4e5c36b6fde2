"""Fuzzing: what libFuzzer finds is the same in the engine; what is not is told."""

from __future__ import annotations

import json
import math
import shutil

import pytest

from codegen.coverage.libfuzzer import (
    ABSOLUTE_WORDS,
    FUZZER_COMPILER,
    WORDS_PER_INPUT,
    decode_sequence,
    word_table,
)
from codegen.emit.c_module import emit_c_files
from codegen.harness.harness import tick_inputs
from language.ir.program import Program, unqualified_name
from lockstep.fuzzing import fuzz
from modewright.api import code_generation as code
from modewright.api.simulation import program
from modewright.cli.app import app
from modewright.cli.common.exit_codes import run_with_exit_code

needs_fuzzer = pytest.mark.skipif(
    not shutil.which(FUZZER_COMPILER), reason="no clang-19: make system-packages"
)
RUNS = 400


@pytest.mark.long
@needs_fuzzer
@pytest.mark.parametrize("name", ["contactor", "estimator_float32", "supervisor"])
def test_engine_and_c_agree_on_what_is_found(name: str) -> None:
    found = code.fuzz(name, RUNS)
    assert found.is_clean, found
    assert found.runs >= RUNS and found.distinct > RUNS / 2
    assert found.ticks > found.distinct and found.transitions > 0 and found.edges > 10
    assert len(found.modes) >= 2


@pytest.mark.long
@needs_fuzzer
@pytest.mark.parametrize(
    ("name", "right", "wrong", "told"),
    [
        ("contactor", "self->faults = 0U;", "self->faults = 8U;", "`faults` is 0"),
        ("estimator_simple", "latched.y_em - self", "latched.y_em + -0.5 * self", "in the engine"),
    ],
)
def test_another_bit_is_found(
    name: str, right: str, wrong: str, told: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    changed(name, right, wrong, monkeypatch)
    found = fuzz(program(name), {}, RUNS)
    assert not found.is_clean and found.differing > 0
    assert told in str(found.first)


@pytest.mark.long
@needs_fuzzer
def test_a_store_beyond_its_array_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    place = "self->log[self->count_of_log"
    changed("supervisor", f"{place}]", f"{place} + 24]", monkeypatch)
    found = fuzz(program("supervisor"), {}, RUNS)
    assert not found.is_clean and "out of bounds" in found.findings[0]


@needs_fuzzer
def test_what_fails_before_its_first_tick_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    wrong = "{ volatile int none = 0; self->faults = (uint32_t)(1 / none); }"
    changed("contactor", "self->faults = 0U;", wrong, monkeypatch)
    found = fuzz(program("contactor"), {}, RUNS)
    assert not found.is_clean and found.runs == 0
    assert "division by zero" in found.findings[0]


def changed(name: str, right: str, wrong: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the C of an automaton be another one."""

    def torn(made: Program) -> dict[str, str]:
        files = emit_c_files(made)
        text = files[f"{name}.c"]
        assert right in text
        return {**files, f"{name}.c": text.replace(right, wrong)}

    monkeypatch.setattr("codegen.harness.harness.emit_c_files", torn)


def test_bytes_are_values_and_changes() -> None:
    used = program("supervisor")
    table = word_table(used, {unqualified_name(v.name): (0.0, 500.0) for v in tick_inputs(used)})
    assert all(len(own) == WORDS_PER_INPUT for own in table)
    names = [v.name for v in tick_inputs(used)]
    volts, key = names.index("input.U_dc"), names.index("input.key")
    assert table[volts][0] == 0.0 and table[volts][63] == 500.0
    assert any(math.isnan(word) for word in table[volts][:ABSOLUTE_WORDS])
    assert {0.0, 1.0, 2.0, 3.0, 255.0} <= set(table[key])
    ticks = [bytearray(len(table)) for _ in range(3)]
    ticks[0][volts], ticks[1][volts], ticks[2][volts] = 63, ABSOLUTE_WORDS + 2, 255
    found = [
        list(tick) for tick in decode_sequence(used, table, b"".join(map(bytes, ticks)) + b"\0")
    ]
    assert [tick[volts] for tick in found] == [500.0, *[500.0 + 500.0 * 2**-0.5] * 2]


@needs_fuzzer
def test_the_command_tells_what_was_tried(capsys: pytest.CaptureFixture[str]) -> None:
    words_of = ["fuzz", "contactor", "--runs", "300"]
    assert run_with_exit_code(lambda: app(words_of, standalone_mode=False)) == 0
    assert "0 sequences differ from the engine" in capsys.readouterr().out
    assert run_with_exit_code(lambda: app([*words_of, "--json"], standalone_mode=False)) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["clean"] and found["modes"] == ["open", "shut"] and found["first"] is None


def test_a_continuous_automaton_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(ValueError, match="driveline is continuous"):
        code.fuzz("driveline", 10)
    assert run_with_exit_code(lambda: app(["fuzz", "driveline"], standalone_mode=False)) == 2
    assert "is continuous" in capsys.readouterr().err
