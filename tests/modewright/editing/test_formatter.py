"""Format: layout follows rules, and nothing else of a spec changes."""

from __future__ import annotations

import errno
import os
import random
from pathlib import Path
from typing import IO, Any

import pytest
from typer.testing import CliRunner

from language.overlays.expand_document import parse_document
from language.text.diagnostic import SpecError
from language.text.project_files import source_of
from language.text.yaml_parser import parse_yaml
from modewright.cli.app import app
from modewright.editing.formatter import format_text
from modewright.editing.tokenised_text import tokenise
from modewright.runtime.output_files import OutputError
from tests.modewright.editing.example_specs import ROOT, to_plain_data, valid_documents

HERE = Path(__file__).parent
UNTIDY, TIDY = (HERE / "untidy.yaml").read_text(), (HERE / "tidy.yaml").read_text()


def test_an_untidy_spec_is_laid_out_by_the_rules() -> None:
    assert format_text(UNTIDY) == TIDY


def test_a_column_stays_where_its_author_put_it() -> None:
    head = "language: 1\nautomaton: a\nparameters:\n"
    kept = head + "  a:      {value: 1}\n  b_long: {value: 2}\n  c_longer: {value: 3}\n"
    wide = head + "  a:        {value: 1}\n  b_long:   {value: 2}\n"
    half = head + "  a:        {value: 1}\n  b:        {value: 2}\n  b_long: {value: 3}\n"
    assert [format_text(kept), format_text(wide)] == [kept, wide]
    assert format_text(half) == half.replace(":        {", ":      {")


def test_every_spec_here_says_the_same_and_a_second_pass_changes_nothing() -> None:
    for path, document in valid_documents(("spec", "tests/data")):
        text = path.read_text("utf-8-sig")
        made = format_text(text, str(path))
        again = parse_document(source_of(path, made), made)
        assert to_plain_data(again.root) == to_plain_data(document.root), path
        assert _comments(made) == _comments(text), path
        assert format_text(made) == made, path


def test_the_shipped_specs_are_laid_out_by_the_rules() -> None:
    paths = sorted((ROOT / "spec").rglob("*.yaml"))
    texts = {path: path.read_text("utf-8") for path in paths}
    assert [path for path, text in texts.items() if format_text(text, str(path)) != text] == []


@pytest.mark.parametrize("seed", range(12))
def test_a_spec_that_was_shaken_says_the_same_and_is_laid_out_once_and_for_all(seed: int) -> None:
    chance = random.Random(seed)
    path = ROOT / "spec" / "ev_driveline" / f"{('estimator', 'plant', 'hko')[seed % 3]}.yaml"
    text = shaken(path.read_text("utf-8"), chance)
    made = format_text(text)
    before, after = (parse_document(source_of(path, each), each) for each in (text, made))
    assert to_plain_data(after.root) == to_plain_data(before.root)
    assert _comments(made) == _comments(text)
    assert format_text(made) == made


def shaken(text: str, chance: random.Random) -> str:
    """Return a text with other indentation, blanks and blank lines, and the same meaning."""
    width = chance.choice((1, 2, 3, 5))
    lines = []
    for line in text.splitlines():
        bare = line.lstrip(" ")
        content, sign, comment = bare.partition(" #")
        if '"' not in content:
            content = content.replace(", ", chance.choice((", ", ",   ")))
            content = content.replace("{", chance.choice(("{", "{ ")))
        depth = (len(line) - len(bare)) // 2
        lines.append(" " * (depth * width) + content + " " * chance.randint(0, 3) + sign + comment)
        lines += [""] * chance.choice((0, 0, 0, 2))
    return "\n".join(lines)


EMPTY_VALUES = {
    "a: {about:   , unit: s}": "a: {about: , unit: s}",
    "a: {unit: s,about: }": "a: {unit: s, about: }",
    "a: { about: ,unit: }  # c": "a: {about: , unit: }  # c",
    'a: {"about" :   }': 'a: {"about": }',
    "a: [b: , {c: }]": "a: [b: , {c: }]",
    "a: {b , c}": "a: {b, c}",
    "about:   # c\nunit:   s": "about:   # c\nunit: s",
    "about: \n  # c\nb:\n      c:\n      d: 1": "about:\n  # c\nb:\n  c:\n  d: 1",
    "a:\n -\n -   b:\n -  # c": "a:\n  -\n  - b:\n  -  # c",
    "a: {b:\n, c: 1}": "a: {b:\n, c: 1}",
}
"""Texts with keys without value, and how they are formatted."""


@pytest.mark.parametrize("text", EMPTY_VALUES)
def test_a_key_without_value_stays_valid(text: str) -> None:
    assert format_text(text) == EMPTY_VALUES[text] + "\n"
    assert_same_content(text)


@pytest.mark.parametrize("seed", range(300))
def test_a_random_mapping_with_empty_values_keeps_its_content(seed: int) -> None:
    assert_same_content("\n".join(random_block(random.Random(seed), 0)))


