"""Diagnosis of one case under a guard that ends the process if it opens a label or a generator.

python -m tests.validation.study.isolated_diagnosis CASE RESULT [--spec SPEC] [--effects DIR]
"""

from __future__ import annotations

import argparse
import json
import os
import re
import resource
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

BROKEN = 77
"""Exit code of a process that opened what is concealed."""
CONCEALED = ("truth", "label")
GENERATORS = ("tests/generators/",)
LOOKS = ("open", "os.listdir", "os.scandir", "glob.glob", "os.link", "os.symlink", "os.rename")
STARTS = ("os.system", "os.exec", "os.spawn", "os.posix_spawn", "os.startfile", "pty.spawn")
COMPILERS = ("cc", "gcc", "clang")
CODE = re.compile(r"\.pyc?(\.\d+)?$")
"""Ends of code, also of what Python writes before it renames it."""
WHO = (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)


def main() -> None:
    """Diagnose a folder with train/ and held_out/; write the verdict and what it took [s].

    Without `--spec` the folder has a spec.yaml and a map.yaml. The numbers of the decision are
    written beside the verdict, and what simpler methods name.
    """
    given = _parser().parse_args()
    sys.addaudithook(guard(_end))
    import modewright
    from diagnosis.result.verdict import replace_non_finite
    from tests.validation.study.decision_record import record_decision

    begun = time.monotonic()
    case = Path(given.case)
    train, held_out = (sorted((case / part).glob("*.csv")) for part in ("train", "held_out"))
    spec, columns = given.spec, None
    if spec is None:
        spec, columns = str(case / "spec.yaml"), str(case / "map.yaml")
    found = modewright.diagnose(
        spec, train, held_out, map=columns, effects=given.effects, thresholds="usual"
    )
    own, compilers = (use.ru_utime + use.ru_stime for use in map(resource.getrusage, WHO))
    wall = time.monotonic() - begun
    result = {
        "verdict": found.verdict.to_json(),
        "cpu_s": own + compilers,
        "compiler_s": compilers,
        "wall_s": wall,
        "decision": {},
        "simpler": {},
    }
    if found.diagnosis is not None:
        result["decision"] = replace_non_finite(record_decision(found.diagnosis))
        if given.baselines:
            from tests.validation.study.baseline import run_baselines

            result["simpler"] = run_baselines(found.diagnosis)
    Path(given.result).write_text(json.dumps(result))


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("case", help="folder with train/ and held_out/")
    parser.add_argument("result", help="JSON file to write")
    parser.add_argument("--spec", help="a spec; without it that of the folder")
    parser.add_argument("--effects", help="folder of effects instead of the library")
    parser.add_argument("--baselines", action="store_true", help="run simpler methods as well")
    return parser


def guard(end: Callable[[str], None]) -> Callable[[str, tuple[Any, ...]], None]:
    """Return an audit hook that calls `end` with what was done that is forbidden."""

    def hook(event: str, args: tuple[Any, ...]) -> None:
        if event in LOOKS:
            for place in args[:2]:
                if isinstance(place, str | bytes | os.PathLike) and is_concealed(place):
                    end(f"{event} {os.fsdecode(place)}")
        elif event in STARTS or (event == "subprocess.Popen" and not _compiles(args)):
            end(f"{event} {args[:2]}")

    return hook


def is_concealed(place: str | bytes | os.PathLike[Any]) -> bool:
    """Return whether a path is that of a truth, a label or a generator; links are followed."""
    path = Path(os.path.realpath(os.fsdecode(place)))
    if any(generator in path.as_posix() for generator in GENERATORS):
        return True
    is_code = CODE.search(path.name) is not None
    return not is_code and any(word in path.as_posix().lower() for word in CONCEALED)


def _compiles(args: tuple[Any, ...]) -> bool:
    """Return whether a program that is started is a C compiler."""
    command = args[1]
    first = command if isinstance(command, str | bytes) else command[0]
    return Path(os.fsdecode(first)).name.split("-")[0] in COMPILERS


def _end(what: str) -> None:
    os.write(2, f"what is concealed was opened: {what}\n".encode())
    os._exit(BROKEN)


if __name__ == "__main__":
    main()
