"""Page: docs/proof.md, written from the answers of a study."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from jinja2 import Environment, StrictUndefined

from tests.validation.blind_study.acceptance_criteria import Bar, by_effect
from tests.validation.blind_study.case_score import Answer
from tests.validation.blind_study.proportion import Rate, rate_of
from tests.validation.blind_study.result_plots import draw
from tests.validation.evidence.evidence_store import ROOT

PAGE = ROOT / "docs" / "proof.md"
FOLDER = ROOT / "docs" / "proof"


def write_page(
    every: Sequence[Answer], found: Sequence[Bar], seals: Mapping[str, Any], beside: Sequence[str]
) -> None:
    """Write the page with its figures and figures of evidence."""
    draw(every, FOLDER)
    PAGE.write_text(page(every, found, seals, beside), encoding="utf-8")


def page(
    every: Sequence[Answer], found: Sequence[Bar], seals: Mapping[str, Any], beside: Sequence[str]
) -> str:
    """Return the page; `beside` are lines on controls and simpler methods."""
    template = Path(__file__).with_name("proof.md.jinja").read_text("utf-8")
    shown = Environment(undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    full, weak = ([one for one in every if one.plan == name] for name in ("full", "weak"))
    return shown.from_string(template).render(
        seals=seals,
        bars=found,
        effects=_effects(full, weak),
        rates=_rates(full),
        counts={name: sum(one.plan == name for one in every) for name in _plans(every)},
        beside=beside,
    )


def _plans(every: Sequence[Answer]) -> list[str]:
    return list(dict.fromkeys(one.plan for one in every))


def _effects(full: Sequence[Answer], weak: Sequence[Answer]) -> list[dict[str, Any]]:
    """Return a row for each effect: how often it is named, as it is and weak, and for what else."""
    small = by_effect(weak)
    rows = []
    for name, rate in by_effect(full).items():
        own = [one for one in full if one.true == name]
        other = sorted({one.said for one in own if not one.is_named})
        row = {
            "name": name,
            "full": _cell(rate),
            "weak": _cell(small.get(name, Rate(0, 0))),
            "placed": _cell(rate_of(one.is_placed() for one in own)),
            "other": ", ".join(word.replace("_", " ") for word in other),
        }
        rows.append(row)
    return rows


def _rates(full: Sequence[Answer]) -> list[tuple[int, str]]:
    """Return how often the first name is right at each sampling rate [Hz]."""
    known = sorted({one.label["rate_Hz"] for one in full})
    return [
        (rate, rate_of(one.is_named for one in full if one.label["rate_Hz"] == rate).text)
        for rate in known
    ]


def _cell(rate: Rate) -> str:
    return f"{rate.hits} of {rate.count}" if rate.count else ""
