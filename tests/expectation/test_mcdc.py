"""Which conditions of a guard were shown to matter, against pairs found by hand and by search."""

from __future__ import annotations

import itertools
import random
from pathlib import Path

import pytest

from expectation.mcdc import Decision, decision_of
from language.loading.load import load_automaton
from language.overlays.expand_document import Project
from tests.expectation.latch_project import AUTOMATON

A, B, C, D = 1, 2, 4, 8
TWO_PAIRS = "a and b or c and d"


def decision(tmp_path: Path, guard: str) -> Decision:
    inputs = ", ".join(f"{name}: {{type: bool}}" for name in "abcd")
    text = AUTOMATON.replace("{level:", f"{{{inputs}, level:")
    text = text.replace("level > 1 V", guard)
    (tmp_path / "latch.yaml").write_text(text)
    automaton = load_automaton(str(tmp_path / "latch.yaml"), Project(tmp_path))
    return decision_of(automaton.modes["low"].transitions[0])


@pytest.mark.parametrize(
    ("guard", "seen", "shown"),
    [
        ("a and b", [A | B, A, B], ["unique cause", "unique cause"]),
        ("a and b", [A | B, 0], ["not shown", "not shown"]),
        ("a and b", [A | B, A], ["always true", "unique cause"]),
        ("a or b", [0, A], ["unique cause", "always false"]),
        ("not (a or b)", [0, A, B], ["unique cause", "unique cause"]),
        ("a and b", [], ["always false", "always false"]),
        (TWO_PAIRS, [A | B | D, B | C], ["masking", "always true", "not shown", "not shown"]),
        (TWO_PAIRS, [A | B | D, B | D], ["unique cause", "always true", "always false",
                                         "always true"]),
        ("a and (b or a)", [A, 0, A | B, B], ["unique cause", "not shown"]),
        ("level > 1 V", [0, 1], ["unique cause"]),
        ("true", [0], []),
    ],
)  # fmt: skip
def test_a_condition_counts_if_a_pair_shows_it(
    tmp_path: Path, guard: str, seen: list[int], shown: list[str]
) -> None:
    assert list(decision(tmp_path, guard).condition_coverage(seen)) == shown


def test_conditions_are_told_as_they_are_written(tmp_path: Path) -> None:
    found = decision(tmp_path, "not a and (level > 1 V or level  <  -0.5 V)")
    assert found.conditions == ("a", "level > 1 V", "level  <  -0.5 V")
    assert found.key == "modes.low.transitions.high"
    assert [found.outcome(k) for k in range(8)] == [False, False, True, False, True, False, True,
                                                    False]  # fmt: skip


def test_unique_cause_is_what_a_search_over_all_pairs_finds(tmp_path: Path) -> None:
    chance = random.Random(7)
    found = decision(tmp_path, "(a or not b) and (c or b and d)")
    for _ in range(200):
        seen = chance.sample(range(16), chance.randint(0, 8))
        pairs = list(itertools.combinations(seen, 2))
        for k, shown in enumerate(found.condition_coverage(seen)):
            alone = any(v ^ w == 1 << k and found.outcome(v) != found.outcome(w) for v, w in pairs)
            assert (shown == "unique cause") == alone
