"""What a user gets of a diagnosis: verdict, variant, report; of the rotor in spinning.py."""

from __future__ import annotations

import copy
import dataclasses
import html
import json
import re
import shlex
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest

import modewright as mw
from diagnosis.estimation.checkpoint import FitCache, hash_of
from diagnosis.report.variant_file import missing_effect_notes
from modewright.api.diagnosis import base_reference
from tests.diagnosis.rotor_project import (
    COMMAND,
    RIDER,
    SCHEMA,
    T_C,
    B,
    J,
    run_command,
    write_project,
)

RIG = """language: 1
system: rig
inputs: {T: {unit: N*m}}
instances: {plant: {of: spinner_diagnosed}, rider: {of: rider}}
connections: {plant.T: T, rider.T: T}
"""
RUN = """language: 1
scenario: run
of: rig
horizon: 2 s
inputs: {T: {start: 10 N*m, steps: {0.5 s: -4 N*m}}}
"""


@dataclass(frozen=True)
class Found:
    """What one run of the command left: its folder, exit code, and texts."""

    folder: Path
    code: int
    out: str
    error: str

    @property
    def verdict(self) -> dict[str, Any]:
        return dict(json.loads((self.folder / "found" / "verdict.json").read_text("utf-8")))


def _killed(folder: Path) -> None:
    """Kill a run when it has fitted the base: it leaves what it goes on from, no more."""
    words = [sys.executable, "-m", "modewright", *COMMAND, "--out", "found"]
    with subprocess.Popen(words, cwd=folder, stderr=subprocess.PIPE, text=True) as process:
        assert process.stderr
        next(line for line in process.stderr if line.startswith("base fitted"))
        process.send_signal(signal.SIGKILL)
    assert [file.name for file in (folder / "found").glob("*")] == ["stages"]
    assert list((folder / "found" / "stages").glob("*.npz"))


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> Found:
    folder = write_project(tmp_path_factory.mktemp("bench") / "project")
    _killed(folder)
    code = "import sys\n"
    code += "def hook(event, about):\n"
    code += "    if event == 'open' and str(about[0]).endswith('.csv'):\n"
    code += "        print('opened', about[0], file=sys.stderr, flush=True)\n"
    code += "sys.addaudithook(hook)\n"
    code += "from modewright.cli.app import main; main()"
    words = [*COMMAND, "--out", "found", "--fail-on", "effect"]
    told = subprocess.run(
        [sys.executable, "-c", code, *words],
        cwd=folder, capture_output=True, text=True, check=False, timeout=300,
    )  # fmt: skip
    return Found(folder, told.returncode, told.stdout, told.stderr)


def test_it_names_the_effect_with_its_value_and_tells_so_in_five_lines(found: Found) -> None:
    assert found.code == 1, found.error  # --fail-on effect
    assert found.verdict["verdict"] == "effect"
    (effect,) = found.verdict["effects"]
    assert (effect["id"], effect["place"]) == ("coulomb_friction", "flow.w")
    assert effect["parameters"]["T_c"]["value"] == pytest.approx(T_C, rel=0.02)
    assert effect["parameters"]["T_c"]["unit"] == "N*m"
    assert found.verdict["confirmed"] is True
    lines = found.out.splitlines()
    assert len(lines) <= 5
    assert lines[0].startswith("spinner lacks coulomb friction in the balance of w (T_c = ")


def test_what_is_held_out_is_opened_when_all_stages_are_told(found: Found) -> None:
    lines = found.error.splitlines()
    first = next(k for k, line in enumerate(lines) if "run_2.csv" in line)
    last = max(k for k, line in enumerate(lines) if "nats" in line)
    assert lines[first].startswith("opened ") and first > last
    assert any(line.startswith("opened ") and "run_0.csv" in line for line in lines[:last])


def test_a_real_verdict_has_the_form_that_the_schema_says(found: Found) -> None:
    jsonschema.Draft7Validator.check_schema(SCHEMA)
    jsonschema.validate(found.verdict, SCHEMA)
    shares = [one["probability"] for one in found.verdict["candidates"]]
    assert sum(shares) + found.verdict["other"] == pytest.approx(1.0)
    assert shares == sorted(shares, reverse=True)


