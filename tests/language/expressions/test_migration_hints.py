"""Words of other statechart tools: each means a key that there is, where that has a place."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from pathlib import Path

import pytest

from language.expressions.migration_hints import FUNCTION_HINTS, KEY_ALIASES, key_alias_hint
from language.ir.ops import Ref
from language.lowering.expressions import lower_expression
from language.numerics.evaluate import evaluate
from tests.language.spec_builders import tree

SCHEMA = Path(__file__).parents[3] / "spec" / "modewright.schema.json"


@pytest.mark.parametrize("word", KEY_ALIASES)
def test_every_word_means_a_key_that_there_is(word: str) -> None:
    keys = json.dumps(json.loads(SCHEMA.read_text()))
    for meant in KEY_ALIASES[word]:
        assert f'"{meant}":' in keys
        assert key_alias_hint(word, {meant, "about"}) == f"did you mean `{meant}`?"
    assert key_alias_hint(word, {"about"}) == ""


@pytest.mark.parametrize(
    ("name", "function"),
    [
        ("asin", math.asin),
        ("arccos", math.acos),
        ("atan", math.atan),
        ("sinh", math.sinh),
        ("cosh", math.cosh),
        ("ceil", math.ceil),
        ("log10", math.log10),
        ("fabs", abs),
    ],
)
def test_the_formula_for_a_function_of_other_languages(
    name: str, function: Callable[[float], float]
) -> None:
    formula = FUNCTION_HINTS[name].split("`")[-2]
    value = evaluate(lower_expression(tree(formula), {"x": Ref("x")}), {"x": 0.3})
    assert value == pytest.approx(function(0.3), rel=1e-12)
