"""What an import tells: rounded, converted, missing and stale numbers, and what it refuses."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import modewright as mw
from modewright.api.calibrations import import_calibration
from tests.codegen.exchange.calibration.tunable_project import (
    replace_line,
    run_command,
    write_project,
)


@pytest.fixture(scope="module")
def root(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_project(tmp_path_factory.mktemp("project"))


@pytest.fixture(autouse=True)
def _inside(root: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(root)


def page(*rows: str) -> Path:
    """Write a page in CSV."""
    file = Path("page.csv")
    file.write_text("\n".join(("name,value,unit", *rows, "")), "utf-8")
    return file


def remarks(*rows: str, of: str) -> list[tuple[str, str, str]]:
    found = import_calibration(page(*rows), of)
    told = [remark for remark in found.remarks if remark.kind != "missing"]
    return [(remark.kind, remark.name, remark.text) for remark in told]


def test_a_decimal_that_is_no_value_of_the_type_is_told_as_rounded() -> None:
    name = "kinds_float32.gain"
    text = "`0.7000000001` is rounded to 0.7, its float32"
    assert remarks(f"{name},0.7000000001,1", of="kinds_float32") == [("rounded", name, text)]
    assert remarks(f"{name},0.7,1", of="kinds_float32") == []
    assert remarks(f"{name},0.699999988079071044921875,1", of="kinds_float32") == []
    assert remarks("kinds_float64.gain,0.7000000001,1", of="kinds_float64") == []


def test_a_unit_is_converted_where_its_dimension_fits() -> None:
    found = import_calibration(page("kinds_float64.speed,1500,rpm"), "kinds_float64")
    assert found.values == {"speed": "1500 rpm"}
    text = "`1500 rpm` is 157.07963267948966 rad/s"
    told = [(r.kind, r.text) for r in found.remarks if r.kind != "missing"]
    assert told == [("converted", text)]


def test_an_angle_counts_in_a_unit() -> None:
    with pytest.raises(mw.SpecError) as refused:
        import_calibration(page("kinds_float64.speed,25,1/s"), "kinds_float64")
    (problem,) = refused.value.problems
    assert problem.label == "`1/s` does not fit the unit `rpm`"


def test_a_value_without_a_unit_is_in_si_and_that_is_told() -> None:
    text = "has no unit beside it: taken in rad/s"
    told = remarks("kinds_float64.speed,100,", of="kinds_float64")
    assert told == [("no unit", "kinds_float64.speed", text)]
    assert remarks("kinds_float64.gain,1,", of="kinds_float64") == []


def test_the_end_of_a_range_is_inside_in_either_type() -> None:
    for number in ("float64", "float32"):
        name = f"kinds_{number}"
        rows = (f"{name}.speed,12000,rpm", f"{name}.hot,150,degC", f"{name}.gain,9,")
        found = import_calibration(page(*rows), name)
        assert found.values == {"gain": "9", "speed": "12000 rpm", "hot": "150 degC"}
        shown = "1256.6371" if number == "float32" else "1256.6370614359173"
        found = import_calibration(page(f"{name}.speed,{shown},rad/s"), name)
        assert found.values == {"speed": "12000 rpm"}
        with pytest.raises(mw.SpecError, match="is outside its range"):
            import_calibration(page(f"{name}.speed,1256.638,rad/s"), name)


def test_all_mistakes_of_a_page_are_told_at_once_and_nothing_is_written(
    capsys: pytest.CaptureFixture[str],
) -> None:
    name = "kinds_float64"
    file = page(f"{name}.gian,1,1", f"{name}.gain,10,1", f"{name}.whole,901,1", f"{name}.hot,1,kg")
    words = ("import", file, "--of", name, "--out", "taken.yaml")
    assert run_command(*words) == 1
    told = capsys.readouterr().err
    assert [line for line in told.splitlines() if ": error: " in line] == [
        "page.csv:2:1: error: `kinds_float64` has no tunable parameter or solved number "
        "`kinds_float64.gian` [MW115]",
        "page.csv:3:20: error: `kinds_float64.gain` = 10.0 is outside its range, 0.0 to 9.0 in SI "
        "[MW310]",
        "page.csv:4:21: error: `whole` = 901 is outside its range, -9 to 900 [MW310]",
        "page.csv:5:21: error: `kg` does not fit the unit `degC` [MW305]",
    ]
    assert "help: did you mean `kinds_float64.gain`?" in told
    assert not Path("taken.yaml").exists()
    assert run_command(*words, "--json") == 1
    problems = json.loads(capsys.readouterr().out)["problems"]
    told_of = [(each["line"], each["code"]) for each in problems]
    assert told_of == [(2, "MW115"), (3, "MW310"), (4, "MW310"), (5, "MW305")]


def test_stale_solved_numbers_are_told_and_never_taken(capsys: pytest.CaptureFixture[str]) -> None:
    assert run_command("export", "estimator_simple", "--out", "old.dcm") == 0
    name = "estimator_simple.J_em"
    text = replace_line(Path("old.dcm").read_text(), name, "WERT 0.05", "WERT 0.06")
    Path("old.dcm").write_text(text)
    capsys.readouterr()
    words = ("import", "old.dcm", "--of", "estimator_simple", "--out", "rig_7.yaml")
    assert run_command(*words, "--date", "2026-11-21") == 0
    told = capsys.readouterr().out
    assert "J_em = 0.06 kg*m^2" in told and "stale: " in told
    assert "of 57 solved numbers of the file were solved for other values" in told
    assert Path("rig_7.yaml").read_text() == (
        'language: 1\ncalibration: rig_7\nof: estimator_simple\nfrom: "old.dcm"\n'
        "date: 2026-11-21\nparameters:\n  J_em: 0.06 kg*m^2\n"
    )
    assert run_command(*words, "--json") == 0
    found = json.loads(capsys.readouterr().out)
    assert found["values"] == {"J_em": "0.06 kg*m^2"} and found["problems"] == []
    stamp = {"name": "estimator_simple.solved.stamp_J_em", "before": 0.05, "after": 0.06}
    assert stamp.items() <= found["stale"]["numbers"][-1].items()
    assert mw.check("rig_7.yaml") == []


def test_what_a_page_lacks_is_told_and_stays_as_in_the_spec() -> None:
    found = import_calibration(page("kinds_float64.gain,1,1"), "kinds_float64")
    missing = [remark.name for remark in found.remarks if remark.kind == "missing"]
    names = ("speed", "hot", "share", "whole", "flag", "hold", "gear", "line", "area")
    assert missing == [f"kinds_float64.{name}" for name in names]
    assert found.calibration("taken").splitlines()[-2:] == ["parameters:", "  gain: 1"]


def test_names_of_other_functions_are_passed_over_if_that_is_wanted() -> None:
    file = page("kinds_float64.gain,1,1", "boost.gain,3,1", "kinds_float64_2.gain,4,1")
    found = import_calibration(file, "kinds_float64", own_only=True)
    passed = [remark.name for remark in found.remarks if remark.kind == "passed over"]
    assert found.values == {"gain": "1"}
    assert passed == ["boost.gain", "kinds_float64_2.gain"]
    with pytest.raises(mw.SpecError, match="no name of this file begins with `kinds_float32"):
        import_calibration(file, "kinds_float32", own_only=True)
    wrong = page("kinds_float64.gian,1,1", "boost.gain,3,1")
    with pytest.raises(mw.SpecError, match="no tunable parameter or solved number"):
        import_calibration(wrong, "kinds_float64", own_only=True)


DCM = """KONSERVIERUNG_FORMAT 2.0
FUNKTIONEN
  FKT boost "" ""
