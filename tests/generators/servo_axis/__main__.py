"""Command line: `python -m tests.generators.servo_axis --out DIR --labels FILE --seed N`."""

import argparse
import os
from pathlib import Path


def main() -> None:
    """Write cases as the arguments say."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, required=True, help="folder of the cases")
    parser.add_argument("--labels", type=Path, required=True, help="file of the truth, JSON")
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--effects", default="all:1,none:5", help="such as all:4,none:20 or a+b:1")
    parser.add_argument("--strength", type=float, default=1.0, help="0 gives clean twins")
    parser.add_argument("--jobs", type=int, default=1, help="processes")
    given = parser.parse_args()
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # read when numpy is imported
    from .cases import write_cases

    try:
        write_cases(given.out, given.labels, given.seed, given.effects, given.strength, given.jobs)
    except ValueError as error:
        parser.error(str(error))


if __name__ == "__main__":
    main()
