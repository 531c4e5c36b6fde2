"""Resolved pages fit the C: no stamp is stale, and every member of the page has its number."""

from __future__ import annotations

import json
import re
import subprocess
from pathlib import Path

import pytest

from codegen.emit.c_expression import format_literal
from codegen.emit.c_module import emit_c_files
from codegen.exchange.calibration.file_formats import read_page
from codegen.toolchain.compiler import compile_program, flags_at_level
from language.ir.number_type import round_to_type
from language.text.diagnostic import Problems
from modewright.api.calibrations import export_calibration, import_calibration, resolve_calibration
from modewright.api.simulation import program
from tests.codegen.exchange.calibration.tunable_project import (
    replace_line,
    run_command,
    write_project,
)

MAIN = """#include "{name}.h"

static {name}_Self self;
static {name}_Cal cal;

int main(void)
{{
    cal = {name}_default_cal;
{first}
    {name}_Init(&self, &cal);
    if (self.faults & {name}_FAULT_stale_calibration) {{
        return 1;
    }}
{second}
    {name}_Calibrate(&self, &cal);
    return self.faults & {name}_FAULT_stale_calibration ? 2 : 0;
}}
"""
TURNED = {"estimator": "0.0612", "estimator_float32": "0.0612"}


def stores(file: Path) -> str:
    """Return a page as C: every name of the file is a member of the page."""
    found = read_page(file, Problems()).characteristics
    name = found[0].name.text.partition(".")[0]
    number = program(name).number_type
    return "\n".join(
        f"    cal{one.name.text.removeprefix(name)} = "
        f"{format_literal(round_to_type(float(cell.text), number), number)};"
        for one in found
        for cell in one.values
    )


def ends(folder: Path, name: str, first: str, second: str) -> int:
    files = {
        **emit_c_files(program(name)),
        "main.c": MAIN.format(name=name, first=first, second=second),
    }
    for file, text in files.items():
        (folder / file).write_text(text)
    sources = [folder / file for file in files if file.endswith(".c")]
    compile_program(sources, folder / "run", flags_at_level("O0"))
    return subprocess.run([folder / "run"], timeout=60, check=False).returncode


@pytest.mark.parametrize("name", TURNED)
def test_a_resolved_page_raises_no_fault_and_a_turned_parameter_alone_does(
    name: str, tmp_path: Path
) -> None:
    first, turned, resolved = (tmp_path / f"{each}.dcm" for each in ("first", "turned", "resolved"))
    assert run_command("export", name, "--out", first) == 0
    text = replace_line(first.read_text(), f"{name}.J_em", "WERT 0.05", f"WERT {TURNED[name]}")
    turned.write_text(text)
    assert run_command("resolve", name, "--page", turned, "--out", resolved) == 0
    assert ends(tmp_path, name, stores(first), stores(resolved)) == 0
    assert ends(tmp_path, name, stores(first), stores(turned)) == 2
    assert ends(tmp_path, name, "", f"    cal.J_em = {TURNED[name]};") == 2


@pytest.mark.parametrize("name", ["estimator", "supervisor", "hko", "driveline", "heater"])
def test_the_page_has_the_members_of_the_c_and_no_others(name: str, tmp_path: Path) -> None:
    reference = "tests/codegen/emit/golden/heater.yaml" if name == "heater" else name
    page = export_calibration(reference)
    file = tmp_path / "page.csv"
    file.write_text(page.text("csv"))
    found = read_page(file, Problems()).characteristics
    header = emit_c_files(page.program)[f"{name}.h"]
    body = header.partition("The calibration page")[2].partition(f"}} {name}_Cal;")[0]
    inside = re.findall(r"^ {4}\w+ (\w+)[;\[]", body, re.MULTILINE)
    solved = re.findall(r"^ {8}\w+ (\w+);", body, re.MULTILINE)
    wanted = [f"{name}.{member}" for member in inside if member != "reserved"]
    wanted += [f"{name}.solved.{member}" for member in solved]
    assert [one.name.text for one in found] == wanted


def test_what_changed_is_told_with_the_largest_relative(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    page, resolved = tmp_path / "page.cdfx", tmp_path / "resolved.csv"
    assert run_command("export", "estimator_simple", "--out", page) == 0
    capsys.readouterr()
    text = page.read_text()
    head, mark, tail = text.partition("estimator_simple.J_em<")
    page.write_text(head + mark + tail.replace("<V>0.05<", "<V>0.1<", 1))
    words = ("resolve", "estimator_simple", "--page", page, "--out", resolved, "--json")
    assert run_command(*words) == 0
    told = json.loads(capsys.readouterr().out)
    stamp = {"name": "estimator_simple.solved.stamp_J_em", "before": 0.05, "after": 0.1}
    assert {**stamp, "relative": 0.5} in told["changed"]["numbers"]
    assert 0.5 <= told["changed"]["largest_relative"] <= 2
    assert told["changed"]["count"] == len(told["changed"]["numbers"]) > 10
    other = export_calibration("estimator_simple", {"J_em": "0.1 kg*m^2"})
    assert resolved.read_text() == other.text("csv")


def test_a_calibration_is_resolved_to_the_page_that_its_import_would_be(tmp_path: Path) -> None:
    root = write_project(tmp_path)
    (root / "spec" / "rig.yaml").write_text(
        "language: 1\ncalibration: rig\nof: solved_float32\n"
        "parameters: {J_em: 0.07 kg*m^2, sd_em: 5 rpm}\n"
    )
    found = resolve_calibration("solved_float32", root=root, calibrations=["rig"])
    names = {change.name for change in found.changes}
    assert {f"solved_float32.solved.stamp_{name}" for name in ("J_em", "sd_em")} <= names
    assert not found.added
    file = tmp_path / "page.dcm"
    file.write_text(found.page.text("dcm"))
    back = import_calibration(file, "solved_float32", root)
    assert dict(back.values)["sd_em"] == "5 rpm" and not back.stale
    again = resolve_calibration("solved_float32", file, root=root)
    assert not again.changes and again.page.text("dcm") == file.read_text()


def test_solved_numbers_that_a_page_lacks_are_added(tmp_path: Path) -> None:
    page = tmp_path / "page.csv"
    page.write_text("name,value\nestimator_simple.J_em,0.06\n")
    found = resolve_calibration("estimator_simple", page)
    assert len(found.added) == len(found.page.solved) and not found.changes
    assert [remark.kind for remark in found.remarks] == ["no unit"]


def test_resolve_asks_for_what(tmp_path: Path) -> None:
    assert run_command("resolve", "estimator_simple", "--out", tmp_path / "page.dcm") == 2
