"""Against: one rival beside scipy in the rival's own environment; prints a line of JSON."""

from __future__ import annotations

import importlib
import json
import sys
import time

from tests.benchmark.competitor_scripts import with_scipy
from tests.benchmark.manoeuvre import TIP_OUT
from tests.benchmark.table import errors_of, format_ratio
from tests.benchmark.timing import time_interleaved


def main(module: str, pairs: int) -> None:
    """Measure the rival whose model stands in a module of this folder."""
    start = time.process_time()
    rival = importlib.import_module(f"tests.benchmark.competitor_scripts.{module}")
    run = rival.prepared(TIP_OUT)
    found = run()
    first = time.process_time() - start
    ratio = time_interleaved(run, lambda: with_scipy.run(TIP_OUT), pairs)
    figure = {**format_ratio(ratio, "peer", "scipy"), "first_run_s": first}
    print(json.dumps({**figure, "errors": errors_of(TIP_OUT, found)}))


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]))
