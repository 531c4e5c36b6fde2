"""Words of other statechart tools: each means a key that there is, where that has a place."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from language.expressions.migration_hints import KEY_ALIASES, key_alias_hint

SCHEMA = Path(__file__).parents[3] / "spec" / "modewright.schema.json"


@pytest.mark.parametrize("word", KEY_ALIASES)
def test_every_word_means_a_key_that_there_is(word: str) -> None:
    keys = json.dumps(json.loads(SCHEMA.read_text()))
    for meant in KEY_ALIASES[word]:
        assert f'"{meant}":' in keys
        assert key_alias_hint(word, {meant, "about"}) == f"did you mean `{meant}`?"
    assert key_alias_hint(word, {"about"}) == ""
