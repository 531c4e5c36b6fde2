"""Compare two checkouts: generated C, object code, Programs, refusals, number of tests.

Shows that a change of names and places changes no behaviour. Comments of C are ignored. Identifiers
that were renamed on purpose are in a JSON file, such as renamed_identifiers.json: regular
expression of the old ones to replacement (`--renamed`). They are replaced in the C and in the
printed Programs of the first checkout. Digests of Programs, which depend on names, and symbols of
static functions are then not compared.
"""

from __future__ import annotations

import argparse
import json
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

COMMENT = re.compile(r"/\*.*?\*/", re.DOTALL)
DIGEST = re.compile(r"Program digest: [0-9a-f]+")
DIGEST_CONSTANT = re.compile(r'(\w_DIGEST) "[0-9a-f]+"')
TOKEN = re.compile(r"\w+|\S")
LIBRARIES = {"ha_math", "ha_mathf"}
"""Files of functions that several automata share."""
COMPILE = ("cc", "-std=c99", "-O2", "-ffp-contract=off", "-fno-math-errno", "-c")
REFUSED = ("tests/semantics/invalid_specs", "tests/refused")
"""Folder of the refused specs, in the layouts that are known."""
EXAMPLES = """\
python tests/validation/evidence/compare_checkouts.py ../before .
python tests/validation/evidence/compare_checkouts.py ../before . --renamed names.json"""
Renaming = Mapping[str, str]
"""Replacement by regular expression."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Print what differs; return 0 if nothing does."""
    parser = argparse.ArgumentParser(
        description=__doc__, epilog=EXAMPLES, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("before", type=Path, help="a checkout with its environment in .venv")
    parser.add_argument("after", type=Path, help="another one")
    parser.add_argument("--renamed", type=Path, help="JSON: regular expression of old names to new")
    given = parser.parse_args(arguments)
    renamed = json.loads(given.renamed.read_text("utf-8")) if given.renamed else {}
    before, after = given.before.resolve(), given.after.resolve()
    comparisons = {
        "generated C": compare_sources(before, after, renamed),
        "object code": compare_objects(before, after, renamed),
        "Programs": compare_programs(before, after, renamed),
        "refusals": compare_refusals(before, after),
    }
    differences = 0
    for subject, lines in comparisons.items():
        found = list(lines)
        differences += len(found)
        print(f"{subject}: {len(found)} differences", flush=True)
        for line in found:
            print(f"  {line}")
    print(f"tests: {count_tests(before)} before, {count_tests(after)} after")
    return 1 if differences else 0


def compare_sources(before: Path, after: Path, renamed: Renaming) -> Iterator[str]:
    """Yield the generated files that differ in more than comments.

    The digest of its Program, in a comment and a constant, is compared unless names are replaced.
    """
    for name in _generated(before, after):
        texts = [(root / "generated" / name) for root in (before, after)]
        if not all(path.is_file() for path in texts):
            yield f"{name}: only in one checkout"
            continue
        old, new = (path.read_text("utf-8") for path in texts)
        digests = [DIGEST.findall(text) for text in (old, new)]
        old, new = (_tokens(_code(text, bool(renamed))) for text in (old, new))
        if rename(old, renamed) != new:
            yield f"{name}: the code differs"
        if not renamed and digests[0] != digests[1]:
            yield f"{name}: the digest of the Program differs"


def compare_objects(before: Path, after: Path, renamed: Renaming) -> Iterator[str]:
    """Yield the generated sources whose object code at -O2 differs.

    If names are replaced, digests and symbols that a linker does not need are removed before.
    """
    for name in _generated(before, after):
        if name.endswith(".c"):
            codes = {_object_of(root, name, bool(renamed)) for root in (before, after)}
            if len(codes) > 1:
                yield f"{name}: the object code differs"


def compare_programs(before: Path, after: Path, renamed: Renaming) -> Iterator[str]:
    """Yield the automata with generated code whose printed Programs differ."""
    names = {Path(name).stem for name in _generated(before, after) if name.endswith(".c")}
    for name in sorted(names - LIBRARIES):
        old, new = (
            _run(root, "-m", "modewright", "explain", name, "--pass", "program")
            for root in (before, after)
        )
        if not new or rename(old, renamed) != new:
            yield f"{name}: the Program differs"


def rename(text: str, renamed: Renaming) -> str:
    """Return a text with names replaced, each at most once."""
    if not renamed:
        return text
    patterns = {re.compile(pattern): other for pattern, other in renamed.items()}

    def replaced(match: re.Match[str]) -> str:
        for pattern, other in patterns.items():
            if pattern.fullmatch(match[0]):
                return pattern.sub(other, match[0])
        return match[0]

    return re.sub(r"\w+", replaced, text)


def compare_refusals(before: Path, after: Path) -> Iterator[str]:
    """Yield the refused specs whose problems differ in code or place."""
    old, new = _refusals(before), _refusals(after)
    for name in sorted({*old, *new}):
        if old.get(name) != new.get(name):
            yield f"{name}: {old.get(name)} before, {new.get(name)} after"


def count_tests(root: Path) -> int:
    """Return how many tests pytest collects in a checkout."""
    done = _run(root, "-m", "pytest", "--collect-only", "-q", "-p", "no:cacheprovider")
    match = re.search(r"(\d+) tests collected", done)
    return int(match[1]) if match else 0


def _generated(*roots: Path) -> list[str]:
    files = {
        path.relative_to(root / "generated").as_posix()
        for root in roots
        for path in (root / "generated").rglob("*.[ch]")
    }
    return sorted(files)


def _tokens(code: str) -> str:
    """Return C code with one token a line: a longer name breaks lines elsewhere."""
    return "\n".join(TOKEN.findall(code))


def _code(text: str, is_renamed: bool) -> str:
    """Return a C text without comments and, if names are replaced, without its digest."""
    code = COMMENT.sub(" ", text)
    return DIGEST_CONSTANT.sub(r'\1 ""', code) if is_renamed else code


def _object_of(root: Path, name: str, is_renamed: bool) -> bytes:
    source = root / "generated" / name
    with tempfile.TemporaryDirectory() as scratch:
        text = _code(source.read_text("utf-8"), is_renamed)
        for header in source.parent.glob("*.h"):
            header_text = _code(header.read_text("utf-8"), is_renamed)
            Path(scratch, header.name).write_text(header_text, "utf-8")
        Path(scratch, source.name).write_text(text, "utf-8")
        subprocess.run([*COMPILE, source.name, "-o", "made.o"], cwd=scratch, check=True)
        if is_renamed:
            subprocess.run(["strip", "--strip-unneeded", "made.o"], cwd=scratch, check=True)
        return Path(scratch, "made.o").read_bytes()


def _refusals(root: Path) -> dict[str, list[tuple[str, int, int]]]:
    """Return code, line and column of each problem of each refused spec, by file name."""
    folder = next(name for name in REFUSED if (root / name).is_dir())
    files = [f"{folder}/{path.name}" for path in sorted((root / folder).glob("*.yaml"))]
    problems: dict[str, list[tuple[str, int, int]]] = {}
    for one in json.loads(_run(root, "-m", "modewright", "check", *files, "--json"))["problems"]:
        place = (one["code"], one["line"], one["column"])
        problems.setdefault(Path(one["file"]).name, []).append(place)
    return problems


def _run(root: Path, *words: str) -> str:
    done = subprocess.run(
        [root / ".venv/bin/python", *words], cwd=root, capture_output=True, text=True, check=False
    )
    return done.stdout


if __name__ == "__main__":
    sys.exit(main())
