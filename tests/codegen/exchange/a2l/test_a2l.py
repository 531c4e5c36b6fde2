"""A2L: what we write is read by a parser of others, and its addresses are those of the compiler."""

from __future__ import annotations

import errno
import re
import shutil
import struct
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pya2l.model as model
import pytest
from hypothesis import HealthCheck, given, settings, strategies as st

from codegen.exchange.a2l import elf_addresses
from codegen.exchange.a2l.description import describe_module
from codegen.exchange.a2l.elf_addresses import ImageError
from codegen.exchange.a2l.writer import ModuleLocation, _unique_name, emit_a2l, locate_module
from codegen.exchange.calibration.calibration_page import page_constants, page_name
from codegen.toolchain.external_tools import ARM_COMPILER
from language.ir.program import Program
from modewright.api.simulation import program as shipped
from modewright.cli.app import app
from modewright.cli.common.exit_codes import run_with_exit_code
from tests.codegen.exchange.a2l.a2l_database import elements_of_kind, open_database
from tests.codegen.exchange.a2l.linked_programs import (
    TARGETS,
    link_program,
    read_section,
    symbol_addresses,
)
from tests.codegen.tunable_wait import waiting_automaton
from tests.language.spec_builders import program

NEEDS_ARM = pytest.mark.skipif(
    not shutil.which(ARM_COMPILER), reason="no compiler for ARM: make system-packages"
)
MAPS = """\
language: 1
automaton: maps
about: 'it says "no" to a \\ and to 90 °C'
period: 1 ms
numbers: float32
inputs:
  temp: {unit: degC, range: [-40, 200], fallback: 20}
  speed: {unit: rad/s, range: [0, 900], fallback: 0}
parameters:
  share: {table: {over: temp, unit: 1, points: {60 degC: 1, 90 degC: 0.5}}, tunable: true}
  most:
    table:
      over: [temp, speed]
      unit: N*m
      points: {20 degC: {0: 9, 5: 8, 9: 7}, 90 degC: {0: 3, 5: 2, 9: 1}}
    tunable: true
  gain: {value: 1, tunable: true, range: [0, 2]}
equations:
  T: gain * lookup(share, temp) * lookup(most, temp, speed)
modes: {run: {}}
outputs: [T]
"""
AUTOMATA = ("estimator_simple", "supervisor", "driveline")


