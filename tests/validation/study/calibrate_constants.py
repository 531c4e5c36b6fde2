"""Set the constants of the decision that data decide, from the stored results of generators.

The constants maximise the mean logarithmic score of the verdicts (Gneiting, Raftery 2007), the mean
over generators with equal weight. `--leave-out` states the score of a generator that was not used.

python -m tests.validation.study.calibrate_constants [--generators a,b] [--leave-out NAME]
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Sequence
from itertools import product
from pathlib import Path

import numpy as np

from tests.validation.study.case_score import Answer
from tests.validation.study.decision_replay import Constants, mean_score, replayable
from tests.validation.study.stored_answers import RESULTS, read_answers

FORM_ERRORS = (0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 0.4, 0.45, 0.5, 0.6)
FORM_SAMPLES = (2.0, 4.0, 6.0, 8.0, 12.0, 16.0, 24.0, 32.0, 48.0)
ENERGIES = (0.1, 0.2, 0.3, 0.5, 0.7, 1.0, 1.4, 2.0, 3.0)
FINER = 2
"""Times that the grid is halved around its best point."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the best constants, with the score of each generator."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--results", type=Path, default=RESULTS, help="exported results")
    parser.add_argument("--generators", help="some of them, with commas; default: all")
    parser.add_argument("--leave-out", help="a generator that is not used to set the constants")
    given = parser.parse_args(arguments)
    answers = replayable(read_answers(given.results))
    if given.generators:
        answers = [one for one in answers if one.generator in given.generators.split(",")]
    used = [one for one in answers if one.generator != given.leave_out]
    if not used:
        parser.error("there are no results of these generators")
    best = best_constants(used)
    for name, constants in (("constants of the code", Constants()), ("best constants", best)):
        scores = mean_score(answers, constants)
        inner = [score for one, score in scores.items() if one != given.leave_out]
        print(f"{name}: {constants}")
        print(f"  mean score {np.mean(inner):.4f} of {len(inner)} generators")
        for one, score in scores.items():
            print(f"  {one}: {score:.4f}{' (not used)' if one == given.leave_out else ''}")
    return 0


def best_constants(answers: Sequence[Answer]) -> Constants:
    """Return the constants with the best mean score over generators with equal weight.

    They are sought on a grid that becomes finer around its best point; of equal scores those of the
    code are preferred, then the first ones.
    """
    best, top = Constants(), _score(answers, Constants())
    points: Iterator[tuple[float, ...]] = product(FORM_ERRORS, FORM_SAMPLES, ENERGIES)
    ratio = 1.4
    for _ in range(FINER + 1):
        for point in points:
            constants = Constants(*point)
            score = _score(answers, constants)
            if score > top:
                best, top = constants, score
        ratio = ratio**0.5
        factors = (1.0 / ratio, 1.0, ratio)
        around = best.form_error, best.form_samples, best.max_ordinary_energy
        points = product(*([round(value * f, 4) for f in factors] for value in around))
    return best


def _score(answers: Sequence[Answer], constants: Constants) -> float:
    return float(np.mean(list(mean_score(answers, constants).values())))


if __name__ == "__main__":
    sys.exit(main())
