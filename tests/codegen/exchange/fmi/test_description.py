"""The description of an FMU: FMPy finds no problem in it, and it says what the spec says."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Callable
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from fmpy import read_model_description
from fmpy.validation import validate_fmu
from lark import Lark

from codegen.exchange.fmi.archive import build_fmu
from codegen.exchange.fmi.fmu_files import HEADERS, emit_fmu_files
from codegen.exchange.fmi.unit import unit_definitions, unit_name
from codegen.exchange.fmi.variable import Version
from modewright.api.simulation import program
from tests.codegen.exchange.fmi.importer import Importer, unpack_fmu

SHIPPED = ("estimator", "estimator_float32", "supervisor", "contactor", "driveline")
ODD = """
language: 1
automaton: mapped
period: 10 ms
numbers: float64
parameters:
  gears: {value: 3, type: int, range: [1, 6], tunable: true, about: "odd <text> & 'more'"}
  is_open: {value: true, type: bool, tunable: true}
  limit: {table: {over: temp, unit: N*m, points: {280 K: 1, 300 K: 0.5, 320 K: 0}}, tunable: true}
inputs:
  temp: {unit: K, range: [233.15 K, 423.15 K]}
  count: {type: int, range: [0, 9]}
equations:
  torque: "if is_open then lookup(limit, temp) else 0 N*m"
discrete: {total: {type: int, initial: 0, range: [0, 15]}}
modes:
  resting: {number: 7, update: {total: count + gears}, transitions: {moving: {when: count > 4}}}
  moving: {number: -3}
initial: resting
outputs: [torque, total, mode]
"""
NAMES = ("PATH_MAX", "index", "fileno", "random", "COUNT", "PERIOD", "STEPPING", "variables",
         "image", "held", "number", "double_", "time_", "fmi2True", "strdup", "gamma")  # fmt: skip
"""Words of POSIX and of our own templates that a spec may use."""


@cache
def grammar(text: str, start: str) -> SimpleNamespace:
    """A grammar as FMPy has it, that remembers which names it has found to be legal."""
    return SimpleNamespace(parse=cache(Lark(text, start=start).parse))


def described(packed: bytes) -> dict[str, Any]:
    """Return the variables of an FMU by name, as FMPy reads them."""
    description = read_model_description(io.BytesIO(packed))
    return {variable.name: variable for variable in description.modelVariables}


def validated(packed: bytes, folder: Path) -> list[str]:
    """Return the problems that FMPy finds in an FMU."""
    path = folder / "packed.fmu"
    path.write_bytes(packed)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("lark.Lark", grammar)  # it parses each name letter by letter
        found: list[str] = validate_fmu(str(path))
    return found


def altered(packed: bytes, path: str, change: Callable[[bytes], bytes]) -> bytes:
    """Return an archive with another file in it."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(packed)) as old, zipfile.ZipFile(buffer, "w") as new:
        for name in old.namelist():
            new.writestr(name, change(old.read(name)) if name == path else old.read(name))
    return buffer.getvalue()


@pytest.mark.parametrize("name", SHIPPED)
def test_fmpy_finds_no_problem(name: str, version: Version, tmp_path: Path) -> None:
    assert validated(build_fmu(program(name), version, is_source_only=True), tmp_path) == []


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ((b'<Unknown index="', b'<Output valueReference="'), b"9", ""),
        ((b' unit="V"', b' unit="V"'), b' unit="parsec"', "parsec"),
        ((b'name="U_dc"', b'name="U_dc"'), b'name="U_pack"', "not unique"),
    ],
)
def test_a_wrong_description_is_found(
    old: tuple[bytes, bytes], new: bytes, told: str, version: Version, tmp_path: Path
) -> None:
    """The validator can fail: a wrong reference of an output, a unit and a name."""
    packed = build_fmu(program("supervisor"), version, is_source_only=True)
    before = old[version - 2]
    after = before + new if new == b"9" else new
    wrong = altered(packed, "modelDescription.xml", lambda data: data.replace(before, after, 1))
    assert wrong != packed
    problems = validated(wrong, tmp_path)
    assert problems
    assert told in " ".join(problems)


def test_a_name_that_is_not_legal_is_found_each_time(version: Version, tmp_path: Path) -> None:
    packed = build_fmu(program("contactor"), version, is_source_only=True)
    old, new = b'name="command"', b'name="7 commands"'
    wrong = altered(packed, "modelDescription.xml", lambda data: data.replace(old, new))
    for _ in range(2):
        assert "is not a legal variable name" in " ".join(validated(wrong, tmp_path))


def test_modes_and_words_are_enumerations_with_their_numbers(version: Version) -> None:
    found = described(build_fmu(program("supervisor"), version, is_source_only=True))
    torque, key = found["operation_drive_torque"], found["key"]
    items = [(item.name, int(item.value)) for item in torque.declaredType.items]
    assert items == [("creep", 0), ("pull", 1), ("regen", 2), ("inactive", -1)]
    assert [item.name for item in key.declaredType.items] == ["parked", "ignition", "crank"]