def _with_place(verdict: dict[str, Any]) -> None:
    verdict["effects"][0]["place"] = "w"


def _without_effect(verdict: dict[str, Any]) -> None:
    verdict["effects"] = []


def _clean(verdict: dict[str, Any]) -> None:
    verdict["verdict"] = "nothing_missing"


def _with_more(verdict: dict[str, Any]) -> None:
    verdict["mood"] = "sure"


@pytest.mark.parametrize("change", [_with_place, _without_effect, _clean, _with_more])
def test_the_schema_refuses_what_is_no_verdict(
    found: Found, change: Callable[[dict[str, Any]], None]
) -> None:
    verdict = copy.deepcopy(found.verdict)
    change(verdict)
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(verdict, SCHEMA)


def test_the_variant_is_a_spec_like_any_other(found: Found, tmp_path: Path) -> None:
    (tmp_path / "spec").mkdir()
    shutil.copy(found.folder / "spec" / "spinner.yaml", tmp_path / "spec")
    shutil.copy(found.folder / "spec" / "bench_columns.yaml", tmp_path / "spec")
    shutil.copy(found.folder / "found" / "variant.yaml", tmp_path / "spec")
    for name, text in {"rider": RIDER, "rig": RIG, "run": RUN}.items():
        (tmp_path / "spec" / f"{name}.yaml").write_text(text, "utf-8")
    assert mw.check("spinner_diagnosed", root=tmp_path) == []
    assert "T_c_w" in mw.generate("spinner_diagnosed", root=tmp_path)["spinner_diagnosed.c"]
    trajectory, verdicts = mw.lockstep("rig", "run", root=tmp_path)
    assert all(verdict.is_equal and verdict.ticks > 1 for verdict in verdicts)
    slope = (10.0 - T_C) / J
    early = trajectory.signals["plant.w"][trajectory.times <= 0.1][-1]
    assert early == pytest.approx(0.1 * slope * (1 - 0.05 * B / J), rel=0.02)


def test_the_commands_of_the_report_do_what_it_says(
    found: Found, capsys: pytest.CaptureFixture[str]
) -> None:
    text = html.unescape((found.folder / "found" / "report.html").read_text("utf-8"))
    commands = re.findall(r"<dd><code>modewright ([^<]*)</code>", text)
    assert [command.split()[0] for command in commands] == [
        "check", "simulate", "generate", "lockstep", "explain",
    ]  # fmt: skip
    for command in [*commands, "check found/scenario.yaml"]:
        assert run_command(found.folder, *shlex.split(command)) == 0, command
    assert "equal, bit for bit" in capsys.readouterr().out
    assert (found.folder / "run.png").exists() and list((found.folder / "build").glob("*.c"))


def test_the_worst_window_is_a_table_for_other_tools(found: Found) -> None:
    table = np.genfromtxt(found.folder / "found" / "window.csv", delimiter=",", names=True)
    assert table.dtype.names == ("t_s", "T", "w", "w_without", "w_with")
    alone = table["t_s"] >= table["t_s"][0] + 1.0
    missed = [np.max(np.abs(table["w"] - table[name])[alone]) for name in ("w_without", "w_with")]
    text = (found.folder / "found" / "report.html").read_text("utf-8")
    told = re.search(r"misses w by up to (\S+) rad/s without, (\S+) rad/s with", text)
    assert told and [float(told[1]), float(told[2])] == pytest.approx(missed, rel=0.06)
    assert missed[1] < missed[0]


