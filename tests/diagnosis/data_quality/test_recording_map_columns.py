"""A map beside a spec: what keeps recordings from being compared is told with its line."""

from __future__ import annotations

from pathlib import Path

import pytest

from language.loading.recording_map_columns import check_pairing
from language.loading.recording_map_reader import read_map
from language.overlays.expand_document import Project
from language.text.diagnostic import Problems, Source
from language.text.project_files import parse_document
from tests.diagnosis.small_driveline import MAP, driveline

WHEEL = "  wheel:  {compare: w_w, unit: rad/s, blank: skip}\n"


def told(text: str) -> list[str]:
    """Return kind, line and label of what does not fit between a map and the small driveline."""
    problems = Problems()
    mapping = read_map(
        parse_document(Source("bench.yaml", tuple(text.splitlines())), text), Project(Path())
    )
    check_pairing(driveline(), mapping, problems)
    return [f"{p.code} {p.kind} {p.span.line}: {p.label}" for p in problems.reported]


def test_a_map_that_fits_has_no_problem() -> None:
    assert WHEEL in MAP
    assert told(MAP) == []
    assert told(MAP.replace("  brake:  {to: T_br, unit: N*m, blank: skip}\n", "")) == []


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        (
            "to: T_em,",
            "to: T_emm,",
            [
                "MW112 missing 2: map `bench` gives no value for input `T_em` of `small_driveline`",
                "MW115 name 5: `T_emm` is not an input of `small_driveline`",
            ],
        ),
        (
            "compare: w_w",
            "compare: w_d",
            ["MW115 name 8: `w_d` is not an output of `small_driveline`"],
        ),
        (
            "compare: w_w",
            "compare: w_em",
            ["MW109 duplicate 8: output `w_em` is compared with `motor` already"],
        ),
        ("to: T_br", "to: T_em", ["MW109 duplicate 6: input `T_em` is fed twice"]),
        (
            "to: T_br, unit: N*m",
            "to: T_br, unit: rad/s",
            ["MW305 dimension 6: column `brake` is in `rad/s`"],
        ),
        (
            "compare: w_w, unit: rad/s",
            "compare: w_w, unit: m",
            ["MW305 dimension 8: column `wheel` is in `m`"],
        ),
    ],
)
def test_what_does_not_fit_is_told_with_its_line(old: str, new: str, expected: list[str]) -> None:
    assert old in MAP
    assert told(MAP.replace(old, new)) == expected


def test_a_map_that_compares_nothing_is_told() -> None:
    rest = MAP.replace(WHEEL, "").replace(
        "  motor:  {compare: w_em, unit: rad/s, blank: skip}\n", ""
    )
    label = "map `bench` compares no output of `small_driveline`"
    assert told(rest) == [f"MW112 missing 2: {label}"]
