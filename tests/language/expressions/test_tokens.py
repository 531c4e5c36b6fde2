"""Keywords have one list; the grammar has the same words."""

from __future__ import annotations

import re
from importlib import resources

from language.expressions.tokens import KEYWORDS


def test_the_grammar_has_the_keywords() -> None:
    grammar = resources.files("language.expressions").joinpath("expression.lark").read_text("utf-8")
    rules = re.sub(r"//.*|/(?:\\.|[^/\n])*/\w*", "", grammar)
    assert set(re.findall(r'"([a-z]+)"', rules)) == set(KEYWORDS)
