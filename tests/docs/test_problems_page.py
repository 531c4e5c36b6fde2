"""The page of problems: each kind with its code, what it means and an example that is told."""

from __future__ import annotations

import re
from collections.abc import Iterable

import pytest

from language.text.diagnostic import render_all
from language.text.error_codes import CODES
from tests.semantics.invalid_specs.cases import ROOT, cases, problems_of
from tests.semantics.invalid_specs.generated_cases import GENERATED_CASES
from tests.semantics.invalid_specs.problem_kinds import kinds

PAGE = ROOT / "docs" / "problems.md"
HEAD = """# Problems and their codes

Each kind of problem has a permanent code. `modewright check` prints the code after the message. The
outputs of `--json`, `--sarif` and `--github` contain the code as well. A warning does not change
the exit code of a check. The folder `tests/semantics/invalid_specs/` contains the spec of each
example and a corrected copy of it. `pytest tests/docs/test_problems_page.py --update` generates
this page.
"""
TITLES = {
    "1": "Text and files",
    "2": "Modes and transitions",
    "3": "Expressions, units, values",
    "4": "Variants, effects, calibrations",
    "5": "Observers, runs, methods",
    "6": "Systems, scenarios, studies",
    "7": "Recordings and results",
}


PLACE = re.compile(r"^\S*?([^/\s]+:\d+:\d+: (?:error|warning): .* \[(MW\d+)\])$")
"""The first line of what is told of a problem."""


@pytest.fixture(scope="module")
def examples(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """What is told first of each code in the book, else of what cannot be committed."""
    texts = [case.expected.read_text("utf-8") for case in cases()]
    found = first_told(texts)
    folder = tmp_path_factory.mktemp("made")
    for name in GENERATED_CASES if len(found) < len(CODES) else ():
        own = folder / name
        own.mkdir()
        told = render_all(problems_of(GENERATED_CASES[name](own)[0]))
        found = first_told([told.replace(str(folder), "/home/user")]) | found
    return found


def first_told(texts: Iterable[str]) -> dict[str, str]:
    """Return by its code the first problem of each kind, its file by name alone."""
    found: dict[str, str] = {}
    for text in texts:
        for block in text.strip("\n").split("\n\n"):
            first, _, rest = block.partition("\n")
            match = PLACE.match(first)
            assert match, first
            found.setdefault(match.group(2), f"{match.group(1)}\n{rest}".strip("\n"))
    return found


def test_every_kind_has_a_code_and_every_code_a_kind() -> None:
    """A new kind gets the next free code in `language/text/error_codes.py`; no code is reused."""
    assert set(CODES) == set(kinds())


def test_no_code_is_given_twice() -> None:
    codes = [code for code, _ in CODES.values()]
    assert len(set(codes)) == len(codes)
    assert codes == sorted(codes), "in their order"


def test_the_page_tells_every_code_with_an_example(examples: dict[str, str], update: bool) -> None:
    text = page(examples)
    if update:
        PAGE.write_text(text, "utf-8")
    assert PAGE.read_text("utf-8") == text


def page(examples: dict[str, str]) -> str:
    parts, title = [HEAD], ""
    for kind, (code, meaning) in CODES.items():
        if TITLES[code[2]] != title:
            title = TITLES[code[2]]
            parts.append(f"## {title}\n")
        parts.append(f"### {code} {kind}\n\n{meaning}\n\n```\n{examples[code]}\n```\n")
    return "\n".join(parts)
