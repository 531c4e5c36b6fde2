"""Files that are no page: each is told with its place, ends with exit code 1, writes nothing."""

from __future__ import annotations

import random
import time
from pathlib import Path

import pytest

from codegen.exchange.calibration.encoding import MAX_BYTES
from language.text.diagnostic import SpecError
from modewright.api.calibrations import export_calibration, import_calibration
from tests.codegen.exchange.calibration.tunable_project import run_command, write_project

DAMAGED = 100
"""Damaged files of each format."""
SECONDS = 5.0
"""Longest processor time for a hostile file; a page of 100 kB takes a tenth of a second."""
HEAD = b"KONSERVIERUNG_FORMAT 2.0\n\n"
XML = b'<?xml version="1.0"?>\n'
GAIN = "<SW-INSTANCE><SHORT-NAME>kinds_float64.gain</SHORT-NAME>{}</SW-INSTANCE>"
BOMB = (
    XML
    + b'<!DOCTYPE a [<!ENTITY a0 "ha">'
    + b"".join(b'<!ENTITY a%d "%s">' % (k, b"&a%d;" % (k - 1) * 10) for k in range(1, 10))
    + b"]>\n<MSRSW>&a9;</MSRSW>"
)


def block(*lines: str, kind: str = "FESTWERT", name: str = "kinds_float64.gain") -> bytes:
    """Return a DCM file with one characteristic."""
    return HEAD + "\n".join([f"{kind} {name}", *lines, "END", ""]).encode()


def junk(size: int) -> bytes:
    return random.Random(7).randbytes(size)


