"""Page: docs/validation.md, from the answers of a study."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import yaml
from jinja2 import Environment, StrictUndefined

from tests.validation.evidence.evidence_store import ROOT
from tests.validation.study.accepted_names import TABLE, right_names
from tests.validation.study.case_score import Answer
from tests.validation.study.decision_constants import decision_constants
from tests.validation.study.figures import FIGURES, measure
from tests.validation.study.generator_table import Generator
from tests.validation.study.proportion import rate_of
from tests.validation.study.real_machines import stored_results
from tests.validation.study.result_store import product_digest
from tests.validation.study.simpler_methods import compare_methods

PAGE = ROOT / "docs" / "validation.md"
GROUP_WORDS = {
    "full": "one effect",
    "clean": "no effect",
    "weak": "one effect, 0.3 x strength",
    "pairs": "two effects",
    "removed": "one effect that is not in the library",
}


def write_page(
    answers: Sequence[Answer],
    every: Sequence[Generator],
    digests: Mapping[str, str],
    path: Path = PAGE,
    is_current: bool = True,
) -> None:
    """Write the page to a file; `is_current` tells whether the answers are of the present code."""
    path.write_text(render_page(answers, every, digests, is_current), encoding="utf-8")


def render_page(
    answers: Sequence[Answer],
    every: Sequence[Generator],
    digests: Mapping[str, str],
    is_current: bool = True,
) -> str:
    """Return the page; `digests` are those of the labels, by `generator/group`."""
    template = Path(__file__).with_name("validation.md.jinja").read_text("utf-8")
    shown = Environment(undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    machines = stored_results()
    return shown.from_string(template).render(
        generators=every,
        names=[one.name for one in every],
        groups=_groups(answers, every, digests),
        figures=[measure(figure, answers) for figure in FIGURES],
        strict=[measure(figure, answers, True) for figure in FIGURES if figure.has_names],
        effects=_effects(answers, every, "full"),
        weak=_effects(answers, every, "weak"),
        wrong=_wrong(answers),
        methods=compare_methods(answers),
        accepted=_accepted(),
        machines=machines,
        is_current=is_current,
        are_machines_current=all(one["code"] == product_digest() for one in machines),
        constants=decision_constants(),
    )


def _groups(
    answers: Sequence[Answer], every: Sequence[Generator], digests: Mapping[str, str]
) -> list[dict[str, Any]]:
    """Return a row for each group: cases by generator, and the digests of their labels."""
    counts = Counter(f"{one.generator}/{one.group}" for one in answers)
    return [
        {
            "name": name,
            "about": words,
            "counts": [counts[f"{one.name}/{name}"] for one in every],
            "digests": [digests.get(f"{one.name}/{name}", "")[:8] for one in every],
        }
        for name, words in GROUP_WORDS.items()
    ]


def _effects(
    answers: Sequence[Answer], every: Sequence[Generator], group: str
) -> list[dict[str, Any]]:
    """Return a row for each effect: how often each generator's cases are named rightly."""
    some = [one for one in answers if one.group == group]
    rows = []
    for effect in sorted({one.true for one in some}):
        own = [one for one in some if one.true == effect]
        rates = [rate_of(a.is_named() for a in own if a.generator == one.name) for one in every]
        rows.append(
            {"name": effect, "cells": [f"{r.hits} of {r.count}" if r.count else "" for r in rates]}
        )
    return rows


def _wrong(answers: Sequence[Answer]) -> list[dict[str, str]]:
    """Return a row for each generator, group and effect: the wrong verdicts with their counts."""
    found: dict[tuple[str, str, str], list[Answer]] = {}
    for one in answers:
        if _is_wrong(one):
            found.setdefault((one.generator, one.group, one.true), []).append(one)
    return [
        {"generator": key[0], "group": key[1], "true": key[2], "said": _verdicts(some)}
        for key, some in sorted(found.items())
    ]


def _verdicts(some: Sequence[Answer]) -> str:
    """Return the verdicts of cases in words, the most frequent one first."""
    counts = Counter("+".join(one.named) or one.said for one in some)
    return ", ".join(f"{name}{f' ({n})' if n > 1 else ''}" for name, n in counts.most_common())


def _is_wrong(one: Answer) -> bool:
    """Return whether a verdict counts as wrong in the figure of its group."""
    if one.group == "clean":
        return one.is_alarm
    if one.group == "removed":
        return not one.is_unknown()
    return not (one.are_all_named() if one.group == "pairs" else one.is_named())


def _accepted() -> list[dict[str, str]]:
    """Return the labels for which other names are right as well."""
    table: dict[str, dict[str, Any]] = yaml.safe_load(TABLE.read_text("utf-8"))["accepted"]
    return [
        {"generator": name, "label": label, "names": ", ".join(sorted(right_names(name, label)))}
        for name, labels in table.items()
        for label in labels
    ]
