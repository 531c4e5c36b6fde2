"""JSON outputs name their format and its schema version."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from modewright.cli.app import app
from modewright.cli.common.exit_codes import run_with_exit_code
from modewright.runtime.json_format import format_entry

ROOT = Path(__file__).parents[3]


def test_the_entry_has_name_and_version() -> None:
    assert format_entry("fit") == {"format": "modewright-fit/1"}


@pytest.mark.parametrize(
    ("arguments", "name"),
    [
        (["check", "driveline", "--json"], "problems"),
        (["explain", "driveline", "--json"], "spec"),
        (["explain", "driveline", "driveline_load", "--json"], "spec-differences"),
        (["diff", "driveline", "driveline_load", "--json"], "diff"),
        (["effects", "coulomb_friction", "--json"], "effects"),
        (["simulate", "ev_driveline", "-s", "tip_out", "--json"], "run"),
        (["compare", "ev_driveline:tip_out", "ev_driveline:tip_out", "--json"], "comparison"),
        (["trace", "estimator", "--json"], "trace"),
        (["trace", "estimator", "--keys", "--json"], "key-trace"),
        (
            ["calibration", "export", "estimator", "--out", "{folder}/p.csv", "--json"],
            "calibration",
        ),
    ],
)
def test_a_command_prints_its_format(
    arguments: list[str],
    name: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(ROOT)
    words = [word.replace("{folder}", str(tmp_path)) for word in arguments]
    run_with_exit_code(lambda: app(words, standalone_mode=False))
    assert json.loads(capsys.readouterr().out)["format"] == f"modewright-{name}/1"
