"""Rules: each citation names a rule that a page has, each rule its module and its test."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from itertools import groupby
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
SEMANTICS, CODE_RULES = "docs/semantics.md", "docs/code_rules.md"
LAST = {SEMANTICS: 20, CODE_RULES: 25}
"""Rules that each page has."""
BESIDE = {".git", ".venv", "build", "generated"}
"""Folders that are not read: what is generated cites no rule."""
SUFFIXES = {".py", ".md", ".yaml", ".jinja", ".lark", ".c", ".h", ".toml", ".ts", ".ipynb"}
HEADING = re.compile(r"^(#+) Rule (C?\d+)([a-z]?): \S.*$", re.MULTILINE)
NUMBER = r"C?\d+[a-z]?(?![.]?\d)(?!\w)"
"""The number of a rule; not that of MISRA C, like 15.7."""
CITATION = re.compile(rf"\brules?\s+({NUMBER}(?:(?:,\s*|,?\s+(?:and|or|to)\s+|-){NUMBER})*)", re.I)
OLD = re.compile(r"\brules?\s+R\d+|\(R\d+\)|semantics,? \d|language\.md, section \d")
"""Citations of pages that are not in the repository, or of numbers that a page does not have."""
DECISION = re.compile(r"\bdecisions?[ /](\d{4})\b")
PATH = re.compile(r"`([\w./-]+/[\w./-]+)`")


@dataclass(frozen=True)
class Rule:
    """A rule of a page, or a part of one: 4, 4b, C7."""

    page: str
    number: str
    part: str
    text: str

    @property
    def name(self) -> str:
        """What citations call it."""
        return self.number + self.part

    def paths(self, field: str) -> list[str]:
        """Return the paths in a line like `Shown by: ...`."""
        lines = re.findall(rf"^{field}: (.*)$", self.text, re.MULTILINE)
        assert len(lines) <= 1, f"{self.name}: two lines `{field}`"
        return re.findall(r"`([^`]+)`", lines[0]) if lines else []


@cache
def _rules() -> tuple[Rule, ...]:
    """Return all rules of both pages, in their order."""
    found = []
    for page in LAST:
        text = (ROOT / page).read_text("utf-8").partition("\n## Where to find")[0]
        heads = list(HEADING.finditer(text))
        ends = [*(head.start() for head in heads[1:]), len(text)]
        for head, end in zip(heads, ends, strict=True):
            found.append(Rule(page, head[2], head[3], text[head.end() : end]))
    return tuple(found)


def leaf_rules() -> list[Rule]:
    """Return the rules that have no parts, and the parts of the others."""
    divided = {rule.number for rule in _rules() if rule.part}
    return [rule for rule in _rules() if rule.part or rule.number not in divided]


def _cited(text: str) -> Iterator[str]:
    """Yield the numbers of the rules that a text cites; `7-12` are all from 7 to 12."""
    for citation in CITATION.finditer(text):
        names = re.findall(rf"{NUMBER}|-", citation[1])
        for place, name in enumerate(names):
            if name != "-":
                yield name
            elif names[place - 1].isdigit() and names[place + 1].isdigit():
                yield from map(str, range(int(names[place - 1]) + 1, int(names[place + 1])))


@cache
def _texts() -> dict[str, str]:
    """Return the texts of the repository by their paths."""
    files = [path for path in ROOT.iterdir() if path.is_file()]
    for folder in ROOT.iterdir():
        if folder.is_dir() and folder.name not in BESIDE and not folder.name.startswith("."):
            files += [path for path in folder.rglob("*") if path.is_file()]
    return {
        str(path.relative_to(ROOT)): path.read_text("utf-8", errors="replace")
        for path in sorted(files)
        if path.suffix in SUFFIXES and path != Path(__file__).resolve()
    }


def _docstrings(path: str) -> str:
    """Return the strings of a module that stand alone: docstrings, also those of constants."""
    tree = ast.parse((ROOT / path).read_text("utf-8"))
    alone = (node.value for node in ast.walk(tree) if isinstance(node, ast.Expr))
    constants = (value.value for value in alone if isinstance(value, ast.Constant))
    return "\n".join(text for text in constants if isinstance(text, str))


@pytest.mark.parametrize("page", LAST)
def test_rules_are_numbered_without_holes(page: str) -> None:
    prefix = "C" if page == CODE_RULES else ""
    rules = [rule for rule in _rules() if rule.page == page]
    numbers = list(dict.fromkeys(rule.number for rule in rules))
    assert numbers == [f"{prefix}{number}" for number in range(1, LAST[page] + 1)]
    for number, same in groupby(rules, key=lambda rule: rule.number):
        parts = "".join(rule.part or "-" for rule in same)
        assert parts == "-abcdefghijkl"[: len(parts)], f"parts of rule {number}: {parts}"


@pytest.mark.parametrize("rule", leaf_rules(), ids=lambda rule: rule.name)
def test_a_rule_names_one_home_that_cites_it_and_a_test(rule: Rule) -> None:
    (home,) = rule.paths("Implemented in")
    assert rule.paths("Shown by"), "no test"
    cited = set(_cited(_docstrings(home)))
    assert cited & {rule.name, rule.number}, f"{home} does not cite rule {rule.name}"


@pytest.mark.parametrize("rule", leaf_rules(), ids=lambda rule: rule.name)
def test_a_case_that_shows_a_rule_says_so(rule: Rule) -> None:
    for path in rule.paths("Shown by"):
        expected = ROOT / path / "expected.yaml"
        if expected.exists():
            said = re.match(r"rule: (.*)", expected.read_text("utf-8"))
            assert said and rule.number in re.findall(r"\d+", said[1]), path


@pytest.mark.parametrize("page", LAST)
def test_what_a_page_names_exists(page: str) -> None:
    named = PATH.findall((ROOT / page).read_text("utf-8"))
    assert len(named) > 50
    assert [path for path in named if not (ROOT / path).exists()] == []


def test_a_question_has_one_module() -> None:
    table = (ROOT / SEMANTICS).read_text("utf-8").partition("\n## Where to find")[2]
    rows = re.findall(r"^\| ([^|]*\?) \| ([^|]*) \|$", table, re.MULTILINE)
    assert len(rows) >= 60
    assert len({question for question, _ in rows}) == len(rows)
    assert [answer for _, answer in rows if not re.fullmatch(r"`[\w./]+`", answer)] == []


def test_each_cited_rule_exists() -> None:
    known = {rule.name for rule in _rules()}
    missing = [
        f"{path}: rule {name}"
        for path, text in _texts().items()
        for name in _cited(text)
        if name not in known
    ]
    assert missing == []


def test_each_case_names_a_rule_that_exists() -> None:
    known = {rule.name for rule in _rules()}
    for path in sorted((ROOT / "tests" / "semantics" / "rules").glob("*/expected.yaml")):
        said = re.match(r"rule: (.*)", path.read_text("utf-8"))
        assert said, path
        names = re.findall(r"\d+", said[1])
        assert {*names} <= known and (names or "docs/" in said[1]), path


def test_nothing_cites_what_is_not_in_the_repository() -> None:
    old = [f"{p}: {m[0]}" for p, text in _texts().items() for m in OLD.finditer(text)]
    assert old == []
    decisions = {path.name[:4] for path in (ROOT / "docs" / "decisions").glob("*.md")}
    missing = [
        f"{path}: decision {number}"
        for path, text in _texts().items()
        for number in DECISION.findall(text)
        if number not in decisions
    ]
    assert missing == []


def test_citations_are_found_in_all_their_forms() -> None:
    text = "(rules 1, 4, 7-9) Rule 12; rules C5 and C6, rule 4b. MISRA C:2012, rule 15.7: rules 3\n"
    text += "or 5"
    numbers = "1 4 7 8 9 12 C5 C6 4b 3 5"
    assert list(_cited(text)) == numbers.split()
