"""The archive of an FMU: the same bytes each time, what the standard names, and no warnings."""

from __future__ import annotations

import io
import os
import platform
import re
import shutil
import subprocess
import zipfile
from pathlib import Path

import pytest

from codegen.exchange.fmi.archive import binary_path, build_fmu
from codegen.exchange.fmi.fmu_files import HEADERS, emit_fmu_files, read_headers
from codegen.exchange.fmi.variable import Version
from codegen.toolchain.compiler import FLAGS, WARNINGS, BuildError
from modewright.api.simulation import program
from tests.codegen.exchange.fmi.conftest import Ready

pytestmark = pytest.mark.long

MAIN = """
#include <stdio.h>
#include "fmi3Functions.h"
static void hear(void *e, fmi3Status s, fmi3String c, fmi3String text)
{
    puts(text);
}
int main(void)
{
    void *me = fmi3InstantiateCoSimulation("x", TOKEN, NULL, 0, 0, 0, 0, NULL, 0, NULL, hear, NULL);
    puts(me ? "made" : "none");
    return 0;
}
"""


def test_the_same_program_gives_the_same_bytes(
    version: Version, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    first = build_fmu(program("contactor"), version)
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("TZ", "Asia/Tokyo")
    assert build_fmu(program("contactor"), version) == first


def test_entries_are_sorted_and_have_no_time(version: Version) -> None:
    entries = zipfile.ZipFile(io.BytesIO(build_fmu(program("contactor"), version))).infolist()
    names = [entry.filename for entry in entries]
    assert names == sorted(names)
    assert {entry.date_time for entry in entries} == {(1980, 1, 1, 0, 0, 0)}
    assert binary_path("contactor", version) in names
    assert "sources/contactor_fmu.c" in names


def test_sources_alone_have_no_binary_and_need_no_compiler(
    version: Version, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PATH", "")
    packed = build_fmu(program("contactor"), version, is_source_only=True)
    names = zipfile.ZipFile(io.BytesIO(packed)).namelist()
    assert not [name for name in names if name.startswith("binaries/")]
    assert sorted(names) == sorted(emit_fmu_files(program("contactor"), version))


def test_a_machine_without_a_name_in_fmi_is_told(
    version: Version, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(platform, "machine", lambda: "z80")
    with pytest.raises(BuildError, match=r"no name for this machine .* z80"):
        build_fmu(program("contactor"), version)


def test_all_that_the_standard_names_is_seen_and_nothing_else(
    version: Version, ready: Ready
) -> None:
    (library,) = (ready("contactor", version).folder / "binaries").rglob("contactor.*")
    told = subprocess.run(["nm", "-D", "--defined-only", library], capture_output=True, text=True)
    seen = {line.split()[-1] for line in told.stdout.splitlines()}
    text = read_headers(version)[f"fmi{version}Functions.h"].decode()
    wanted = set(
        re.findall(rf"FMI{version}_Export\s+fmi{version}\w+TYPE\s+(fmi{version}\w+);", text)
    )
    assert len(wanted) == {2: 44, 3: 75}[version]
    assert seen == wanted


@pytest.mark.parametrize("compiler", ["gcc", "clang-19"])
@pytest.mark.parametrize("name", ["supervisor", "driveline"])
def test_the_c_has_no_warning(compiler: str, name: str, version: Version, tmp_path: Path) -> None:
    if shutil.which(compiler) is None:
        pytest.skip(f"no {compiler}: make system-packages")
    ours, standard = tmp_path / "sources", tmp_path / "standard"
    ours.mkdir()
    standard.mkdir()
    for path, data in emit_fmu_files(program(name), version).items():
        folder = standard if Path(path).name in HEADERS[version] else ours
        (folder / Path(path).name).write_bytes(data)
    words = [*FLAGS, *WARNINGS, "-Werror", "-fsyntax-only", "-isystem", str(standard)]
    command = [compiler, *words, str(ours / f"{name}_fmu.c")]
    told = subprocess.run(
        command, capture_output=True, text=True, env={**os.environ, "LC_ALL": "C"}
    )
    assert told.returncode == 0, told.stderr


def test_a_binary_that_was_compiled_with_contraction_makes_no_instance(tmp_path: Path) -> None:
    """`-mfma -ffp-contract=fast` changes bits; the FMU sees it when it is asked for an instance."""
    for path, data in emit_fmu_files(program("contactor"), 3).items():
        (tmp_path / Path(path).name).write_bytes(data)
    main = MAIN.replace("TOKEN", token_in(tmp_path / "contactor_fmu.c"))
    (tmp_path / "main.c").write_text(main)
    sources = [str(path) for path in tmp_path.glob("*.c")]
    found = {}
    fused = fused_flags()
    for contract in ("off", "fast"):
        flags = [*FLAGS, *(fused or []), f"-ffp-contract={contract}"]
        target = tmp_path / contract
        subprocess.run(["gcc", *flags, *sources, "-lm", "-o", target], check=True)
        found[contract] = subprocess.run([target], capture_output=True, text=True).stdout
    why = "it was compiled without -ffp-contract=off"
    refused = f"fmi3InstantiateCoSimulation is refused: {why}\nnone\n"
    assert found == {"off": "made\n", "fast": "made\n" if fused is None else refused}


def fused_flags() -> list[str] | None:
    """Return what makes a compiler use fused operations; None where a machine has none."""
    if platform.machine() in ("aarch64", "arm64"):
        return []
    known = Path("/proc/cpuinfo")
    return ["-mfma"] if known.exists() and "fma" in known.read_text().split() else None


def token_in(path: Path) -> str:
    """Return the token that stands in a source."""
    (found,) = re.findall(r'own_token\[\] = (".*")', path.read_text())
    return str(found)
