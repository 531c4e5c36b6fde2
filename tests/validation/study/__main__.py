"""Validate the diagnosis: cases of several generators, each diagnosed without access to its label.

The results are stored for each case at once; the same command continues an interrupted study. With
`--share` or `--seed` the page and the exported results go to build/validation instead of docs.
"""

from __future__ import annotations

import argparse
import dataclasses
import sys
from collections.abc import Sequence

from tests.validation.evidence.evidence_store import ROOT
from tests.validation.study.cases import FOLDER as TRIAL
from tests.validation.study.figures import FIGURES, measure
from tests.validation.study.generator_table import Generator, generators
from tests.validation.study.label_digests import (
    changed_groups,
    label_digests,
    store_digests,
    stored_digests,
)
from tests.validation.study.result_store import diagnose_group, export_groups
from tests.validation.study.stored_answers import RESULTS, is_current, read_answers
from tests.validation.study.validation_page import PAGE, write_page

EXAMPLES = """\
# all cases: diagnose what is missing, write docs/validation.md
python -m tests.validation.study
# the first 2 % of the cases of each group of two generators
python -m tests.validation.study --share 0.02 --generators blind_cases,driveline_b
# other cases
python -m tests.validation.study --seed 5 --groups full,clean --share 0.1
# the page again, from docs/evidence/validation.parquet
python -m tests.validation.study --page"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Diagnose the missing cases, export the results and write the page; return the exit code."""
    given = _parser().parse_args(arguments)
    every = generators(given.seed)
    if given.page:
        write_page(read_answers(), every, stored_digests(), is_current=is_current())
        return 0
    selected = _select(every, given.generators, given.groups)
    is_study = given.seed is None and given.share == 1.0
    digests = label_digests(selected)
    if given.seed is None:
        if not given.new_labels and (changed := changed_groups(digests)):
            print(f"the labels are not the stored ones: {', '.join(changed)}; see --new-labels")
            return 2
        digests = {**stored_digests(), **digests}
        store_digests(digests)
    results, page = (RESULTS, PAGE) if is_study else (TRIAL / RESULTS.name, TRIAL / PAGE.name)
    for generator in selected:
        for group in generator.groups:
            diagnose_group(generator, group, given.jobs, given.share, RESULTS)
            export_groups(selected, results)
    answers = read_answers(results)
    for figure in FIGURES:
        print(f"{figure.about}: {measure(figure, answers).mean_text} {figure.required}")
    write_page(answers, every, digests, page)
    print(f"wrote {page.relative_to(ROOT)}")
    return 0


def _select(
    every: Sequence[Generator], names: str | None, groups: str | None
) -> tuple[Generator, ...]:
    """Return some generators with some groups. Raises SystemExit for names that do not exist."""
    wanted = names.split(",") if names else [one.name for one in every]
    if unknown := set(wanted) - {one.name for one in every}:
        raise SystemExit(f"there is no generator {', '.join(sorted(unknown))}")
    some = groups.split(",") if groups else None
    return tuple(
        dataclasses.replace(
            one, groups=tuple(g for g in one.groups if some is None or g.name in some)
        )
        for one in every
        if one.name in wanted
    )


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m tests.validation.study",
        description=__doc__,
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--generators", help="some generators, with commas (all)")
    parser.add_argument("--groups", help="some of full,clean,weak,pairs,removed (all)")
    parser.add_argument("--share", type=float, default=1.0, help="of the cases of each group (1)")
    parser.add_argument("--seed", type=int, help="of other cases")
    parser.add_argument("--jobs", type=int, default=2, help="diagnoses at a time (2)")
    parser.add_argument("--page", action="store_true", help="only write the page again")
    parser.add_argument("--new-labels", action="store_true", help="store digests of new labels")
    return parser


if __name__ == "__main__":
    sys.exit(main())
