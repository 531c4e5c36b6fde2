"""Sealed: one case diagnosed under a guard that ends the process if it looks at what is concealed.

python -m tests.validation.blind_study.isolated_diagnosis CASE RESULT [EFFECTS] [--alone]
"""

from __future__ import annotations

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
"""Exit code of a process that looked at what is concealed."""
CONCEALED = ("truth", "label")
GENERATORS = ("tests/generators/blind_cases", "tests/generators/open_cases")
LOOKS = ("open", "os.listdir", "os.scandir", "glob.glob", "os.link", "os.symlink", "os.rename")
STARTS = ("os.system", "os.exec", "os.spawn", "os.posix_spawn", "os.startfile", "pty.spawn")
COMPILERS = ("cc", "gcc", "clang")
CODE = re.compile(r"\.pyc?(\.\d+)?$")
"""Ends of code, also of what Python writes before it renames it."""
SPEC = "blind_driveline"
ALONE = "--alone"
WHO = (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)


def main() -> None:
    """Diagnose a folder with train/ and held_out/; write the verdict and what it took.

    Simpler methods are asked as well, unless it is diagnosed alone.
    """
    case, result, *effects = [word for word in sys.argv[1:] if word != ALONE]
    library = effects[0] if effects else None
    sys.addaudithook(guard(_end))
    import modewright
    from diagnosis.report.diagnosis_report import verdict_to_json

    begun = time.monotonic()
    train, held_out = (sorted(Path(case, part).glob("*.csv")) for part in ("train", "held_out"))
    found = modewright.diagnose(SPEC, train, held_out, effects=library, thresholds="usual")
    own, compilers = (use.ru_utime + use.ru_stime for use in map(resource.getrusage, WHO))
    wall = time.monotonic() - begun
    took = {"cpu_s": own + compilers, "compiler_s": compilers, "wall_s": wall}
    simpler = {}
    if found.diagnosis is not None and ALONE not in sys.argv:
        from tests.validation.blind_study.baseline import run_baselines

        simpler = run_baselines(found.diagnosis)
    kept = {"verdict": verdict_to_json(found.verdict), **took, "baselines": simpler}
    Path(result).write_text(json.dumps(kept))


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
    """Tell whether a path is that of a truth, a label or a generator; links are followed."""
    path = Path(os.path.realpath(os.fsdecode(place)))
    if any(generator in path.as_posix() for generator in GENERATORS):
        return True
    is_code = CODE.search(path.name) is not None
    return not is_code and any(word in path.as_posix().lower() for word in CONCEALED)


def _compiles(args: tuple[Any, ...]) -> bool:
    """Tell whether a program that is started is a C compiler."""
    command = args[1]
    first = command if isinstance(command, str | bytes) else command[0]
    return Path(os.fsdecode(first)).name.split("-")[0] in COMPILERS


def _end(what: str) -> None:
    os.write(2, f"the seal is broken: {what}\n".encode())
    os._exit(BROKEN)


if __name__ == "__main__":
    main()
