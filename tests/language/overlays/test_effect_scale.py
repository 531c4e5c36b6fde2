"""Numbers of effects as multiples of a magnitude: absolute with recordings, or by a given value."""

from __future__ import annotations

from fractions import Fraction

import pytest

from language.overlays.effect_reader import read_effect
from language.overlays.effect_scale import scale_parameters
from language.text.diagnostic import Problems, Source, Span, SpecError
from language.text.document import Entry, MappingNode, ScalarNode
from language.text.node_edit import format_inline
from language.text.project_files import parse_document

EFFECT = """\
language: 1
effect: friction
at: {balance: {of: rate}}
parameters:
  T_c: {value: 0.05, unit: $force, scale: SCALE, range: [0, 5], neutral: 0, starts: [0.01, 0.1]}
terms: {$x: {friction: -T_c}}
"""


def body_of(scale: str, text: str = EFFECT) -> MappingNode:
    text = text.replace("SCALE", scale)
    document = parse_document(Source("friction.yaml", tuple(text.splitlines())), text)
    problems = Problems()
    effect = read_effect(document, problems)
    problems.raise_if_errors()
    return effect.body


def scaled(scale: str, scales: dict[str, Fraction], given: str | None = None) -> dict[str, str]:
    span = Span(Source("variant"), 1, 1)
    values = {"T_c": Entry("T_c", span, ScalarNode(given, span))} if given else {}
    table = scale_parameters(body_of(scale), scales, values).get("parameters")
    assert isinstance(table, MappingNode)
    node = table.get("T_c")
    assert isinstance(node, MappingNode)
    return {entry.key: format_inline(entry.node) for entry in node}


def test_numbers_are_multiples_of_the_magnitude_and_the_key_is_gone() -> None:
    found = scaled("load", {"load": Fraction(30)})
    assert found == {
        "value": "1.5",
        "unit": "$force",
        "range": "[0, 150]",
        "neutral": "0",
        "starts": "[0.3, 3]",
    }


def test_a_scale_can_be_a_product_of_powers() -> None:
    scales = {"inertia": Fraction(2), "time": Fraction(1, 10)}
    assert scaled("inertia / time^2", scales)["value"] == "10"


def test_a_given_value_sets_the_magnitude() -> None:
    """0.05 of the magnitude are 2 N*m, so the range ends at 5 times 40 N*m."""
    assert scaled("load", {"load": Fraction(30)}, "2 N*m")["range"] == "[0, 200]"
    assert scaled("load", {}, "0.002 kN*m")["range"] == "[0, 200]"


def test_without_recordings_and_value_the_magnitude_is_1_and_there_is_no_range() -> None:
    found = scaled("load", {})
    assert found["value"] == "0.05"
    assert "range" not in found


@pytest.mark.parametrize(
    ("scale", "text", "label"),
    [
        ("loud", EFFECT, "`loud` is no magnitude of a place"),
        ("load + rate", EFFECT, "a product of magnitudes"),
        ("load", EFFECT.replace("value: 0.05", "value: 2 N*m"), "without a unit"),
    ],
)
def test_a_wrong_scale_is_refused(scale: str, text: str, label: str) -> None:
    with pytest.raises(SpecError) as caught:
        body_of(scale, text)
    assert any(label in problem.label for problem in caught.value.problems)
