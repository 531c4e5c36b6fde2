"""First step: from specs to the end of a first compiled run in a new process, nothing kept before.

Prints a line of JSON: processor time [s] of this process since its imports, and of the compiler.
"""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from typing import Any

from codegen.toolchain.build_cache import CACHE_VARIABLE
from tests.benchmark import modewright_run as ours
from tests.benchmark.competitors import ROOT
from tests.benchmark.manoeuvre import TIP_OUT


def measure_first_step() -> dict[str, Any]:
    """Return what a new process with an empty cache prints."""
    with tempfile.TemporaryDirectory() as folder:
        environ = {**os.environ, CACHE_VARIABLE: folder}
        command = [sys.executable, "-m", "tests.benchmark.cold_start"]
        done = subprocess.run(
            command, cwd=ROOT, env=environ, capture_output=True, text=True, check=True
        )
    found: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return found


def main() -> None:
    """Load, check, lower, print, compile, load and run; say what each side took."""
    start = time.process_time()
    run = ours.prepare_run(TIP_OUT, "5 ms").compiled()
    assert run.run()
    own = time.process_time() - start
    children = resource.getrusage(resource.RUSAGE_CHILDREN)
    compiler = children.ru_utime + children.ru_stime
    print(json.dumps({"total_s": own + compiler, "compiler_s": compiler}))


if __name__ == "__main__":
    main()
