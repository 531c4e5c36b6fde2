"""Document: YAML as a tree of texts that know their places, and the traps of YAML, refused."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given, strategies as st

from language.text.diagnostic import Source
from language.text.document import (
    MAX_BYTES,
    MappingNode,
    ScalarNode,
    SequenceNode,
    lines_of,
    read_text,
)
from language.text.yaml_parser import MAX_DEPTH, parse_yaml
from tests.language.spec_builders import automaton, problem_lines, raised_problems


def read(text: str) -> MappingNode:
    return parse_yaml(Source("here", tuple(text.splitlines())), text)


def complaints(text: str) -> list[str]:
    return problem_lines(lambda: read(text))


def leaf(table: MappingNode, *keys: str) -> ScalarNode:
    node: object = table
    for key in keys:
        assert isinstance(node, MappingNode)
        node = node.get(key)
    assert isinstance(node, ScalarNode)
    return node


@pytest.mark.parametrize(
    "text",
    [
        "on",
        "off",
        "yes",
        "no",
        "null",
        "~",
        "1e-3",
        "010",
        "1:30",
        "0x1F",
        ".5",
        "2024-01-01",
        "==",
    ],
)
def test_a_scalar_is_the_text_that_was_written(text: str) -> None:
    assert leaf(read(f"a: {text}"), "a").text == text
    assert leaf(read(f"{{a: {text}}}"), "a").text == text


def test_on_is_a_key_like_any_other() -> None:
    assert list(read("on: 1\noff: 2\ny: 3\n1: 4\ntrue: 5\n").entries) == [
        "on",
        "off",
        "y",
        "1",
        "true",
    ]


def test_a_key_without_a_value_holds_an_empty_text() -> None:
    table = read("a:\nb: {c, d: }\n")
    assert [leaf(table, *keys).text for keys in (("a",), ("b", "c"), ("b", "d"))] == [""] * 3


def test_an_empty_mapping_and_list_are_no_scalars() -> None:
    table = read("a: {}\nb: []\n")
    assert isinstance(table.get("a"), MappingNode)
    assert isinstance(table.get("b"), SequenceNode)
    assert table.get("c") is None


def test_entries_keep_the_order_of_the_file() -> None:
    assert [entry.key for entry in read("b: 1\na: 2\nc: 3\n")] == ["b", "a", "c"]


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("a: 'x y'", "x y"),
        ('a: "x y"', "x y"),
        ("a: 'it''s'", "it's"),
        ('a: "x\\ty"', "x\ty"),
        ("a: |\n  x\n  y\n", "x\ny\n"),
        ("a: >-\n  x\n  y\n", "x y"),
        ("a: x\n   y\n", "x y"),
        ("a: x # comment", "x"),
        ("a: x#y", "x#y"),
    ],
)
def test_a_text_is_read_as_yaml_reads_it(text: str, value: str) -> None:
    assert leaf(read(text), "a").text == value


def test_every_node_knows_its_place() -> None:
    table = read("a: 1\nbc: {d: 'x', e: [p, qr]}\n")
    entry = table.entries["bc"]
    assert (entry.span.line, entry.span.column, entry.span.width) == (2, 1, 2)
    inner = leaf(table, "bc", "d")
    assert (inner.span.line, inner.span.column, inner.span.width) == (2, 9, 3)
    assert isinstance(entry.node, MappingNode)
    items = entry.node.get("e")
    assert isinstance(items, SequenceNode)
    assert [node.span.column for node in items.nodes] == [18, 21]


@pytest.mark.parametrize(("quote", "shift"), [("", 0), ("'", 1), ('"', 1)])
def test_the_text_of_a_scalar_starts_behind_its_quote(quote: str, shift: int) -> None:
    node = leaf(read(f"a: {quote}x + y{quote}"), "a")
    assert (node.span.column, node.text_span.column) == (4, 4 + shift)
    assert node.text_span.width == len("x + y")


def test_columns_count_characters_not_bytes() -> None:
    assert leaf(read("{ä: é, b: x}"), "b").span.column == 11


@given(
    st.dictionaries(
        st.text("abcxyz", min_size=1, max_size=4),
        st.text("abc <>*/().-+^\"'äπ", min_size=1, max_size=12),
        min_size=1,
        max_size=5,
    )
)
def test_a_quoted_text_stands_where_its_span_says(entries: dict[str, str]) -> None:
    lines = [f'{key}:  "{text.translate({34: None})}"' for key, text in entries.items()]
    table = read("\n".join(lines))
    for entry, line in zip(table, lines, strict=True):
        node = entry.node
        assert isinstance(node, ScalarNode)
        column = node.text_span.column - 1
        assert line[column : column + len(node.text)] == node.text


def test_a_duplicate_key_names_the_first_place() -> None:
    (problem,) = raised_problems(lambda: read("a: 1\nb:\n  c: 1\n  d: 2\n  c: 3\n"))
    assert (problem.span.line, problem.span.column, problem.label) == (5, 3, "`c` is given twice")
    assert problem.help == "it is given first at here:3:3"


@pytest.mark.parametrize("text", ["{a: 1, a: 2}", "a: 1\n'a': 2\n", "a: 1\nb: 2\na: 3\n"])
def test_a_duplicate_key_is_refused_however_it_is_written(text: str) -> None:
    assert len(complaints(text)) == 1


def test_a_key_given_three_times_is_told_twice() -> None:
    problems = raised_problems(lambda: read("a: 1\na: 2\na: 3\n"))
    assert [problem.help for problem in problems] == ["it is given first at here:1:1"] * 2


def test_the_same_key_in_two_mappings_is_no_duplicate() -> None:
    assert complaints("a: {x: 1}\nb: {x: 1}\n") == []


@pytest.mark.parametrize(
    ("text", "label"),
    [
        ("a: &p 1\n", "1:4 an anchor (`&name`) is not part of the language"),
        ("a: !!str 1\n", "1:4 a tag (`!name`) is not part of the language"),
        ("a: ! 1\n", "1:4 a tag (`!name`) is not part of the language"),
        ("a: !mine {b: 1}\n", "1:4 a tag (`!name`) is not part of the language"),
        ("b: {<<: {c: 1}}\n", "1:5 a merge key (`<<`) is not part of the language"),
        ("[a, b]: 1\n", "1:1 a key is a name, not a list or a mapping"),
        ("? {a: 1}\n: 2\n", "1:3 a key is a name, not a list or a mapping"),
    ],
)
def test_a_feature_of_yaml_that_is_a_trap_is_refused(text: str, label: str) -> None:
    assert complaints(text) == [label]


def test_an_anchor_and_its_alias_are_both_told() -> None:
    assert [line.partition(" ")[0] for line in complaints("a: &p 1\nb: *p\n")] == ["1:4", "2:4"]


@pytest.mark.parametrize("text", ["", "\n\n", "# only a comment\n", "---\n"])
def test_an_empty_file_is_told_what_it_starts_with(text: str) -> None:
    problems = raised_problems(lambda: read(text))
    assert [problem.label for problem in problems] in (
        ["the file is empty"],
        ["a spec is a mapping that starts with `language: 1`"],
    )


@pytest.mark.parametrize("text", ["just words", "- a\n- b\n", "[1, 2]"])
def test_a_file_that_is_no_mapping_is_refused(text: str) -> None:
    assert complaints(text) == ["1:1 a spec is a mapping that starts with `language: 1`"]


@pytest.mark.parametrize(
    "text",
    [
        "a: 1\n---\nb: 2\n",
        "a: {b: 1\n",
        "a: b: c\n",
        "\ta: 1\n",
        "a: 'x\n",
        "a: [1}\n",
        "a: \x07\n",
    ],
)
def test_what_is_no_yaml_is_a_problem_with_a_place(text: str) -> None:
    (problem,) = raised_problems(lambda: read(text))
    assert problem.label.startswith("this is not YAML: ")
    assert problem.span.line >= 1


@pytest.mark.parametrize("pair", ["{}", "[]"])
def test_nesting_is_read_up_to_a_depth_and_refused_beyond(pair: str) -> None:
    opening = "{a: " if pair == "{}" else "["

    def nested(depth: int) -> str:
        return "a: " + opening * (depth - 1) + "1" + pair[1] * (depth - 1)

    assert complaints(nested(MAX_DEPTH)) == []
    (problem,) = raised_problems(lambda: read(nested(MAX_DEPTH + 1)))
    assert problem.label == f"nested deeper than {MAX_DEPTH} levels"
    assert raised_problems(lambda: read(nested(100 * MAX_DEPTH)))


def test_indented_blocks_are_counted_too() -> None:
    lines = [" " * level + "a:" for level in range(MAX_DEPTH + 1)]
    assert complaints("\n".join(lines[:-1])) == []
    assert len(complaints("\n".join(lines))) == 1


def test_a_byte_order_mark_is_no_character(tmp_path: Path) -> None:
    path = tmp_path / "a.yaml"
    path.write_bytes(b"\xef\xbb\xbflanguage: 1\n")
    source, text = read_text(path, "a.yaml")
    assert source.lines == ("language: 1",)
    assert parse_yaml(source, text).entries["language"].span.column == 1


def test_windows_line_ends_are_read() -> None:
    assert leaf(read("a: x\r\nb: y\r\n"), "b").text == "y"


@pytest.mark.parametrize(
    ("data", "line"), [(b"\x7fELF\xff\x00", 1), (b"a: 1\nb: \xe4\n", 2), (b"\xff\xfea\x00", 1)]
)
def test_a_binary_file_is_refused_at_its_line(tmp_path: Path, data: bytes, line: int) -> None:
    path = tmp_path / "a.yaml"
    path.write_bytes(data)
    (problem,) = raised_problems(lambda: read_text(path))
    assert (problem.span.line, problem.label) == (line, "this is not UTF-8 text")


def test_a_file_that_cannot_be_read_is_a_problem(tmp_path: Path) -> None:
    assert problem_lines(lambda: read_text(tmp_path / "none.yaml"))[0].startswith(
        "1:1 the file cannot be read"
    )
    assert problem_lines(lambda: read_text(tmp_path))[0].startswith("1:1 the file cannot be read")


def test_a_huge_file_is_refused_unread(tmp_path: Path) -> None:
    path = tmp_path / "huge.yaml"
    path.write_bytes(b"#" * (MAX_BYTES + 1))
    (problem,) = raised_problems(lambda: read_text(path))
    assert problem.label.startswith(f"the file has {MAX_BYTES + 1} bytes")


def test_a_comma_in_braces_is_explained() -> None:
    states = "states: {x: {unit: m, initial: max(1 m, 2 m)}}"
    text = f"language: 1\nautomaton: a\n{states}\nmodes: {{o: {{}}}}\n"
    problems = raised_problems(lambda: automaton(text))
    assert [problem.help for problem in problems] == ['quote it: `initial: "max(1 m, 2 m)"`']


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r", "\x85", "\u2028", "\u2029"])
def test_a_line_end_at_the_end_starts_no_further_line(end: str) -> None:
    assert lines_of(f"a{end}") == ("a",)
    assert lines_of(f"a{end}b") == lines_of(f"a{end}b{end}") == ("a", "b")
    assert lines_of(f"a{end}{end}") == ("a", "")
    assert lines_of(end) == ("",)
    assert lines_of("") == ()
