"""A page that is exported, imported and exported again is the same file, byte for byte."""

from __future__ import annotations

import json
from fractions import Fraction
from pathlib import Path

import pytest
from hypothesis import given, settings, strategies as st

from codegen.exchange.calibration.file_formats import FORMATS
from language.ir.number_type import NumberType, round_to_type, shortest_decimal
from language.ir.program import unqualified_name
from modewright.api.calibrations import CalibrationPage, export_calibration, import_calibration
from tests.codegen.exchange.calibration.tunable_project import NUMBERS, constant_bits, write_project

FORMS = st.sampled_from(sorted(FORMATS))


@pytest.fixture(scope="module")
def root(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_project(tmp_path_factory.mktemp("project"))


def goes_round(root: Path, name: str, values: dict[str, str], form: str) -> None:
    comes_back(root, export_calibration(name, values, root), name, form)


def comes_back(root: Path, page: CalibrationPage, name: str, form: str) -> None:
    first = page.text(form)
    file = root / f"page.{form}"
    file.write_bytes(first.encode())
    found = import_calibration(file, name, root)
    assert not found.stale and not found.warnings and not found.remarks
    calibration = root / "spec" / "taken.yaml"
    calibration.write_text(found.calibration("taken"), "utf-8")
    again = export_calibration(name, root=root, calibrations=["taken"])
    assert again.text(form) == first
    assert constant_bits(again) == constant_bits(page)


def reals(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(low, high, allow_nan=False, allow_subnormal=False)


@settings(max_examples=24)
@given(
    number=st.sampled_from(NUMBERS),
    form=FORMS,
    gain=reals(0, 9),
    speed=reals(0, 12000),
    hot=reals(-40, 150),
    share=reals(-1e30, 1e30),
    whole=st.integers(-9, 900),
    flag=st.booleans(),
    hold=st.integers(0, 200),
    gear=st.sampled_from(["park", "drive", "back"]),
)
def test_a_value_of_each_kind_goes_round(
    root: Path,
    number: NumberType,
    form: str,
    gain: float,
    speed: float,
    hot: float,
    share: float,
    whole: int,
    flag: bool,
    hold: int,
    gear: str,
) -> None:
    values = {
        "gain": literal(gain, number),
        "speed": f"{literal(speed, number)} rpm",
        "hot": f"{literal(hot, number)} degC",
        "share": f"{literal(share, number)} percent",
        "whole": str(whole),
        "flag": str(flag).lower(),
        "hold": f"{10 * hold} ms",
        "gear": gear,
    }
    goes_round(root, f"kinds_{number}", values, form)


@settings(max_examples=10)
@given(
    number=st.sampled_from(NUMBERS),
    form=FORMS,
    inertia=reals(0.01, 0.2),
    stiffness=reals(4000, 6000),
    damping=reals(10, 20),
    noise=reals(0.5, 50),
)
def test_solved_numbers_go_round(
    root: Path,
    number: NumberType,
    form: str,
    inertia: float,
    stiffness: float,
    damping: float,
    noise: float,
) -> None:
    values = {
        "J_em": f"{literal(inertia, number)} kg*m^2",
        "k_hs": f"{literal(stiffness, number)} N*m/rad",
        "c_hs": f"{literal(damping, number)} N*m*s/rad",
        "sd_em": f"{literal(noise, number)} rpm",
    }
    goes_round(root, f"solved_{number}", values, form)


@settings(max_examples=10)
@given(number=st.sampled_from(NUMBERS), form=FORMS, data=st.data())
def test_the_values_of_tables_go_round(
    root: Path, number: NumberType, form: str, data: st.DataObject
) -> None:
    drawn = data.draw(st.lists(reals(-1e9, 1e9), min_size=9, max_size=9))
    line, area = [literal(v, number) for v in drawn[:3]], [literal(v, number) for v in drawn[3:]]
    rows = [dict(zip("012", area[k : k + 3], strict=True)) for k in (0, 3)]
    points = {"363.15 K": rows[1], "0 degC": rows[0]}
    text = f"language: 1\ncalibration: given\nof: kinds_{number}\nparameters:\n"
    text += f"  line: {{points: {{0 degC: {line[0]}, 40 degC: {line[1]}, 90 degC: {line[2]}}}}}\n"
    text += f"  area: {json.dumps({'points': points})}\n".replace('"', "")
    (root / "spec" / "given.yaml").write_text(text, "utf-8")
    page = export_calibration(f"kinds_{number}", root=root, calibrations=["given"])
    tables = {unqualified_name(c.name): c.items for c in page.tunable if c.items}
    assert tables["line"] == tuple(round_to_type(Fraction(value), number) for value in line)
    assert tables["area"] == tuple(round_to_type(Fraction(value), number) for value in area)
    comes_back(root, page, f"kinds_{number}", form)


def test_a_value_finer_than_its_type_is_solved_for_as_the_page_holds_it(root: Path) -> None:
    """A tool reads 0.06: what was solved for 0.060000000123 would never fit it."""
    fine = {"J_em": "0.060000000123 kg*m^2", "sd_em": "3.3333333333333333 rpm"}
    goes_round(root, "solved_float32", fine, "dcm")


def literal(value: float, number: NumberType) -> str:
    """Return a value of a type as the language writes it."""
    text = shortest_decimal(round_to_type(value, number), number)
    mantissa, exponent, power = text.partition("e")
    return f"{mantissa}.0{exponent}{power}" if exponent and "." not in mantissa else text
