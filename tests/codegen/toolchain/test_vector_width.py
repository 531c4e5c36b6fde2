"""Vectors: the compiler says itself whether tracks can be compiled."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest

from codegen.toolchain.compiler import has_gcc_vectors

SAYS = """#!{python}
print("{macros}")
"""


@pytest.mark.parametrize(
    ("macros", "expected"),
    [
        ("__GNUC__ 13,__x86_64__ 1", True),
        ("__GNUC__ 13,__aarch64__ 1", False),
        ("__GNUC__ 4,__x86_64__ 1,__clang__ 1", False),
        ("", False),
    ],
)
def test_a_gcc_for_x86_64_has_them(
    macros: str, expected: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    compiler = tmp_path / "cc"
    told = "\\n".join(f"#define {macro}" for macro in macros.split(",") if macro)
    compiler.write_text(SAYS.format(python=sys.executable, macros=told))
    compiler.chmod(0o755)
    monkeypatch.setenv("CC", os.fspath(compiler))
    assert has_gcc_vectors() is expected


def test_one_that_does_not_run_has_none(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    compiler = tmp_path / "cc"
    compiler.write_text("no program")
    compiler.chmod(0o755)
    monkeypatch.setenv("CC", os.fspath(compiler))
    assert not has_gcc_vectors()