CASES: dict[str, tuple[bytes, str]] = {
    "empty.dcm": (b"", "empty.dcm:1:1: error: the file is empty [MW103]"),
    "blank.csv": (b" \n\r\n", "blank.csv:1:1: error: the file is empty [MW103]"),
    "huge.dcm": (junk(10_000_000), f"has 10000000 bytes; a page has at most {MAX_BYTES} [MW104]"),
    "huge.cdfx": (junk(10_000_000), "huge.cdfx:1:1: error: the file has 10000000 bytes"),
    "binary.dcm": (HEAD + b"\x00\x01", "binary.dcm:3:1: error: this is no text"),
    "binary.cdfx": (junk(5000), "binary.cdfx:1:"),
    "binary.csv": (b"name,value\na,\xff\xfe\n", "binary.csv:2:1: error: this is not UTF-8 text"),
    "wide.csv": ("name,value".encode("utf-16"), "wide.csv:1:1: error: this is UTF-16"),
    "words.dcm": (b"FESTWERT a\nWERT 1\nEND\n", "words.dcm:1:1: error: this is no DCM file"),
    "version.dcm": (b"KONSERVIERUNG_FORMAT 3.0\n", "the format `3.0` of DCM is not known"),
    "cut.dcm": (HEAD + b"FESTWERT kinds_float64.gain\n  WERT 1\n", "cut.dcm:3:1: error: `FEST"),
    "open.dcm": (HEAD + b"FUNKTIONEN\n FKT a\n", "open.dcm:3:1: error: `FUNKTIONEN` has no `END`"),
    "quote.dcm": (block('  LANGNAME "a', "  WERT 1"), "quote.dcm:4:12: error: a quote is opened"),
    "twice.dcm": (
        block("WERT 1") + block("WERT 1").removeprefix(HEAD),
        "twice.dcm:6:10: error: `kinds_float64.gain` stands here twice",
    ),
    "comma.dcm": (block("  WERT 1,5"), "comma.dcm:4:8: error: `1,5` is not a number"),
    "nan.dcm": (block("  WERT NaN"), "nan.dcm:4:8: error: `NaN` is no finite number [MW303]"),
    "inf.dcm": (block("  WERT -inf"), "`-inf` is no finite number"),
    "past.dcm": (block("  WERT 1e999"), "`1e999` is out of the range of a double"),
    "far.dcm": (block("  WERT 1e999999999"), "`1e999999999` is out of the range of a double"),
    "long.dcm": (block("  WERT " + "1" * 5000), "is not a number"),
    "outside.dcm": (block("  WERT 9.1"), "`kinds_float64.gain` = 9.1 is outside its range, 0.0 to"),
    "unknown.dcm": (
        block("  WERT 1", name="kinds_float64.gian"),
        "has no tunable parameter or solved number `kinds_float64.gian` [MW115]",
    ),
    "unit.dcm": (
        block('EINHEIT_W "furlong"', "WERT 1"),
        "unit.dcm:4:11: error: `kinds_float64.gain` is not taken: `furlong` is not a unit [MW304]",
    ),
    "other.dcm": (block('EINHEIT_W "N*m"', "WERT 1"), "`N*m` does not fit the unit `1` [MW305]"),
    "two.dcm": (block("WERT 1 2"), "two.dcm:4:8: error: `kinds_float64.gain` has 2 values, its"),
    "none.dcm": (block("FUNKTION a"), "`kinds_float64.gain` has 0 values, its head says 1"),
    "sizes.dcm": (block("WERT 1", kind="FESTWERT 3"), "`FESTWERT` has nothing behind its name"),
    "size.dcm": (
        block("WERT 1", kind="KENNLINIE", name="kinds_float64.line 99999999999"),
        "behind its name `KENNLINIE` has 1 whole numbers",
    ),
    "array.dcm": (
        block("WERT 1 2", kind="FESTWERTEBLOCK", name="kinds_float64.gain 2"),
        "`kinds_float64.gain` is a single value",
    ),
    "table.dcm": (
        block("WERT 10 12.5", kind="FESTWERTEBLOCK", name="kinds_float64.line 2"),
        "`kinds_float64.line` has other points than the table of the spec [MW316]",
    ),
    "points.dcm": (
        block("ST/X 1 2 3", "WERT 10 12.5 1", kind="KENNLINIE", name="kinds_float64.line 3"),
        "`kinds_float64.line` has other points than the table of the spec",
    ),
    "type.dcm": (block("WERT 1.5", name="kinds_float64.whole"), "`1.5` is not whole, `whole` is"),
    "word.dcm": (
        block('TEXT "drove"', name="kinds_float64.gear"),
        "`drove` is not one of park, drive, back [MW114]",
    ),
    "root.cdfx": (XML + b"<HTML></HTML>", "root.cdfx:2:1: error: this is no CDFX file"),
    "cut.cdfx": (XML + b"<MSRSW><SW-INSTANCE>", "error: this is not XML: no element found"),
    "bomb.cdfx": (BOMB, "bomb.cdfx:2:13: error: a document that declares entities"),
    "file.cdfx": (
        XML + b'<!DOCTYPE a [<!ENTITY b SYSTEM "file:///etc/hosts">]>\n<MSRSW>&b;</MSRSW>',
        "file.cdfx:2:13: error: a document that declares entities",
    ),
    "entity.cdfx": (
        XML + b'<!DOCTYPE MSRSW SYSTEM "file:///etc/hosts">\n<MSRSW>&b;</MSRSW>',
        "entity.cdfx:3:8: error: the entity `b` is not known",
    ),
    "deep.cdfx": (XML + b"<a>" * 100_000, "deep.cdfx:2:190: error: elements lie more than 64 deep"),
    "encoding.cdfx": (
        b'<?xml version="1.0" encoding="klingon"?><MSRSW/>',
        "the encoding of this XML is not known",
    ),
    "nothing.cdfx": (
        XML + f"<MSRSW>{GAIN.format('')}</MSRSW>".encode(),
        "`kinds_float64.gain` has no value",
    ),
    "columns.csv": (b"name,val\na,1\n", "columns.csv:1:1: error: the first line has no column `v"),
    "extra.csv": (b"name,value,colour\na,1,red\n", "`colour` is not a column of a page"),
    "cells.csv": (b"name,value\na,1,2\n", "cells.csv:2:1: error: this line has 3 cells"),
    "nameless.csv": (b"name,value\n,1\n", "nameless.csv:2:1: error: this line has no name"),
    "twice.csv": (
        b"name,value\nkinds_float64.gain,1\nkinds_float64.gain,1\n",
        "twice.csv:3:1: error: `kinds_float64.gain` stands here twice",
    ),
    "quote.csv": (b'name,value\n"a,1\n', "error: this is not CSV"),
    "grid.csv": (
        b"name,value,x\nkinds_float64.line,1,1\nkinds_float64.line,1,1\n",
        "the lines of `kinds_float64.line` are no whole table over x and y",
    ),
    "ending.txt": (block("WERT 1"), "ending.txt:1:1: error: a page of a calibration ends with"),
}


