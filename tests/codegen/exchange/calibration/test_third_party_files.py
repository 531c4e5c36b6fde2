"""Files in the manner of other tools, written by hand: odd spacing, words, units, encodings."""

from __future__ import annotations

from pathlib import Path

import pytest

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
