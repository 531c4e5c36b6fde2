"""Invariance of the diagnosis: the same decision if a case is written differently.

Each case is transformed (`case_transformations`) and decided upon again. The same outcome, first
effect and place must result, and the parameters must lie within the intervals of the untransformed
case. Each decision is stored at once; the same command continues an interrupted study.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any

from tests.validation.evidence.evidence_store import ROOT
from tests.validation.properties.case_transformations import (
    TRANSFORMATIONS,
    NotWritableError,
    Transformation,
)
from tests.validation.study.cases import FOLDER, generate_cases
from tests.validation.study.generator_table import IN_CASE_FOLDER, generators
from tests.validation.study.isolated_process import ENVIRONMENT, MAX_TIME
from tests.validation.study.result_store import product_digest

UNCHANGED = Transformation("unchanged", "the case as it is")
INTERVAL_STDS = 1.96
"""Half width of an interval of 95 %, in standard deviations."""
REQUIRED = 39 / 40
"""Part of the cases that must agree."""
GROUPS = ("full", "clean")
Decision = Mapping[str, Any]
EXAMPLES = """\
# two cases of each generator, all transformations
python -m tests.validation.properties.invariance --cases 2
# a case of a folder with GENERATOR/CASE, one transformation
python -m tests.validation.properties.invariance --folder cases --cases relay_plants/case_000 \\
    --transformations files"""


@dataclass(frozen=True)
class Comparison:
    """A case before and after a transformation; `reason` says how they differ, "" if they agree."""

    case: str
    transformation: str
    before: Decision
    after: Decision
    reason: str


def main(arguments: Sequence[str] | None = None) -> int:
    """Decide on all cases and print agreements and disagreements; return the exit code."""
    given = _parser().parse_args(arguments)
    wanted = given.transformations.split(",") if given.transformations else None
    some = [one for one in TRANSFORMATIONS if wanted is None or one.name in wanted]
    if wanted and (unknown := set(wanted) - {one.name for one in some}):
        raise SystemExit(f"there is no transformation {', '.join(sorted(unknown))}")
    results = given.results or FOLDER / "invariance" / product_digest()[:16]
    cases = find_cases(given.generators.split(","), given.cases, given.folder)
    found: list[Comparison] = []
    for name, folder in cases.items():
        before = decide_once(results, name, folder, UNCHANGED)
        for one in some:
            after = decide_once(results, name, folder, one)
            if "skipped" not in after:
                found.append(
                    Comparison(name, one.name, before, after, difference(before, after, one))
                )
    print(format_table(some, found))
    print(format_disagreements(found))
    return 0 if all(agreement(one.name, found) >= REQUIRED for one in some) else 1


def find_cases(names: Sequence[str], wanted: str, folder: Path | None) -> dict[str, Path]:
    """Return case folders by GENERATOR/CASE.

    `wanted` is a number of cases of each generator, or names with commas. Without a folder the
    generators write their cases.
    """
    every: dict[str, Path] = {}
    count = int(wanted) if wanted.isdigit() else None
    for generator in names:
        paths = sorted((folder / generator).glob("case_*")) if folder else _written(generator)
        some = {f"{generator}/{path.name}": path for path in paths}
        every |= dict(islice(some.items(), count))
    if count is None:
        every = {name: every[name] for name in wanted.split(",")}
    return every


def _written(name: str) -> list[Path]:
    """Return the cases of a generator that has a spec for each of them, written if needed."""
    generator = next(one for one in generators() if one.name == name)
    if generator.spec != IN_CASE_FOLDER:
        raise SystemExit(f"the cases of {name} have no spec of their own")
    groups = [one for one in generator.groups if one.name in GROUPS]
    found = [generate_cases(generator, one) for one in groups]
    return [cases.folder / case for cases in found for case in cases.known()]


def decide_once(results: Path, name: str, case: Path, transformation: Transformation) -> Decision:
    """Return the stored decision on a transformed case; it is computed if there is none.

    It has the key `skipped` with a reason if the transformation does not apply.
    """
    path = results / transformation.name / f"{name.replace('/', '_')}.json"
    if not path.exists():
        path.parent.mkdir(parents=True, exist_ok=True)
        decision = transform_and_decide(case, transformation)
        path.write_text(json.dumps(decision, indent=1))
        print(f"{name} {transformation.name}: {describe(decision)}", flush=True)
    found: Decision = json.loads(path.read_text())
    return found


def transform_and_decide(case: Path, transformation: Transformation) -> dict[str, Any]:
    """Return the decision on a transformed copy of a case, by a process of its own."""
    with tempfile.TemporaryDirectory(prefix="invariance") as folder:
        copy, result = Path(folder) / "case", Path(folder) / "result.json"
        shutil.copytree(case, copy, ignore=shutil.ignore_patterns("held_out"))
        try:
            transformation.change(copy)
        except NotWritableError as error:
            return {"skipped": str(error)}
        options = ["--reverse-effects"] if transformation.reverses_effects else []
        module = "tests.validation.properties.case_decision"
        done = subprocess.run(
            [sys.executable, "-m", module, str(copy), str(result), *options],
            cwd=ROOT,
            env=os.environ | ENVIRONMENT | dict(transformation.environment),
            capture_output=True,
            text=True,
            timeout=MAX_TIME,
            check=False,
        )
        if not result.exists():
            last = " ".join(done.stderr.strip().splitlines()[-1:])
            return {"outcome": "error", "effects": [], "parameters": {}, "message": last}
        found: dict[str, Any] = json.loads(result.read_text())
        return found


def difference(before: Decision, after: Decision, transformation: Transformation) -> str:
    """Return how two decisions differ, "" if they agree.

    Parameters of the second one are divided by the factors of their units. They agree if they are
    within `INTERVAL_STDS` standard deviations of the first one.
    """
    if before["outcome"] != after["outcome"]:
        return "outcome"
    first, second = (one["effects"][:1] for one in (before, after))
    for key in ("name", "place"):
        if [one[key] for one in first] != [one[key] for one in second]:
            return key
    moved = [
        f"{name} {far:.1f} std"
        for name, far in parameter_shifts(before, after, transformation).items()
        if not abs(far) <= INTERVAL_STDS
    ]
    return ", ".join(moved)


def parameter_shifts(
    before: Decision, after: Decision, transformation: Transformation
) -> dict[str, float]:
    """Return the changes of the parameters that both decisions have, in standard deviations."""
    shifts = {}
    for name, (value, std, unit) in before["parameters"].items():
        if name in after["parameters"]:
            other = after["parameters"][name][0] / transformation.factor_of(unit)
            shifts[name] = (other - value) / std if std else (0.0 if other == value else math.inf)
    return shifts


def agreement(transformation: str, found: Iterable[Comparison]) -> float:
    """Return the part of the cases that agree under a transformation; 0 without any."""
    own = [one.reason == "" for one in found if one.transformation == transformation]
    return sum(own) / len(own) if own else 0.0


def format_table(some: Sequence[Transformation], found: Sequence[Comparison]) -> str:
    """Return the agreements of each transformation as a table of text."""
    lines = ["transformation    agree  verdict  largest shift  gain ratio  about"]
    for one in some:
        own = [each for each in found if each.transformation == one.name]
        same = [
            each for each in own if each.reason.split(" ")[0] not in ("outcome", "name", "place")
        ]
        shifts = [
            abs(far)
            for each in same
            for far in parameter_shifts(each.before, each.after, one).values()
        ]
        ratios = [_gain(each.after) / _gain(each.before) for each in same if _gain(each.before)]
        span = f"{min(ratios):.3f}..{max(ratios):.3f}" if ratios else "-"
        agree = sum(each.reason == "" for each in own)
        lines.append(
            f"{one.name:<16} {f'{agree}/{len(own)}':>6}  {f'{len(same)}/{len(own)}':>7}"
            f"  {max(shifts, default=0.0):9.2f} std  {span:>10}  {one.about}"
        )
    return "\n".join(lines)


def format_disagreements(found: Iterable[Comparison]) -> str:
    """Return the disagreements with both decisions, a line each."""
    lines = [
        f"{one.case} {one.transformation}: {one.reason}\n"
        f"  before: {describe(one.before)}\n  after:  {describe(one.after)}"
        for one in found
        if one.reason
    ]
    return "\n".join(lines) or "no disagreement"


def describe(decision: Decision) -> str:
    """Return outcome, effects with gains, and the best candidates in words."""
    if "skipped" in decision:
        return f"skipped, {decision['skipped']}"
    effects, best = (
        ", ".join(f"{one['name']}@{one['place']} {one['gain']:.0f}" for one in some)
        for some in (decision["effects"], decision.get("candidates", [])[:3])
    )
    more = decision.get("message") or f"{decision['cpu_s']:.0f} s, energy {decision['energy']:.3g}"
    return f"{decision['outcome']} {effects} | {best} | {more}"


def _gain(decision: Decision) -> float:
    """Return the gain [nats] of the best candidate; 0 without any."""
    best = decision.get("candidates", [])[:1]
    return float(best[0]["gain"]) if best else 0.0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m tests.validation.properties.invariance",
        description=__doc__,
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--generators", default="servo_axis,relay_plants", help="with commas")
    parser.add_argument("--cases", default="20", help="of each generator, or names with commas")
    parser.add_argument("--transformations", help="some, with commas (all)")
    parser.add_argument("--folder", type=Path, help="with GENERATOR/CASE (written by generators)")
    parser.add_argument("--results", type=Path, help="folder of decisions (build/validation)")
    return parser


if __name__ == "__main__":
    sys.exit(main())
