"""Check: what it loads, and what it says to machines."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from language.text.diagnostic import Problem, Source, Span
from modewright.api.spec_check import check
from modewright.cli.app import app
from modewright.cli.common.exit_codes import run_with_exit_code
from modewright.render.github_annotations import annotation_lines
from modewright.render.sarif import to_sarif

ROOT = Path(__file__).parents[3]
SPOILED = """language: 1
automaton: slide
states:
  x: {initial: 0 m, unit: q}
flow:
  x: der(x) = w
outputs: [x]
"""
HEAVY = ("numpy", "scipy", "matplotlib", "jinja2", "filterpy", "z3")


def test_check_loads_neither_numerics_nor_generator() -> None:
    code = "import sys; sys.argv = ['modewright', 'check', 'tip_out', '--json']\n"
    code += (
        "from modewright.cli.app import main\ntry: main()\nexcept SystemExit as e: code = e.code\n"
    )
    code += f"print([name for name in {HEAVY} if name in sys.modules], code)"
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True
    )
    assert done.stdout.splitlines()[-1] == "[] 0", done.stdout


def test_a_problem_has_every_key_in_json(tmp_path: Path) -> None:
    path = tmp_path / "twice.yaml"
    path.write_text("language: 1\nautomaton: twice\nautomaton: twice\n")
    done = subprocess.run(
        [sys.executable, "-m", "modewright", "check", str(path), "--json"],
        capture_output=True,
        text=True,
    )
    assert done.returncode == 1
    (problem,) = json.loads(done.stdout)["problems"]
    assert problem == {
        "severity": "error",
        "code": "MW109",
        "kind": "duplicate",
        "file": str(path),
        "line": 3,
        "column": 1,
        "message": "`automaton` is given twice",
        "help": f"it is given first at {path}:2:1",
    }


@pytest.fixture
def spoiled(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A spec with two mistakes and a warning, in a project of its own."""
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "spec" / "slide.yaml"
    path.parent.mkdir()
    path.write_text(SPOILED)
    return path


def test_sarif_and_annotations_have_each_problem_with_its_code_and_place(spoiled: Path) -> None:
    command = ["check", "--all", "--github", "--sarif", "found.sarif"]
    done = subprocess.run(
        [sys.executable, "-m", "modewright", *command], capture_output=True, text=True
    )
    assert done.returncode == 1
    wrote, first, second, *_, last = done.stdout.splitlines()
    assert wrote == "wrote found.sarif"
    place = "file=spec/slide.yaml,line=4,col=27,endColumn=28,title=MW304"
    assert first.startswith(f"::error {place}::`q` is not a unit")
    assert second.startswith("::error file=spec/slide.yaml,line=6,col=")
    assert last == "1 spec checked, 2 problems"
    (run,) = json.loads(Path("found.sarif").read_text("utf-8"))["runs"]
    rules = [rule["id"] for rule in run["tool"]["driver"]["rules"]]
    assert rules == sorted(set(rules))
    assert [result["ruleId"] for result in run["results"]] == ["MW304", "MW115"]
    assert all(rules[result["ruleIndex"]] == result["ruleId"] for result in run["results"])
    where = run["results"][0]["locations"][0]["physicalLocation"]
    assert where["artifactLocation"]["uri"] == "spec/slide.yaml"
    assert where["region"] == {"startLine": 4, "startColumn": 27, "endColumn": 28}


def test_an_annotation_has_no_sign_that_would_end_it() -> None:
    span = Span(Source("a:b,c.yaml"), 1, 1)
    (line,) = annotation_lines([Problem("yaml", span, "100 %\nno: more", "ever")]).splitlines()
    assert line.startswith("::error file=a%3Ab%2Cc.yaml,line=1,")
    assert line.endswith("::100 %25%0Ano: more%0Ahelp: ever")


def test_sarif_of_a_fine_spec_has_no_results() -> None:
    assert to_sarif([])["runs"][0]["results"] == []


HEADS = {
    "system": "inputs: {}",
    "scenario": "of: estimator",
    "map": "time: t",
    "variant": "extends: tip_out",
    "calibration": "of: estimator",
    "study": "about: sweep",
    "test": "of: estimator",
}


@pytest.mark.parametrize("kind", HEADS)
@pytest.mark.parametrize("name", ["../../evil", "''", "/tmp/evil", "a b", "1st", "a" * 64, "off"])
def test_the_name_of_a_document_is_checked(kind: str, name: str, tmp_path: Path) -> None:
    path = tmp_path / "document.yaml"
    path.write_text(f"language: 1\n{kind}: {name}\n{HEADS[kind]}\n")
    found = [p for p in check(str(path)) if p.kind == "name" and p.code == "MW115"]
    assert [p.span.line for p in found] == [2]


@pytest.mark.parametrize("name", ["class", "a" * 63])
def test_a_name_that_is_in_no_c_may_be_a_word_of_c(name: str, tmp_path: Path) -> None:
    path = tmp_path / "document.yaml"
    path.write_text(f"language: 1\ncalibration: {name}\nof: estimator\nparameters: {{}}\n")
    assert check(str(path)) == []


@pytest.mark.parametrize("target", ["secret.yaml", "secrets"])
def test_a_link_to_a_file_outside_of_the_project_is_not_read(
    target: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "secrets").mkdir()
    for secret in (tmp_path / "secret.yaml", tmp_path / "secrets" / "secret.yaml"):
        secret.write_text("root:x:0:0: {password\n")
    spec = tmp_path / "project" / "spec"
    spec.mkdir(parents=True)
    (spec / target).symlink_to(tmp_path / target)
    (spec / "own.yaml").write_text("language: 1\ncalibration: own\nof: estimator\nparameters: {}\n")
    (spec / "link.yaml").symlink_to(spec / "own.yaml")
    monkeypatch.chdir(tmp_path / "project")
    path = "spec/secret.yaml" if target == "secret.yaml" else "spec/secrets/secret.yaml"
    assert [(p.code, str(p.span)) for p in check(path)] == [("MW116", f"{path}:1:1")]
    assert check("spec/link.yaml") == []
    for command in (["check", path], ["format", "--check", path]):
        assert run_with_exit_code(lambda: app(command, standalone_mode=False)) == 1  # noqa: B023
        assert "password" not in capsys.readouterr().err
    monkeypatch.setenv("MODEWRIGHT_ALLOW_OUTSIDE", "1")
    assert [p.code for p in check(path)] == ["MW106"]
