"""Blocks of a page: runs its commands in order and compares what they print with the page.

The word after the three backticks of a block tells what is done with it:

- `sh`: each line is a command. `cd` changes the folder; a comment `# exit code 1` states the exit
  code, which is 0 without it.
- `text`: what the block of commands before it prints on stdout; `...` stands for any text.
- `yaml PATH`, `python PATH`, `csv PATH`, and `c PATH` with a main function: the whole content of a
  file, which is written.
- `c PATH`: consecutive lines of a file, as it is at the end of the page; `/* ... */` alone on a
  line stands for any lines.
- `python`: statements that are executed.
- `yaml`: an automaton without problems; the head of a sampled one is added where it is missing.
- `stateflow`: what the reader knows; nothing is done with it.

A block of another kind is an error.
"""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import pytest

import modewright as mw
from modewright.cli.app import app, expand_arguments
from modewright.cli.common.console import console
from modewright.cli.common.exit_codes import run_with_exit_code

BLOCK = re.compile(r"^( *)```(\w*) ?([^\n]*)\n(.*?)^\1```$", re.DOTALL | re.MULTILINE)
SLOW = ("modewright demo diagnose", "modewright diagnose", "modewright fit")
"""Commands that take more than seconds; so does what reads their results in a folder `found`."""
RUN_ELSEWHERE = {
    "make demo": "the same command as `modewright demo`",
    "make test": "these tests",
    "pip install .": "tests/packaging/test_wheel.py installs the wheel",
}
"""Commands of pages that are not run here, with the reason."""
WHOLE_FILES = ("yaml", "python", "csv")
HEAD = "language: 1\nautomaton: example\nperiod: 1 ms\nnumbers: float64\n"
GAP = "/* ... */"


@dataclass(frozen=True)
class Block:
    """A block of code on a page: word and rest of its first line, its text, its line number."""

    kind: str
    argument: str
    text: str
    line: int


def read_blocks(page: Path) -> list[Block]:
    """Return the blocks of a page in order."""
    text = page.read_text("utf-8")
    return [
        Block(
            match[2],
            match[3],
            re.sub(rf"^{match[1]}", "", match[4], flags=re.MULTILINE),
            text[: match.start()].count("\n") + 1,
        )
        for match in BLOCK.finditer(text)
    ]


def run_page(
    page: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str], is_long: bool
) -> None:
    """Do in the working folder what the page says; with `is_long` the slow commands as well."""
    monkeypatch.delenv("COLUMNS", raising=False)
    console.cache_clear()  # an earlier test may have made it for a narrow terminal
    printed: str | None = None
    excerpts = []
    for block in read_blocks(page):
        place = f"{page.name}:{block.line}"
        if block.kind == "sh":
            printed = _run_commands(block, monkeypatch, capfd, is_long, place)
        elif block.kind == "text":
            if printed is not None:
                assert_matches(block.text, printed, place)
        elif block.argument and (block.kind in WHOLE_FILES or "int main(" in block.text):
            file = Path(block.argument)
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(block.text, "utf-8")
        elif block.kind == "c":
            excerpts.append((block.text, Path(block.argument).absolute(), place))
        elif block.kind == "python":
            exec(compile(block.text, place, "exec"), {})
            capfd.readouterr()
        elif block.kind == "yaml":
            assert fragment_problems(block.text, Path("fragment.yaml")) == [], place
        else:
            assert block.kind == "stateflow", f"{place}: a block of the kind `{block.kind}`"
    for excerpt, file, place in excerpts:
        _assert_excerpt(excerpt, file.read_text("utf-8"), place)


def fragment_problems(text: str, file: Path) -> Sequence[mw.Problem]:
    """Return the problems of a spec; the head of a sampled automaton is added if it has none."""
    head = "" if text.startswith("language:") else HEAD
    file.write_text(head + text, "utf-8")
    return mw.check(str(file))


def _run_commands(
    block: Block,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
    is_long: bool,
    place: str,
) -> str | None:
    """Run the commands of a block and return their output; None if one of them was left out."""
    capfd.readouterr()
    outputs: list[str] = []
    is_complete = True
    for line in block.text.splitlines():
        expected = re.search(r"# exit code (\d+)$", line)
        words = shlex.split(line, comments=True)
        if not words or any(" ".join(words).startswith(one) for one in RUN_ELSEWHERE):
            is_complete = is_complete and not words
            continue
        if not is_long and (" ".join(words).startswith(SLOW) or "found/" in line):
            is_complete = False
        elif words[0] == "cd":
            monkeypatch.chdir(words[1])
        else:
            code = _run([one for word in words for one in _expand(word)])
            told = capfd.readouterr()
            assert code == (int(expected[1]) if expected else 0), f"{place}: {line}\n{told}"
            outputs.append(told.out)
    return "".join(outputs) if is_complete else None


def _run(words: list[str]) -> int:
    """Run a command, `modewright` inside this process, and return its exit code."""
    if words[0] == "modewright":
        arguments = expand_arguments(words[1:])
        return run_with_exit_code(lambda: app(arguments, standalone_mode=False))
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    return subprocess.run(words, env={**os.environ, "PATH": path}, check=False).returncode


def _expand(word: str) -> Iterator[str]:
    """Yield the files that a pattern matches, as a shell does; other words as they are."""
    files = sorted(map(str, Path().glob(word))) if "*" in word else []
    yield from files or [word]


def assert_matches(expected: str, printed: str, place: str) -> None:
    """Compare a block with an output; blanks at the ends of lines do not count."""
    shown, real = (
        "\n".join(line.rstrip() for line in text.strip("\n").splitlines())
        for text in (expected, printed)
    )
    pattern = re.escape(shown).replace(r"\.\.\.", ".*?")
    assert re.fullmatch(pattern, real, re.DOTALL), f"{place}: the page has another output\n{real}"


def _assert_excerpt(excerpt: str, text: str, place: str) -> None:
    """Compare an excerpt with a file: its parts between gaps are in the file, in this order."""
    start = 0
    for part in re.split(rf"^\s*{re.escape(GAP)}\n", excerpt, flags=re.MULTILINE):
        found = text.find(part.strip("\n"), start)
        assert found >= 0, f"{place}: the file has no\n{part}"
        start = found + len(part.strip("\n"))
