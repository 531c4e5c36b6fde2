"""What commands tell about a value outside its range, warnings and fault bits, with small specs."""

from __future__ import annotations

from pathlib import Path

import pytest

from modewright.cli.app import app
from modewright.cli.common.exit_codes import run_with_exit_code

SPEC = """language: 1
automaton: lamp
period: 10 ms
numbers: float32
micro_steps: 2
parameters:
  gain: {value: 1, range: [0.5, 1.5], tunable: true}
  force: {value: 1 kN, range: [0, 2], tunable: true}
  heat: {value: 20 degC, range: [-10, 40]}
inputs: {u: {unit: 1, range: [-1, 1], default: 1}}
equations: {level: gain * u, push: force * u, warm: heat}
initial: dark
modes:
  dark: {transitions: {dim: {when: after(20 ms)}}}
  dim: {transitions: {half: {when: level > 0.1}}}
  half: {transitions: {full: {when: level > 0.2}}}
  full: {}
outputs: [level, push, warm, mode]
"""
RUN = "language: 1\nscenario: run\nof: lamp\nhorizon: 50 ms\n"


@pytest.fixture(autouse=True)
def _in_a_project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "spec").mkdir()
    (tmp_path / "spec" / "lamp.yaml").write_text(SPEC)
    (tmp_path / "spec" / "run.yaml").write_text(RUN)
    monkeypatch.chdir(tmp_path)


def run(*arguments: str) -> int:
    return run_with_exit_code(lambda: app(list(arguments), standalone_mode=False))


@pytest.mark.parametrize(
    ("value", "told"),
    [
        ("gain=2", "the range is 0.5 to 1.5\n"),
        ("force=3 kN", "the range is 0 to 2 kN\n"),
        ("force=-1 N", "the range is 0 to 2 kN\n"),
        ("heat=50 degC", "the range is -10 to 40 degC\n"),
    ],
)
def test_a_value_outside_its_range(
    value: str, told: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run("simulate", "lamp", "-s", "run", "--set", value) == 1
    text = capsys.readouterr().err
    assert f"the value of `{value.partition('=')[0]}` is outside its range [MW310]" in text
    assert told in text


def test_a_fault_bit_has_its_time_and_mode(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("simulate", "lamp", "-s", "run", "--interpreted") == 0
    told = "warning: a fault bit is set: lamp: micro_step_limit, first at t = 0.02 s, "
    assert f"{told}`lamp` in mode `half`\n" in capsys.readouterr().err


def test_a_compiled_run_tells_how_to_get_the_time_of_a_fault(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert run("simulate", "lamp", "-s", "run", "--compiled") == 0
    told = capsys.readouterr().err
    assert "warning: a fault bit is set: lamp: micro_step_limit\n" in told
    assert "help: with `--interpreted` the time and the mode of a fault are told\n" in told


@pytest.mark.parametrize(
    ("extra", "told"),
    [
        ("", "1 spec checked, 0 problems\n"),
        ("  spare: {value: 1}\n", "1 spec checked, 0 problems, 1 warning\n"),
        ("  a_1: {value: 1}\n  a_2: {value: 1}\n", "1 spec checked, 0 problems, 2 warnings\n"),
    ],
)
def test_the_last_line_of_a_check_counts_warnings(
    extra: str, told: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = SPEC.replace("inputs:", f"{extra}inputs:")
    (tmp_path / "spec" / "lamp.yaml").write_text(text)
    assert run("check", "lamp") == 0
    assert capsys.readouterr().out == told
