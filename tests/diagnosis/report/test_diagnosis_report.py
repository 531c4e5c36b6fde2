"""What is told of a diagnosis: rivals, oscillations, recordings that are left out."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path

import jsonschema
import pytest

import modewright as mw
from diagnosis.data_quality.finding import Finding
from diagnosis.pipeline.usable_recordings import usable_recordings
from diagnosis.report import report_text as wording
from diagnosis.report.report_files import report_files
from diagnosis.report.report_text import format_headline, format_separation
from modewright.api.recordings import held_out_findings
from tests.diagnosis.rotor_project import SCHEMA, write_project


@pytest.fixture(scope="module")
def dossier(tmp_path_factory: pytest.TempPathFactory) -> mw.DiagnosisReport:
    folder = write_project(tmp_path_factory.mktemp("bench") / "project")
    train = [folder / f"run_{k}.csv" for k in (0, 1)]
    held_out = [folder / "run_2.csv"]
    return mw.diagnose("spinner", train, held_out, effects=folder / "library", root=folder)


def test_what_cannot_be_told_apart_is_told_with_what_would_separate_it(
    dossier: mw.DiagnosisReport,
) -> None:
    assert dossier.diagnosis
    effects = dossier.verdict.effects
    rival = dataclasses.replace(effects[0], id="road_grade")
    doubt = dataclasses.replace(
        dossier.verdict, verdict="ambiguous", effects=(), ambiguous_with=(*effects, rival)
    )
    jsonschema.validate(doubt.to_json(), SCHEMA)
    doubtful = dataclasses.replace(dossier, verdict=doubt)
    told = format_headline(doubtful)
    assert "cannot tell which" in told
    assert re.search(r"coulomb friction in the balance of w \(.* %\); road grade in the", told)
    named = "coulomb_friction from road_grade, torque_offset, viscous_friction"
    assert format_separation(doubtful) == [f"{named}: passage through zero speed"]
    page = re.sub(r"<[^>]+>", " ", report_files(doubtful, "")["report.html"].decode())
    assert "These recordings cannot tell apart: coulomb friction" in page
    assert "best, but not separated from others" in page
    assert "confirmed on" not in page and "better on held-out recordings" in page


def test_however_much_is_to_be_told_it_is_four_lines(
    dossier: mw.DiagnosisReport, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(wording, "format_oscillation", lambda dossier: "w fits until t = 0.3 s")
    lines = wording.summary_lines(dossier)
    assert len(lines) == 4 and lines[2] == "w fits until t = 0.3 s"
    odd = dataclasses.replace(
        dossier.check, findings=(Finding("gap", "a", "w", "has gaps", "warning"),)
    )
    told = wording.summary_lines(dataclasses.replace(dossier, check=odd))
    assert len(told) == 4 and told[1].endswith("; w fits until t = 0.3 s")
    assert "has gaps" in told[3]


@pytest.mark.parametrize(
    ("bad", "kept"),
    [((), "abc"), (("b",), "ac"), (("b", "c"), ""), (("",), "")],
    ids=["none", "a few", "most", "all"],
)
def test_recordings_with_errors_are_left_out_unless_they_are_most(
    bad: tuple[str, ...], kept: str, dossier: mw.DiagnosisReport
) -> None:
    errors = tuple(Finding("sign", name, "w", "is upside down", "error") for name in bad)
    noted = Finding("jitter", "a", "w", "wobbles", "warning")
    check = dataclasses.replace(dossier.check, findings=(*errors, noted))
    case = dataclasses.replace(dossier.case, train=(Path("a"), Path("b"), Path("c")))
    assert usable_recordings(check, case) == tuple(Path(name) for name in kept)


def test_what_is_odd_in_a_held_out_recording_is_told(
    dossier: mw.DiagnosisReport, tmp_path: Path
) -> None:
    assert not any(text.startswith("held out, ") for text in dossier.verdict.messages)
    lines = dossier.case.held_out[0].read_text("utf-8").splitlines()
    lines[len(lines) // 2] = lines[len(lines) // 2].rpartition(",")[0] + ",1e300"
    spoiled = tmp_path / "spoiled.csv"
    spoiled.write_text("\n".join(lines), "utf-8")
    names = {**dossier.case.names, spoiled: "spoiled.csv"}
    case = dataclasses.replace(dossier.case, held_out=(spoiled,), names=names)
    (told,) = held_out_findings(case, dossier.automaton)
    assert told.startswith("held out, error: `speed` (spoiled.csv): is 1e+300 rad/s at ")
