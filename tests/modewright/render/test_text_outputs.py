"""Free texts are hostile until proven otherwise: every printer, every trick."""

from __future__ import annotations

import itertools
import json
import subprocess
import unicodedata
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest

import modewright as mw
from codegen.emit.c_comment import MAX_COMMENT_LENGTH
from language.text.sanitise import INVISIBLE_CATEGORIES
from tests.modewright.text_outputs import HOSTILE, PRINTERS

TEXTS = [pytest.param(text, id=name) for name, text in HOSTILE.items()]


@pytest.mark.parametrize("printer", PRINTERS)
@pytest.mark.parametrize("text", TEXTS)
def test_nothing_unseen_is_printed(printer: str, text: str) -> None:
    printed = PRINTERS[printer](text)
    unseen = {c for c in printed if unicodedata.category(c) in INVISIBLE_CATEGORIES}
    assert unseen <= {"\n", "\t"}
    assert printed.encode("utf-8")


@pytest.mark.parametrize("text", TEXTS)
def test_a_comment_of_c_is_one_short_line_that_ends_where_it_ends(text: str) -> None:
    printed = PRINTERS["C comment"](text)
    inside = printed.removeprefix("/* ").removesuffix(" */")
    assert printed.isascii() and "\n" not in printed
    assert not {"*/", "/*", "//", "??"} & {a + b for a, b in itertools.pairwise(inside)}
    assert not inside.endswith("\\")
    assert len(inside) <= 2 * MAX_COMMENT_LENGTH


@pytest.mark.parametrize("text", TEXTS)
def test_a_problem_is_at_most_four_short_lines(text: str) -> None:
    lines = PRINTERS["problem"](text).split("\n")
    assert len(lines) == 4
    assert all(len(line) < 13_000 for line in lines)
    assert len(lines[1]) < 200 and len(lines[2]) < 200


@pytest.mark.parametrize("text", TEXTS)
def test_json_gives_the_text_back(text: str) -> None:
    assert json.loads(PRINTERS["JSON"](text))["message"] == text


@pytest.mark.parametrize("printer", ["SVG", "plot"])
@pytest.mark.parametrize("text", TEXTS)
def test_svg_is_xml_without_scripts(printer: str, text: str) -> None:
    root = ElementTree.fromstring(PRINTERS[printer](text))
    assert not [e for e in root.iter() if e.tag.rpartition("}")[2].lower() == "script"]


@pytest.mark.parametrize("text", TEXTS)
def test_mermaid_has_as_many_lines_whatever_the_text(text: str) -> None:
    lines = PRINTERS["Mermaid"](text).splitlines()
    assert len(lines) == len(PRINTERS["Mermaid"]("x > 1").splitlines())
    assert not any("<script" in line for line in lines)


def test_c_with_hostile_texts_is_compiled_without_a_warning(tmp_path: Path) -> None:
    texts = {f"u_{k}": t for k, t in enumerate(HOSTILE.values()) if "\ud800" not in t}
    inputs = "\n".join(
        f"  {name}: {{range: [-9, 9], about: {json.dumps(t)}}}" for name, t in texts.items()
    )
    spec = tmp_path / "hostile.yaml"
    spec.write_text(
        "language: 1\nautomaton: hostile\nperiod: 1 ms\nnumbers: float64\n"
        f"inputs:\n{inputs}\nparameters: {{k: {{value: 2, about: {json.dumps('*/ x ??/')}}}}}\n"
        f"states: {{x: {{initial: 0, range: [-9, 9], about: {json.dumps('*/ x ??/')}}}}}\n"
        f"modes: {{only: {{update: {{x: k + {' + '.join(texts)}}}}}}}\noutputs: [x]\n"
    )
    for name, text in mw.generate(str(spec)).items():
        (tmp_path / name).write_text(text)
    command = ["cc", "-std=c99", "-Wall", "-Wextra", "-Wcomment", "-Wtrigraphs", "-Werror"]
    done = subprocess.run(
        [*command, "-fsyntax-only", "hostile.c"], cwd=tmp_path, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    assert "evil" in (tmp_path / "hostile.h").read_text()