def test_variables_have_types_units_ranges_and_start_values(version: Version) -> None:
    found = described(build_fmu(program("supervisor"), version, is_source_only=True))

    def told(name: str) -> tuple[object, ...]:
        v = found[name]
        fields = ("type", "causality", "variability", "unit", "min", "max", "start")
        return tuple(getattr(v, field) for field in fields)

    real, time, whole = (
        ("Float32", "Float64", "UInt32") if version == 3 else ("Real", "Real", "Integer")
    )
    assert told("time")[:4] == (time, "independent", "continuous", "s")
    assert told("temp") == (real, "input", "discrete", "K", None, None, "233.15")
    assert told("T_creep") == (real, "parameter", "tunable", "N*m", "0.0", "50.0", "10.0")
    assert told("clear") == ("Boolean", "input", "discrete", None, None, None, "false")
    assert told("faults") == (whole, "output", "discrete", None, None, None, None)
    assert told("T_cmd")[:4] == (real, "output", "discrete", "N*m")
    assert told("fault.range_key")[:3] == ("Boolean", "local", "discrete")


def test_measurements_are_new_where_an_importer_does_not_say(version: Version) -> None:
    found = described(build_fmu(program("estimator"), version, is_source_only=True))
    assert found["is_new.y_em"].start == "true"
    assert found["solved.stamp_J_em"].start == "0.05"


def test_the_states_of_a_continuous_automaton_are_continuous(version: Version) -> None:
    found = described(build_fmu(program("driveline"), version, is_source_only=True))
    kinds = {name: v.variability for name, v in found.items()}
    assert kinds["w_em"] == kinds["T_em"] == "continuous"
    assert kinds["mode"] == "discrete"


def test_units_are_exponents_of_base_units() -> None:
    found = {
        unit.name: dict(unit.exponents) for unit in unit_definitions(["N*m", "rad/s", "V", "1"])
    }
    assert found == {
        "N*m": {"kg": 1, "m": 2, "s": -2},
        "rad/s": {"s": -1, "rad": 1},
        "V": {"kg": 1, "m": 2, "s": -3, "A": -1},
    }
    assert unit_name("m^2*kg/s^3/A") == "V"
    assert unit_name("1") == unit_name("?") == ""


def test_parameters_of_all_types_and_odd_texts_are_told(version: Version, tmp_path: Path) -> None:
    spec = tmp_path / "mapped.yaml"
    spec.write_text(ODD)
    packed = build_fmu(program(str(spec)), version, is_source_only=True)
    assert validated(packed, tmp_path) == []
    found = described(packed)
    starts = {name: v.start for name, v in found.items() if v.causality == "parameter"}
    assert starts == {
        "gears": "3",
        "is_open": "true",
        "limit[1]": "1.0",
        "limit[2]": "0.5",
        "limit[3]": "0.0",
    }
    assert found["gears"].description == "odd <text> & 'more'"
    assert [(i.name, int(i.value)) for i in found["mode"].declaredType.items] == [
        ("resting", 7),
        ("moving", -3),
    ]


def test_points_of_a_table_and_whole_parameters_are_tuned(version: Version, tmp_path: Path) -> None:
    spec = tmp_path / "mapped.yaml"
    spec.write_text(ODD)
    importer = Importer(
        unpack_fmu(build_fmu(program(str(spec)), version), tmp_path / "made", version)
    )
    importer.start({"temp": 290.0, "count": 2})
    assert importer.get(["torque", "mode"]) == {"torque": 0.75, "mode": 7}
    importer.set({"limit[2]": 0.25, "gears": 5, "count": 5})
    importer.step(0.0, 0.01)
    assert importer.get(["torque", "mode"]) == {"torque": 0.625, "mode": -3}
    importer.set({"is_open": False})
    importer.step(0.01, 0.01)
    assert importer.get(["torque"]) == {"torque": 0.0}
    importer.close()


def test_names_of_a_spec_may_be_words_of_the_c_around_it(version: Version, tmp_path: Path) -> None:
    inputs = "\n".join(f"  {name}: {{unit: N*m, default: 1 N*m}}" for name in NAMES)
    total = " + ".join(NAMES)
    text = f"language: 1\nautomaton: instance\nperiod: 1 ms\nnumbers: float32\ninputs:\n{inputs}\n"
    spec = tmp_path / "instance.yaml"
    spec.write_text(
        f"{text}equations: {{total: {total}}}\nmodes: {{a: {{}}}}\ninitial: a\noutputs: [total]\n"
    )
    importer = Importer(
        unpack_fmu(build_fmu(program(str(spec)), version), tmp_path / "made", version)
    )
    importer.start({"PATH_MAX": 3.0})
    assert importer.get(["total"]) == {"total": len(NAMES) + 2.0}
    importer.close()


def test_the_token_is_that_of_program_and_version() -> None:
    def tokens(values: dict[str, str]) -> list[str]:
        from codegen.exchange.fmi.fmu_files import instantiation_token

        return [instantiation_token(program("estimator", values), version) for version in (2, 3)]

    base = tokens({})
    assert base == tokens({})
    assert len({*base, *tokens({"k_hs": "6000 N*m/rad"})}) == 4


def test_sources_and_headers_of_the_standard_are_in_it_with_their_licence(version: Version) -> None:
    files = emit_fmu_files(program("estimator"), version)
    for header in HEADERS[version]:
        assert b"2-Clause BSD License" in files[f"sources/{header}"]
    assert (
        b'"estimator_fmu.c"'
        in files["modelDescription.xml" if version == 2 else "sources/buildDescription.xml"]
    )


def test_another_version_is_refused() -> None:
    with pytest.raises(ValueError, match="there is no FMI 1: versions are 2 and 3"):
        emit_fmu_files(program("contactor"), 1)  # type: ignore[arg-type]
