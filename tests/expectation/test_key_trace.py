"""Keys of specs and lines of C: each line finds the key that it comes from, templates included."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from modewright.api.traceability import KeyTraceReport, trace_keys
from modewright.cli.app import app
from modewright.cli.common.exit_codes import run_with_exit_code
from tests.language.spec_builders import ROOT


@pytest.fixture(scope="module")
def estimator() -> KeyTraceReport:
    return trace_keys(["estimator"], ROOT)


@pytest.mark.parametrize("name", ["supervisor", "contactor", "driveline", "ev_driveline"])
def test_c_cites_nothing_that_no_spec_has(name: str) -> None:
    traced = trace_keys([name], ROOT)
    assert traced.traces.unmatched_citations == ()
    assert len(traced.traces.keys) > len(traced.traces.uncited) > 0


def test_every_line_of_a_key_says_so(estimator: KeyTraceReport) -> None:
    for key in estimator.traces.keys:
        for file, number in key.code:
            line = estimator.code[file].splitlines()[number - 1]
            inner = key.path.split(".", 2)[-1] if key.path.startswith("templates.") else key.path
            assert re.search(rf"\b{re.escape(inner)}\b", line), (key.path, line)


def test_a_key_stands_where_it_is_said_to(estimator: KeyTraceReport) -> None:
    for key in estimator.traces.keys:
        line = estimator.specs[key.place.source.name].splitlines()[key.place.line - 1]
        assert key.path.rpartition(".")[2] in line


def test_a_mode_that_is_like_a_template_leads_to_the_template(estimator: KeyTraceReport) -> None:
    found = {f"{key.spec} {key.path}": key for key in estimator.traces.keys}
    shared = found["estimator templates.contact.equations.w_b"]
    assert len(shared.code) >= 2, "drive and coast"
    assert found["estimator modes.gap.transitions.drive"].code
    assert found["estimator parameters.sd_em"].code == ()


def test_the_command_writes_page_and_data(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(ROOT)

    def run(*arguments: str) -> int:
        return run_with_exit_code(lambda: app(list(arguments), standalone_mode=False))

    page, data = tmp_path / "keys.html", tmp_path / "keys.json"
    assert run("trace", "contactor", "--keys", "--out", str(page)) == 0
    assert run("trace", "contactor", "--keys", "--out", str(data)) == 0
    assert "8 keys, 5 of them in lines of C" in capsys.readouterr().out
    found = json.loads(data.read_text())
    of_line = {(c["file"], c["line"]) for key in found["keys"] for c in key["c"]}
    marked = set(re.findall(r'<div class="k"[^>]* data-n=(\d+)>', page.read_text()))
    assert {str(line) for file, line in of_line if file == "contactor.c"} <= marked
    assert run("trace", "contactor", "--keys", "--out", str(tmp_path / "keys.csv")) == 1
