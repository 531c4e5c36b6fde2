"""Files in the manner of other tools, written by hand: odd spacing, words, units, encodings."""

from __future__ import annotations

from pathlib import Path

import pytest

from codegen.exchange.calibration.cell_parser import parse_unit_cell
from codegen.exchange.calibration.characteristic import Cell
from language.expressions.unit_symbols import SYMBOLS
from language.expressions.units import parse_unit
from language.text.diagnostic import Problems, Source, Span, SpecError
from modewright.api.calibrations import ImportedPage, import_calibration
from tests.codegen.exchange.calibration.tunable_project import write_project

TOOLS = Path(__file__).parent / "tools"
TABLES = {
    "line": "{points: {0 degC: 10 N*m, 40 degC: 12.5 N*m, 90 degC: 1 N*m}}",
    "area": "{points: {0 degC: {0: 1, 1: 2, 2: 3}, 90 degC: {0: 4, 1: 8, 2: 0.1}}}",
}
"""As they are in the files of all tools."""


@pytest.fixture(scope="module")
def root(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_project(tmp_path_factory.mktemp("project"))


def told(found: ImportedPage, kind: str) -> dict[str, str]:
    short = len("kinds_float64.")
    return {r.name[short:]: r.text for r in found.remarks if r.kind == kind}


def test_a_dcm_file_with_german_comments_and_units_of_its_own(root: Path) -> None:
    found = import_calibration(TOOLS / "inca.dcm", "kinds_float64", root)
    assert found.values == {
        "gain": "1.25",
        "speed": "1500 rpm",
        "hot": "85.5 degC",
        "share": "12.5 percent",
        "whole": "7",
        "flag": "false",
        "hold": "120 ms",
        "gear": "back",
        **TABLES,
    }
    assert told(found, "converted") == {
        "speed": "`1500.0000000000 rpm` is 157.07963267948966 rad/s",
        "hot": "`85.5 °C` is 358.65 K",
        "share": "`12.5 %` is 0.125",
        "hold": "`120.0000000000 ms` is 0.12 s",
    }
    assert not found.warnings and not told(found, "missing")


def test_a_dcm_file_with_blocks_of_values_and_places_for_words(root: Path) -> None:
    found = import_calibration(TOOLS / "canape.dcm", "kinds_float64", root)
    assert found.values == {"gain": "0.5", "flag": "true", "gear": "park", **TABLES}
    assert set(told(found, "missing")) == {"speed", "hot", "share", "whole", "hold"}
    assert told(found, "no unit") == {"line": "has no unit beside it: taken in N*m"}


def test_a_cdfx_file_with_a_document_type_and_shared_axes(root: Path) -> None:
    found = import_calibration(TOOLS / "inca.cdfx", "kinds_float64", root)
    rest = {"gain": "1.25", "hot": "85.5 degC", "flag": "false", "gear": "back"}
    assert found.values == {**rest, **TABLES}
    assert set(told(found, "missing")) == {"speed", "share", "whole", "hold"}


def test_a_csv_file_of_a_spreadsheet(root: Path) -> None:
    found = import_calibration(TOOLS / "excel.csv", "kinds_float64", root)
    assert found.values == {"gain": "1.25", "speed": "1500 rpm", "flag": "false", **TABLES}


HEAD = "KONSERVIERUNG_FORMAT 2.0\n"


def scalar(name: str, unit: str, *lines: str) -> str:
    rows = (f"FESTWERT kinds_float64.{name}", f'  EINHEIT_W "{unit}"', *lines, "END", "")
    return "\n".join(rows)


def imported(root: Path, *blocks: str) -> ImportedPage:
    (root / "made.dcm").write_text(HEAD + "".join(blocks), "utf-8")
    return import_calibration(root / "made.dcm", "kinds_float64", root)


def test_a_value_with_an_unknown_unit_is_skipped_and_the_others_are_taken(root: Path) -> None:
    found = imported(
        root, scalar("hot", "degR", "WERT 600"), scalar("speed", "rad/s", "WERT 3"), LINE
    )
    assert found.values == {"speed": "28.64788975654116 rpm"}
    skipped = [(r.name, str(r.span), r.text) for r in found.remarks if r.kind == "skipped"]
    assert [name for name, _, _ in skipped] == ["kinds_float64.hot", "kinds_float64.line"]
    assert skipped[0][1].endswith("made.dcm:3:13")
    assert skipped[0][2].startswith("is not taken: `degR` is not a unit")
    assert "degX" in skipped[1][2]


LINE = """\
KENNLINIE kinds_float64.line 3
  EINHEIT_X "degX"
  EINHEIT_W "Nm"
  ST/X 0 40 90
  WERT 10 12.5 1
END
"""


@pytest.mark.parametrize("word", ["unitless", "Dimensionless", "-", "[-]", "none", ""])
def test_no_unit_has_many_words(root: Path, word: str) -> None:
    found = imported(root, scalar("share", word, "WERT 0.25"), scalar("speed", word, "WERT 2"))
    assert found.values == {"share": "25 percent", "speed": "19.09859317102744 rpm"}
    assert told(found, "no unit") == {"speed": "has no unit beside it: taken in rad/s"}


def test_a_comment_behind_a_value_is_no_value(root: Path) -> None:
    found = imported(root, scalar("share", "1", "  WERT 0.25  * for the rig", "  FUNKTION a * b"))
    assert found.values == {"share": "25 percent"}
    assert ["comment" in warning.label for warning in found.warnings] == [True]


def test_a_truth_value_may_have_capital_letters(root: Path) -> None:
    assert imported(root, scalar("flag", "", 'TEXT "FALSE"')).values == {"flag": "false"}
    assert imported(root, scalar("flag", "", 'TEXT "True"')).values == {"flag": "true"}


def test_the_first_other_point_of_a_table_is_named(root: Path) -> None:
    with pytest.raises(SpecError) as caught:
        imported(root, LINE.replace("degX", ""))
    (problem,) = caught.value.problems
    assert "its point 0 K, read in SI without a unit, is 273.15 K in the spec" in problem.help
    with pytest.raises(SpecError) as caught:
        imported(root, LINE.replace("degX", "degC").replace("40", "39.99"))
    (problem,) = caught.value.problems
    assert "its point 39.99 degC is 313.15 K in the spec" in problem.help


@pytest.mark.parametrize(
    ("text", "unit"),
    [
        ("Nms/rad", "N*m*s/rad"),
        ("Nm/(rad/s)", "N*m/rad*s"),
        ("1/Nm", "1/N/m"),
        ("W/(m*K)", "W/m/K"),
        ("m/s2", "m/s^2"),
        ("m/s\N{SUPERSCRIPT TWO}", "m/s^2"),
        ("kg m2", "kg*m^2"),
        ("N.m", "N*m"),
        ("%/s", "percent/s"),
        ("\N{DEGREE SIGN}/s", "deg/s"),
        ("\N{DEGREE SIGN}C/s", "degC/s"),
        ("kmh", "km/h"),
        ("RPM", "rpm"),
    ],
)
def test_units_of_tools_are_those_of_the_language(text: str, unit: str) -> None:
    known = parse_unit(unit)
    found = parse_unit_cell(Cell(text, Span(Source("page"), 1, 1)), known, Problems())
    assert found is not None
    assert (found.factor, found.offset, found.dimension) == (
        known.factor,
        known.offset,
        known.dimension,
    )


@pytest.mark.parametrize("symbol", sorted(SYMBOLS))
def test_a_unit_of_the_language_stays_as_it_is(symbol: str) -> None:
    for text in (symbol, f"1/{symbol}", f"N*m/{symbol}", f"{symbol}^2"):
        unit = parse_unit(text)
        cell = Cell(text, Span(Source("page"), 1, 1))
        assert parse_unit_cell(cell, unit, Problems()) == unit