def test_a_spec_that_is_a_file_anywhere_is_extended_as_a_file(
    found: Found, dossier: mw.DiagnosisReport, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(found.folder)
    shutil.copy("spec/spinner.yaml", "other.yaml")
    elsewhere = dataclasses.replace(dossier.automaton, name="other")
    alone = dataclasses.replace(dossier, automaton=elsewhere)
    assert base_reference(alone, "other.yaml", Path("found")) == "../other.yaml"
    assert base_reference(dossier, "spec/spinner.yaml", Path("found")) == "spinner"


def test_an_effect_that_the_project_does_not_have_is_asked_for(dossier: mw.DiagnosisReport) -> None:
    assert missing_effect_notes(dossier) == []
    assert dossier.diagnosis
    (tried,) = dossier.diagnosis.selection.accepted
    effect = dataclasses.replace(tried.placed_effect.effect, name="house_friction")
    other = dataclasses.replace(
        tried, placed_effect=dataclasses.replace(tried.placed_effect, effect=effect)
    )
    selection = dataclasses.replace(dossier.diagnosis.selection, accepted=(other,))
    diagnosis = dataclasses.replace(dossier.diagnosis, selection=selection)
    (told,) = missing_effect_notes(dataclasses.replace(dossier, diagnosis=diagnosis))
    assert told.endswith(
        "library/coulomb_friction.yaml has to be below spec/: the variant finds this effect by name"
    )


class Page(HTMLParser):
    """The tags that are open, and what the page refers to."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.references: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag not in ("meta", "br", "link", "img"):
            self.open.append(tag)
        given = [v or "" for k, v in attrs if k in ("href", "src")]
        self.references += [value for value in given if not value.startswith("#")]

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


def test_the_report_is_one_page_that_needs_nothing_but_what_lies_beside_it(found: Found) -> None:
    text = (found.folder / "found" / "report.html").read_text("utf-8")
    page = Page()
    page.feed(text)
    assert page.open == []
    assert page.references
    assert [name for name in page.references if not (found.folder / "found" / name).exists()] == []
    assert text.count("<svg") == text.count('<svg role="img" aria-label="') == 5
    names = re.findall(r'\bid="([^"]+)"', text)
    assert len(names) == len(set(names))
    assert set(re.findall(r"url\(#([^)]+)\)", text)) <= set(names)
    assert not re.search(r"https?://(?!www\.w3\.org/)", text)
    assert len(text.encode()) < 1_000_000
    for digest in found.verdict["inputs"].values():
        assert digest in text
    told = re.sub(r"<[^>]+>", " ", text)
    for sentence in (
        "lacks coulomb friction in the balance of w",
        "confirmed on held-out recordings",
        "passage through zero speed",
        "coulomb_friction@w",
        "Where it improved and where not",
        "predictable from its past",
        "What it changes in the equations (1 line)",
        "Nothing odd was found",
    ):
        assert sentence in told, sentence


@pytest.fixture(scope="module")
def dossier(found: Found) -> mw.DiagnosisReport:
    """The same diagnosis in Python, with everything compiled."""
    train = [found.folder / f"run_{k}.csv" for k in (0, 1)]
    held_out = [found.folder / "run_2.csv"]
    library = found.folder / "library"
    return mw.diagnose("spinner", train, held_out, effects=library, root=found.folder)


def test_killed_and_run_again_it_says_the_same(found: Found, dossier: mw.DiagnosisReport) -> None:
    """The fixture's first run was killed."""
    again = dossier.verdict.to_json()
    assert {**again, "runtime_s": 0} == {**found.verdict, "runtime_s": 0}


@pytest.mark.parametrize("is_alone", [False, True])
def test_a_fit_that_was_kept_has_the_bits_of_the_one_that_was_made(
    is_alone: bool, dossier: mw.DiagnosisReport, tmp_path: Path
) -> None:
    assert dossier.diagnosis
    series, model = dossier.diagnosis.model_set.series, dossier.diagnosis.selection.model
    model = dataclasses.replace(
        model, noise_levels=dataclasses.replace(model.noise_levels, is_output_error=is_alone)
    )
    shelf = FitCache(tmp_path, "key")

    def kept(given: float, make: Callable[[], Any]) -> Any:
        return shelf.load_or_fit("fit", model.candidate, series, [given], make)

    def unwanted() -> None:
        raise AssertionError

    assert kept(1.0, lambda: model) is model
    again = kept(1.0, unwanted)
    assert again is not model
    assert hash_of(again) == hash_of(model)
    with pytest.raises(AssertionError):
        kept(1.5, unwanted)
    (file,) = tmp_path.glob("*")
    file.write_bytes(file.read_bytes()[:-100])
    assert kept(1.0, lambda: model) is model
