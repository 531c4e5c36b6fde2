"""Compare two checkouts: generated C, object code, digests of Programs, refusals, number of tests.

Shows that a change of names and places changes no behaviour. Comments of C are ignored; identifiers
that were renamed on purpose are listed in a JSON file, old name to new name (`--renamed`).
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
COMPILE = ("cc", "-std=c99", "-O2", "-ffp-contract=off", "-fno-math-errno", "-c")
REFUSED = ("tests/semantics/refused", "tests/refused")
"""Folder of the refused specs, in the layouts that are known."""
EXAMPLES = """\
python tests/validation/figures/compare_checkouts.py ../before .
python tests/validation/figures/compare_checkouts.py ../before . --renamed names.json"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Print what differs; return 0 if nothing does."""
    parser = argparse.ArgumentParser(
        description=__doc__, epilog=EXAMPLES, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("before", type=Path, help="a checkout with its environment in .venv")
    parser.add_argument("after", type=Path, help="another one")
    parser.add_argument("--renamed", type=Path, help="JSON: old identifier of the C to new one")
    given = parser.parse_args(arguments)
    renamed = json.loads(given.renamed.read_text("utf-8")) if given.renamed else {}
    before, after = given.before.resolve(), given.after.resolve()
    comparisons = {
        "generated C": compare_sources(before, after, renamed),
        "object code": compare_objects(before, after),
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


def compare_sources(before: Path, after: Path, renamed: Mapping[str, str]) -> Iterator[str]:
    """Yield the generated files that differ in more than comments.

    The head of a file holds the digest of its Program, which is compared as well.
    """
    for name in _generated(before, after):
        texts = [(root / "generated" / name) for root in (before, after)]
        if not all(path.is_file() for path in texts):
            yield f"{name}: only in one checkout"
            continue
        old, new = (path.read_text("utf-8") for path in texts)
        for word, other in renamed.items():
            old = re.sub(rf"\b{re.escape(word)}\b", other, old)
        if COMMENT.sub("", old).split() != COMMENT.sub("", new).split():
            yield f"{name}: the code differs"
        if DIGEST.findall(old) != DIGEST.findall(new):
            yield f"{name}: the digest of the Program differs"


def compare_objects(before: Path, after: Path) -> Iterator[str]:
    """Yield the generated sources whose object code at -O2 differs."""
    for name in _generated(before, after):
        if name.endswith(".c") and len({_object_of(root, name) for root in (before, after)}) > 1:
            yield f"{name}: the object code differs"


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


def _object_of(root: Path, name: str) -> bytes:
    source = root / "generated" / name
    with tempfile.TemporaryDirectory() as scratch:
        text = COMMENT.sub(" ", source.read_text("utf-8"))
        for header in source.parent.glob("*.h"):
            Path(scratch, header.name).write_text(header.read_text("utf-8"), "utf-8")
        Path(scratch, source.name).write_text(text, "utf-8")
        subprocess.run([*COMPILE, source.name, "-o", "made.o"], cwd=scratch, check=True)
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