END
FESTWERT boost.gain 7
  WERT 1 2
  TEXT "never closed
END
FESTWERT boost.gain
  WERT 4
KENNLINIE boost.line 3
  ST/X 1 2
  WERT 1
FESTWERT kinds_float64.gain
  WERT 1
END
"""
CSV = """name,value,unit
boost.gain,1,1,1,1
boost.gain,1,1
kinds_float64.gain,1,1
boost.gain,2,1
"""
CDFX = """<MSRSW>
<SW-INSTANCE><SHORT-NAME>boost.gain</SHORT-NAME><CATEGORY>VALUE</CATEGORY></SW-INSTANCE>
<SW-INSTANCE><SHORT-NAME>kinds_float64.gain</SHORT-NAME><CATEGORY>VALUE</CATEGORY><SW-VALUE-CONT>
<SW-VALUES-PHYS><V>1</V></SW-VALUES-PHYS></SW-VALUE-CONT></SW-INSTANCE>
</MSRSW>
"""


@pytest.mark.parametrize(("form", "text"), [("dcm", DCM), ("csv", CSV), ("cdfx", CDFX)])
def test_what_is_malformed_of_other_functions_does_not_matter(form: str, text: str) -> None:
    """Blocks with too many values, a quote or no END, names twice, an instance without a value."""
    Path(f"ecu.{form}").write_text(text)
    found = import_calibration(Path(f"ecu.{form}"), "kinds_float64", own_only=True)
    assert found.values == {"gain": "1"}
    passed = [remark.name for remark in found.remarks if remark.kind == "passed over"]
    assert passed == ["boost.gain", *(["boost.line"] if form == "dcm" else [])]
    with pytest.raises(mw.SpecError):
        import_calibration(Path(f"ecu.{form}"), "kinds_float64")


@pytest.mark.parametrize(
    ("text", "unit", "taken", "told"),
    [
        ("0.05", "s", "50 ms", []),
        ("20.000000000000004", "ms", "20 ms", []),  # a tool has multiplied doubles
        ("1.7000000476837158", "s", "1700 ms", []),  # the nearest float32
        ("0.0421", "s", "50 ms", ["`0.0421` is rounded up to 0.05 s, 5 ticks"]),
    ],
)
def test_a_tunable_wait_is_a_time_of_whole_ticks(
    text: str, unit: str, taken: str, told: list[str]
) -> None:
    found = import_calibration(page(f"kinds_float64.hold,{text},{unit}"), "kinds_float64")
    assert found.values == {"hold": taken}
    assert [remark.text for remark in found.remarks if remark.kind == "rounded"] == told


def test_a_negative_wait_is_refused() -> None:
    with pytest.raises(mw.SpecError, match="is outside its range, 0 to 2 s"):
        import_calibration(page("kinds_float64.hold,-0.001,s"), "kinds_float64")


def test_a_wait_declared_in_minutes_keeps_its_ticks() -> None:
    text = Path("spec/kinds_float64.yaml").read_text("utf-8")
    Path("spec/slow.yaml").write_text(
        text.replace("kinds_float64", "slow").replace(
            "30 ms, tunable: true, range: [0, 2000]", "1 min, tunable: true, range: [0, 5]"
        ),
        "utf-8",
    )
    found = import_calibration(page("slow.hold,0.07,s"), "slow")
    assert found.values == {"hold": "0.07 s"}
    assert import_calibration(page("slow.hold,120,s"), "slow").values == {"hold": "2 min"}


def test_a_table_in_two_units_is_refused() -> None:
    rows = ("kinds_float64.line,1,N*m,273.15,K", "kinds_float64.line,2,kN*m,313.15,K")
    Path("two.csv").write_text("name,value,unit,x,x_unit\n" + "\n".join(rows) + "\n", "utf-8")
    with pytest.raises(mw.SpecError, match="as on the first line of this table"):
        import_calibration(Path("two.csv"), "kinds_float64")


def test_a_tunable_wait_out_of_its_range_is_refused() -> None:
    with pytest.raises(mw.SpecError, match="is outside its range, 0 to 2 s"):
        import_calibration(page("kinds_float64.hold,2.001,s"), "kinds_float64")


def test_an_empty_table_of_values_is_still_a_calibration() -> None:
    found = import_calibration(page(), "kinds_float64")
    text = found.calibration("nothing")
    Path("nothing.yaml").write_text(text)
    assert text.endswith("parameters: {}\n") and mw.check("nothing.yaml") == []


def test_unknown_words_of_a_dcm_file_are_warnings(capsys: pytest.CaptureFixture[str]) -> None:
    Path("odd.dcm").write_text(
        "KONSERVIERUNG_FORMAT 2.0\nFESTWERT kinds_float64.gain\n  FARBE rot\n  WERT 1\nEND\n"
    )
    assert run_command("import", "odd.dcm", "--of", "kinds_float64", "--out", "odd.yaml") == 0
    told = capsys.readouterr().out
    assert "odd.dcm:3:3: warning: `FARBE` is not known in `FESTWERT`: it is passed over" in told


def test_the_public_api_has_pages() -> None:
    exported = mw.export_calibration("kinds_float32", {"gain": "2"})
    file = Path("api.cdfx")
    file.write_text(exported.text("cdfx"), "utf-8")
    assert mw.import_calibration(file, "kinds_float32").values["gain"] == "2"
    assert mw.resolve_calibration("kinds_float32", file).page.text("cdfx") == file.read_text(
        "utf-8"
    )


def test_the_json_of_an_export_has_values_in_si(capsys: pytest.CaptureFixture[str]) -> None:
    assert run_command("export", "kinds_float64", "--out", "page.cdfx", "--json") == 0
    told = json.loads(capsys.readouterr().out)["tunable"]
    assert told["kinds_float64.hot"] == {"value": 363.15, "unit": "K"}
    assert told["kinds_float64.gear"]["value"] == "drive"
    assert told["kinds_float64.area"]["value"] == [1.0, 2.0, 3.0, 4.0, 8.0, 0.1]