def assert_same_content(text: str) -> None:
    """Assert that a formatted text has the content of the text and is not changed again."""
    made = format_text(text)
    before, after = (parse_yaml(source_of(HERE, each), each) for each in (text, made))
    assert to_plain_data(after) == to_plain_data(before), (text, made)
    assert _comments(made) == _comments(text)
    assert format_text(made) == made, (text, made)


def random_block(chance: random.Random, depth: int) -> list[str]:
    """Return the lines of a block mapping with scalars, flow collections, blocks and no values."""
    lines: list[str] = []
    for key in random_keys(chance):
        kinds = ("", "", "s", "''", '""', "|", "flow", "block" if depth < 2 else "")
        value, blanks = chance.choice(kinds), " " * chance.choice((1, 1, 4))
        note = chance.choice(("", "", "   # note", "  #"))
        if value == "flow":
            value = random_flow(chance, 0)
        if value == "block":
            indent = " " * chance.choice((1, 2, 4))
            lines += [f"{key}:{note}", *(indent + line for line in random_block(chance, depth + 1))]
        elif value == "|":
            lines += [f"{key}: |", "     x  # no note", ""]
        else:
            lines += [f"{key}:{blanks}{value}{note}", *chance.choice(([], [], [""], ["# line"]))]
    return lines


def random_flow(chance: random.Random, depth: int) -> str:
    """Return a flow mapping or a list of such with keys without values."""
    parts = []
    for key in random_keys(chance):
        kinds = ("", "s", "''", "1 m/s", "[]", "{}", "deep")
        value = chance.choice(kinds)
        if value == "deep":
            value = random_flow(chance, depth + 1) if depth < 2 else ""
        colon = chance.choice((":", ":", ": ", " :   "))
        parts.append(chance.choice((key, f"{key}{colon} {value}", f"{key}{colon} {value} ")))
    comma = chance.choice((",", ", ", " , ", ",   "))
    return chance.choice(("{%s}", "{ %s }", "[{%s}]", "[ {%s} , {a: } ]")) % comma.join(parts)


def random_keys(chance: random.Random) -> list[str]:
    """Return some keys, one of which is quoted."""
    return chance.sample(("a", "about", "unit", '"q"', "'r'", "long_key"), chance.randint(1, 4))


def _comments(text: str) -> list[str]:
    page = tokenise(text)
    return [page.lines[line][column:].rstrip() for line, column in page.comment_columns.items()]


def test_a_text_of_several_lines_is_left_as_it_is() -> None:
    text = "about: |\n     a  # no comment\n\n\n       b   \nreq: 'x\n\n\n  y'\n"
    assert format_text(text) == text


def test_what_is_no_yaml_is_refused() -> None:
    with pytest.raises(SpecError):
        format_text("a: {b: 1")


def test_check_writes_nothing_and_says_what_would_change(tmp_path: Path) -> None:
    untidy, tidy = tmp_path / "a.yaml", tmp_path / "b.yaml"
    untidy.write_text(UNTIDY)
    tidy.write_text(TIDY)
    told = CliRunner().invoke(app, ["format", "--check", str(tmp_path)])
    assert told.exit_code == 1 and untidy.read_text() == UNTIDY
    assert "would change" in told.output and "b.yaml" not in told.output
    assert CliRunner().invoke(app, ["format", str(tmp_path)]).exit_code == 0
    assert untidy.read_text() == TIDY
    assert CliRunner().invoke(app, ["format", "--check", str(tmp_path)]).exit_code == 0


@pytest.mark.parametrize("mark", ["", "\ufeff"])
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_line_ends_and_a_mark_of_utf_8_stay(tmp_path: Path, mark: str, end: str) -> None:
    path = tmp_path / "a.yaml"
    path.write_bytes((mark + UNTIDY.replace("\n", end)).encode())
    assert CliRunner().invoke(app, ["format", str(path)]).exit_code == 0
    assert path.read_bytes() == (mark + TIDY.replace("\n", end)).encode()
    assert format_text(mark + TIDY.replace("\n", end)) == mark + TIDY.replace("\n", end)


def test_a_file_with_two_names_is_told_to_part(tmp_path: Path) -> None:
    path, other = tmp_path / "a.yaml", tmp_path / "other"
    path.write_text(UNTIDY)
    other.hardlink_to(path)
    told = CliRunner().invoke(app, ["format", str(path)]).output
    assert f"changed {path} (no longer one file with its 1 other hard link)" in told
    assert (path.read_text(), other.read_text()) == (TIDY, UNTIDY)
    path.write_text(UNTIDY)
    assert f"changed {path}\n" in CliRunner().invoke(app, ["format", str(path)]).output


def test_what_cannot_be_written_is_not_told_as_changed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a.yaml"
    path.write_text(UNTIDY)

    opened = os.fdopen

    def full(descriptor: int, mode: str = "r") -> IO[Any]:
        if "w" not in mode:
            return opened(descriptor, mode)
        os.close(descriptor)
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr("modewright.runtime.output_files.os.fdopen", full)
    told = CliRunner().invoke(app, ["format", str(path)])
    assert isinstance(told.exception, OutputError) and told.stdout == ""
    assert path.read_text() == UNTIDY and list(tmp_path.iterdir()) == [path]