@pytest.fixture(scope="module")
def whole_program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The contactor linked with its main, for this machine."""
    used = shipped("contactor")
    return link_program(used, describe_module(used), tmp_path_factory.mktemp("whole"))


def text_of(used: Program, elf: Path | None = None) -> str:
    return emit_a2l(used, locate_module(used, elf) if elf else None)


@pytest.mark.parametrize("name", AUTOMATA)
def test_a_parser_of_others_reads_all_of_it(name: str, tmp_path: Path) -> None:
    used = shipped(name)
    found = describe_module(used)
    with open_database(text_of(used), tmp_path) as session:
        measured, calibrated = (
            elements_of_kind(session, k) for k in ("Measurement", "Characteristic")
        )
        methods, tables = (elements_of_kind(session, k) for k in ("CompuMethod", "CompuVtab"))
        (mod_par,) = session.query(model.ModPar).all()
        assert mod_par.epk.identifier == found.digest
        assert list(measured) == [one.name for one in found.measurements]
        assert list(calibrated) == [one.name for one in found.characteristics]
        assert {one.conversion for one in (*measured.values(), *calibrated.values())} <= set(
            methods
        )
        mode = tables[
            methods[measured[f"{name}.memory.mode"].conversion].compu_tab_ref.conversionTable
        ]
        assert {(int(p.inVal), p.outVal) for p in mode.pairs} == {
            (m.number, m.name) for m in used.modes
        }
        for one in found.characteristics:
            assert calibrated[one.name].lowerLimit == pytest.approx(one.limits[0], rel=1e-7)
            assert calibrated[one.name].upperLimit == pytest.approx(one.limits[1], rel=1e-7)


@pytest.mark.parametrize("name", ["estimator", "supervisor"])
def test_what_may_be_calibrated_is_named_as_in_pages_that_are_exchanged(name: str) -> None:
    used = shipped(name)
    ours = [one.name for one in describe_module(used).characteristics]
    assert sorted(ours) == sorted(page_name(used, one) for one in page_constants(used))


@pytest.mark.long
@pytest.mark.parametrize("target", ["host", pytest.param("cortex-m4f", marks=NEEDS_ARM)])
@pytest.mark.parametrize("name", ["estimator_simple", "supervisor", "maps"])
def test_addresses_are_those_of_the_linker(name: str, target: str, tmp_path: Path) -> None:
    used = program(MAPS) if name == "maps" else shipped(name)
    found, machine = describe_module(used), TARGETS[target]
    elf = link_program(used, found, tmp_path, machine)
    asked = symbol_addresses(elf, found, machine)
    with open_database(emit_a2l(used, locate_module(used, elf, page="page")), tmp_path) as session:
        told = {
            n: m.ecu_address.address for n, m in elements_of_kind(session, "Measurement").items()
        }
        told |= {n: c.address for n, c in elements_of_kind(session, "Characteristic").items()}
        assert told == asked
        assert len(set(asked.values())) > 8


def test_the_default_page_holds_the_values_of_the_spec(tmp_path: Path) -> None:
    used = shipped("estimator")
    elf = link_program(used, describe_module(used), tmp_path)
    where = locate_module(used, elf)
    assert where.page.symbol == "estimator_default_cal"
    raw = read_section(elf, ".calibration.estimator")
    offset, size = where.page.members["J_em"]
    assert struct.unpack_from("<d", raw, offset) == (0.05,)
    assert size == 8
    solved = {c.name: c.value for c in used.constants if c.kind == "solved"}
    for name, value in solved.items():
        matrix, _, entry = name.partition(".")[2].partition(".")
        member = f"{matrix}_{entry.replace('.', '__')}" if entry else matrix
        offset, _ = where.page.members[f"solved.{member}"]
        assert struct.unpack_from("<d", raw, offset) == (value,), name


def test_curves_and_maps_have_their_axes(tmp_path: Path) -> None:
    with open_database(text_of(program(MAPS)), tmp_path) as session:
        found = elements_of_kind(session, "Characteristic")
        kinds = {name: (one.type, one.deposit) for name, one in found.items()}
        assert kinds == {
            "maps.share": ("CURVE", "layout.FLOAT32_IEEE"),
            "maps.most": ("MAP", "layout.FLOAT32_IEEE"),
            "maps.gain": ("VALUE", "layout.FLOAT32_IEEE"),
        }
        axes = [
            [
                float(str(p.axisPts_Value if hasattr(p, "axisPts_Value") else p))
                for p in axis.fix_axis_par_list.axisPts_Value
            ]
            for axis in found["maps.most"].axis_descr
        ]
        assert axes == [pytest.approx([293.15, 363.15]), [0.0, 5.0, 9.0]]


def test_a_tunable_wait_is_shown_in_ms(tmp_path: Path) -> None:
    """Raw numbers are ticks of 10 ms; limits are those of what is shown."""
    with open_database(
        text_of(program(waiting_automaton("waiting", "10 ms", "float32", "30 ms", "[20, 500]"))),
        tmp_path,
    ) as session:
        found = elements_of_kind(session, "Characteristic")["waiting.t_on"]
        assert (found.deposit, found.lowerLimit, found.upperLimit) == ("layout.UWORD", 20, 500)
        method = elements_of_kind(session, "CompuMethod")[found.conversion]
        assert (method.conversionType, method.unit) == ("LINEAR", "ms")
        timer = elements_of_kind(session, "Measurement")["waiting.timer.low_high"]
        assert (timer.conversion, timer.upperLimit) == (found.conversion, 655350)


def test_what_would_end_a_text_does_not(tmp_path: Path) -> None:
    spec = MAPS.replace("gain: {value", "gain: {about: 'a \"quote\" \\ and 90 °C', value")
    with open_database(text_of(program(spec)), tmp_path) as session:
        assert (
            elements_of_kind(session, "Characteristic")["maps.gain"].longIdentifier
            == "a 'quote' / and 90 ?C"
        )


SEVERAL = (
    "struct app {{ int n; {name}_Self each[2]; }}; static struct app app; static {name}_Cal page;"
)


def several(folder: Path) -> tuple[Program, Path]:
    used = shipped("contactor")
    uses = (("app.each[0]", "page"), ("app.each[1]", "page"))
    return used, link_program(used, describe_module(used), folder, declared=SEVERAL, uses=uses)


def test_one_of_several_instances_is_named(tmp_path: Path) -> None:
    used, elf = several(tmp_path)
    with pytest.raises(ImageError, match=r"there are: app\.each\[0\], app\.each\[1\]$"):
        locate_module(used, elf)
    with pytest.raises(ImageError, match=r"no contactor_Self is called `app`"):
        locate_module(used, elf, instance="app")
    first, second = (locate_module(used, elf, instance=f"app.each[{k}]").instance for k in (0, 1))
    assert first and second
    assert (
        second.address - first.address == -(-max(sum(at) for at in first.members.values()) // 4) * 4
    )


def test_code_of_another_spec_is_told(tmp_path: Path) -> None:
    used = shipped("contactor")
    elf = link_program(used, describe_module(used), tmp_path)
    with pytest.raises(ImageError, match="its contactor is of digest"):
        locate_module(shipped("contactor", {"t_close": "30 ms"}), elf)
    with pytest.raises(ImageError, match="it has no estimator_Version"):
        locate_module(shipped("estimator"), elf)


def test_a_program_that_tells_nothing_is_refused(tmp_path: Path) -> None:
    used = shipped("contactor")
    elf = link_program(used, describe_module(used), tmp_path, words=("-g0",))
    with pytest.raises(ImageError, match="is its code linked, and compiled with -g"):
        locate_module(used, elf)


def test_what_is_no_program_is_refused(tmp_path: Path) -> None:
    used = shipped("contactor")
    whole = link_program(used, describe_module(used), tmp_path).read_bytes()
    torn = {
        "empty": b"",
        "text": b"no program",
        "head": whole[:100],
        "half": whole[: len(whole) // 2],
    }
    for name, data in torn.items():
        (tmp_path / name).write_bytes(data)
        with pytest.raises(ImageError, match=name):
            locate_module(used, tmp_path / name)
    for other in ("nothing", "."):
        with pytest.raises(ImageError):
            locate_module(used, tmp_path / other)


@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.data())
def test_a_damaged_program_is_refused_or_read(whole_program: Path, data: st.DataObject) -> None:
    """Whatever pyelftools raises, a user reads that the file is damaged, and where."""
    torn = bytearray(whole_program.read_bytes())
    for _ in range(data.draw(st.integers(1, 40))):
        torn[data.draw(st.integers(4, len(torn) - 1))] = data.draw(st.integers(0, 255))
    used, file = shipped("contactor"), whole_program.with_name("torn")
    file.write_bytes(torn)
    try:
        emit_a2l(used, locate_module(used, file)).encode("ascii")
    except ImageError as error:
        assert re.match(rf"{re.escape(str(file))}: .* .* .*", str(error), re.DOTALL), error


@pytest.mark.parametrize(
    ("failure", "reason"),
    [
        (MemoryError(), ""),
        (OSError(errno.EINVAL, "Invalid argument"), ": Invalid argument"),
        (OverflowError("cannot fit 'int'"), ": cannot fit 'int'"),
        (KeyError(48), ""),
        (RecursionError(), ""),
    ],
)
def test_what_cannot_be_read_of_a_damaged_program_is_named(
    failure: Exception, reason: str, whole_program: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*arguments: object) -> None:
        raise failure

    monkeypatch.setattr("codegen.exchange.a2l.elf_addresses._find_structures", fail)
    with pytest.raises(ImageError) as refused:
        locate_module(shipped("contactor"), whole_program)
    label = "the file is damaged, its debug information cannot be read"
    assert str(refused.value) == f"{whole_program}: {label}{reason}"


def test_a_type_that_refers_to_itself_is_damage(monkeypatch: pytest.MonkeyPatch) -> None:
    circle = SimpleNamespace(tag="DW_TAG_typedef")
    monkeypatch.setattr("codegen.exchange.a2l.elf_addresses._type_of", lambda kind: kind)
    with pytest.raises(ValueError, match="a type refers to itself"):
        elf_addresses._strip_qualifiers(cast(Any, circle))


def test_another_layout_is_told(tmp_path: Path) -> None:
    used = shipped("contactor")
    where = locate_module(used, link_program(used, describe_module(used), tmp_path))
    assert where.instance
    torn = type(where.instance)("self", 0, {**where.instance.members, "faults": (0, 8)})
    with pytest.raises(ImageError, match=r"self\.faults has 8 bytes"):
        emit_a2l(used, ModuleLocation(where.image, where.page, torn))


def test_names_of_conversions_are_words_and_differ(tmp_path: Path) -> None:
    spec = MAPS.replace("  gain:", "  slow: {value: 2 1/s^2, tunable: true}\n  gain:")
    spec = spec.replace("T: gain *", "T: slow / 2 1/s^2 *")
    with open_database(text_of(program(spec)), tmp_path) as session:
        names = list(elements_of_kind(session, "CompuMethod"))
    assert "unit._1_per_s2" in names and len(set(names)) == len(names)
    assert all(part.isidentifier() for name in names for part in name.split("."))
    taken = ("unit.m", "unit.m_2")
    assert [_unique_name("unit.m", taken[:k]) for k in range(3)] == [
        "unit.m",
        "unit.m_2",
        "unit.m_3",
    ]


HIDDEN = "static char raw[4096]; static {name}_Cal page;\n#define self (*({name}_Self *)raw)"


def test_the_command_says_what_has_no_address(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    used, out = shipped("contactor"), str(tmp_path / "contactor.a2l")
    assert run("a2l", "contactor", "--out", out) == 0
    assert "it has no addresses: link the C with -g" in capsys.readouterr().out
    words = ("a2l", "contactor", "--out", out, "--page", "page", "--elf")
    assert run(*words, str(link_program(used, describe_module(used), tmp_path))) == 0
    assert "address" not in capsys.readouterr().out
    assert (
        run(*words, str(link_program(used, describe_module(used), tmp_path, declared=HIDDEN))) == 0
    )
    assert "its measurements have no addresses" in capsys.readouterr().out


def test_the_command_writes_it(tmp_path: Path) -> None:
    used = shipped("contactor")
    elf = link_program(used, describe_module(used), tmp_path)
    out = tmp_path / "contactor.a2l"
    assert run("a2l", "contactor", "--out", str(out), "--elf", str(elf), "--page", "page") == 0
    assert out.read_text() == emit_a2l(used, locate_module(used, elf, "page"))
    (tmp_path / "torn.elf").write_bytes(elf.read_bytes()[:2000])
    before = out.read_bytes()
    assert run("a2l", "contactor", "--out", str(out), "--elf", str(tmp_path / "torn.elf")) == 1
    assert out.read_bytes() == before


def run(*arguments: str) -> int:
    return run_with_exit_code(lambda: app(list(arguments), standalone_mode=False))
