"""Public files: read the files of the manifest with the product and compare the outcomes.

`python -m tests.public.read_public_files DIR` reads the files below a folder, which has the layout
`owner/name/path`. `--how` prints how to obtain them, `--update` writes the outcomes as the expected
ones. The files belong to third parties and are not part of the repository.
"""

from __future__ import annotations

import argparse
import csv
import hashlib
import os
import pickle
import resource
import sys
import traceback
from collections import Counter
from dataclasses import dataclass, replace
from pathlib import Path

from tests.public.read_file import Outcome, read_file

MANIFEST = Path(__file__).with_name("manifest.csv")
"""The list of files with the expected outcomes."""
CPU_SECONDS = 180
"""Time of the processor after which reading a file counts as a hang [s]."""
HANG, CRASH, ABSENT, CHANGED = "hang", "crash", "absent", "changed"
"""Outcomes that are neither `read` nor a refusal."""


@dataclass(frozen=True)
class PublicFile:
    """A row of the manifest."""

    repository: str
    commit: str
    path: str
    sha256: str
    licence: str
    expected: str


def read_manifest() -> list[PublicFile]:
    """Return the rows of the manifest."""
    with MANIFEST.open(encoding="utf-8", newline="") as file:
        return [PublicFile(**row) for row in csv.DictReader(file)]


def write_manifest(files: list[PublicFile]) -> None:
    """Write the rows of the manifest."""
    with MANIFEST.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, list(PublicFile.__annotations__), lineterminator="\n")
        writer.writeheader()
        writer.writerows(vars(one) for one in files)


def explain_how(files: list[PublicFile]) -> str:
    """Return the commands that fetch the repositories of the manifest into a folder."""
    lines = []
    for repository, commit in dict.fromkeys((one.repository, one.commit) for one in files):
        lines.append(f"git clone https://github.com/{repository} DIR/{repository}")
        lines.append(f"git -C DIR/{repository} checkout --quiet {commit}")
    return "\n".join(lines)


def read_in_child(path: Path, mdf_python: str) -> Outcome:
    """Return the outcome of a file that another process reads, so that a hang ends."""
    receiving, sending = os.pipe()
    child = os.fork()
    if not child:
        os.close(receiving)
        resource.setrlimit(resource.RLIMIT_CPU, (CPU_SECONDS, CPU_SECONDS + 5))
        try:
            outcome = read_file(path, mdf_python)
        except Exception:
            outcome = Outcome(f"{CRASH}: {traceback.format_exc().strip().splitlines()[-1]}")
        with os.fdopen(sending, "wb") as pipe:
            pickle.dump(outcome, pipe)
        os._exit(0)
    os.close(sending)
    with os.fdopen(receiving, "rb") as pipe:
        data = pipe.read()
    os.waitpid(child, 0)
    return pickle.loads(data) if data else Outcome(HANG)


def read_public_file(folder: Path, file: PublicFile, mdf_python: str) -> Outcome:
    """Return the outcome of a file of the manifest."""
    path = folder / file.repository / file.path
    if not path.is_file():
        return Outcome(ABSENT)
    if hashlib.sha256(path.read_bytes()).hexdigest() != file.sha256:
        return Outcome(CHANGED)
    return read_in_child(path, mdf_python)


def main() -> int:
    """Read the files, print a table and the totals; return 1 if an outcome is not as expected."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("folder", nargs="?", type=Path, help="folder with owner/name/path")
    parser.add_argument("--how", action="store_true", help="print how to obtain the files")
    parser.add_argument("--update", action="store_true", help="write the outcomes as expected")
    parser.add_argument("--mdfreader", default="", help="a Python that has mdfreader")
    parser.add_argument("--only", default="", help="read the files whose path contains a text")
    options = parser.parse_args()
    files = read_manifest()
    if options.how or options.folder is None:
        print(explain_how(files))
        return 0 if options.how else 2
    totals: Counter[str] = Counter()
    results, wrong, values = [], 0, Counter[str]()
    for file in files:
        name = f"{file.repository}/{file.path}"
        if options.only not in name:
            results.append(file)
            continue
        outcome = read_public_file(options.folder, file, options.mdfreader)
        kind = outcome.text.partition(":")[0]
        kind = kind if kind in ("read", "differs", HANG, CRASH, ABSENT, CHANGED) else "refused"
        totals[kind] += 1
        values[file.path.rpartition(".")[2].lower()] += bool(outcome.compared)
        is_wrong = outcome.text != file.expected
        wrong += is_wrong
        mark = "unexpected" if is_wrong else "ok"
        print(f"{mark:10} {kind:8} {outcome.compared:5} {name}", flush=True)
        if kind != "read":
            print(f"{'':26}{outcome.text}")
        results.append(replace(file, expected=outcome.text))
    print(f"{totals.total()} files: " + ", ".join(f"{n} {kind}" for kind, n in totals.items()))
    compared = ", ".join(f"{n} {suffix}" for suffix, n in sorted(values.items()) if n)
    print(f"files whose values equal those of an oracle: {compared or 'none'}")
    print(f"{wrong} outcomes differ from the manifest")
    if options.update:
        write_manifest(results)
    return 1 if wrong and not options.update else 0


if __name__ == "__main__":
    sys.exit(main())