@pytest.fixture(scope="module")
def root(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_project(tmp_path_factory.mktemp("project"))


@pytest.fixture(autouse=True)
def _inside(root: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(root)


def refused(name: str, capsys: pytest.CaptureFixture[str]) -> str:
    """Return what is told of a file that is refused at once, with nothing written."""
    before = sorted(Path().rglob("*"))
    start = time.process_time()
    assert run_command("import", name, "--of", "kinds_float64", "--out", "taken.yaml") == 1
    assert time.process_time() - start < SECONDS
    assert sorted(Path().rglob("*")) == before
    return capsys.readouterr().err


@pytest.mark.parametrize("name", CASES)
def test_a_hostile_file_is_told_with_its_place(
    name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    data, message = CASES[name]
    Path(name).write_bytes(data)
    told = refused(name, capsys)
    assert message in told
    assert name in told.partition(": error: ")[0]


@pytest.mark.parametrize("name", ["outside.dcm", "bomb.cdfx", "twice.csv"])
def test_nothing_is_solved_for_a_page_with_mistakes(
    name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    data, message = CASES[name]
    Path(name).write_bytes(data)
    assert run_command("resolve", "kinds_float64", "--page", name, "--out", "resolved.dcm") == 1
    assert message in capsys.readouterr().err and not Path("resolved.dcm").exists()


@pytest.mark.parametrize("name", ["folder.dcm", "absent.dcm", "/dev/null"])
def test_what_is_no_file_is_told(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    Path("folder.dcm").mkdir(exist_ok=True)
    told = refused(name, capsys)
    assert f"{name}:1:1: error: the file cannot be read" in told


def test_a_file_full_of_mistakes_is_told_in_part(capsys: pytest.CaptureFixture[str]) -> None:
    Path("junk.dcm").write_bytes(HEAD + b"JUNK a b c\n" * 500_000)
    assert "20 problems" in refused("junk.dcm", capsys)
    Path("junk.csv").write_bytes(b"name,value\n" + b"a,b,c\n" * 800_000)
    assert "20 problems" in refused("junk.csv", capsys)


def test_what_could_grow_does_not(capsys: pytest.CaptureFixture[str]) -> None:
    """A table of 20 000 by 20 000 points; 100 000 words, none of them known."""
    rows = "".join(f"kinds_float64.area,1,{k},{k}\n" for k in range(20_000))
    Path("grid.csv").write_text("name,value,x,y\n" + rows)
    assert "are no whole table over x and y" in refused("grid.csv", capsys)
    Path("words.dcm").write_bytes(block(*(f"W{k} 1" for k in range(100_000)), "WERT 1"))
    assert run_command("import", "words.dcm", "--of", "kinds_float64", "--out", "words.yaml") == 0
    assert capsys.readouterr().out.count("is not known in `FESTWERT`") == 12


def test_many_names_that_are_not_known_are_told_in_time(capsys: pytest.CaptureFixture[str]) -> None:
    lines = "".join(f"kinds_float64.p{k},1\n" for k in range(20_000))
    Path("many.csv").write_text("name,value\n" + lines)
    told = refused("many.csv", capsys)
    assert "... and 19900 more" in told and "20000 problems" in told


def test_a_page_with_bom_and_crlf_is_a_page(root: Path) -> None:
    assert run_command("export", "kinds_float64", "--out", "page.dcm") == 0
    text = Path("page.dcm").read_text()
    Path("crlf.dcm").write_bytes(b"\xef\xbb\xbf" + text.replace("\n", "\r\n").encode())
    for name in ("page", "crlf"):
        assert (
            run_command("import", f"{name}.dcm", "--of", "kinds_float64", "--out", f"{name}.yaml")
            == 0
        )
    plain, other = (Path(f"{name}.yaml").read_text() for name in ("page", "crlf"))
    assert plain.splitlines()[3:] == other.replace("crlf", "page").splitlines()[3:]


@pytest.mark.parametrize(
    ("out", "message"),
    [
        ("taken.txt", "a calibration ends with .yaml"),
        ("spec/kinds_float64.yaml", "this is no calibration; a new one would replace it"),
        ("nowhere/taken.yaml", "there is no folder nowhere"),
    ],
)
def test_a_calibration_replaces_nothing_else(
    out: str, message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("ok.dcm").write_bytes(block("WERT 1"))
    assert run_command("import", "ok.dcm", "--of", "kinds_float64", "--out", out) == 1
    assert message in capsys.readouterr().err


@pytest.mark.parametrize("out", ["page.txt", "spec/kinds_float64.yaml", "spec"])
def test_a_page_is_written_where_it_can_be(out: str) -> None:
    assert run_command("export", "kinds_float64", "--out", out) == 1
    assert run_command("export", "kinds_float64", "--out", "page", "--format", "xls") == 2


@pytest.mark.long
@pytest.mark.parametrize("form", ["dcm", "cdfx", "csv"])
def test_a_page_with_random_damage_is_a_page_or_is_told(form: str, root: Path) -> None:
    whole = export_calibration("kinds_float64").text(form).encode()
    chance = random.Random(20261123)
    file = Path(f"damaged.{form}")
    refusals = 0
    for _ in range(DAMAGED):
        data = bytearray(whole)
        for _ in range(chance.randint(1, 4)):
            start = chance.randrange(len(data))
            end = start + chance.choice((0, 1, 1, 5, 200))
            data[start:end] = chance.choice(
                (b"", b'"', b"\n", b"<", b";", b"9", chance.randbytes(3))
            )
        file.write_bytes(bytes(data))
        try:
            import_calibration(file, "kinds_float64")
        except SpecError:
            refusals += 1
    assert DAMAGED / 2 < refusals < DAMAGED
