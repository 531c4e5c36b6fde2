"""Accepted names: names of a verdict that count as right for a label, and nearest relatives."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache
from pathlib import Path
from typing import Any

import yaml

TABLE = Path(__file__).with_name("accepted_names.yaml")


@cache
def _table() -> dict[str, Any]:
    """Return the content of the table."""
    found: dict[str, Any] = yaml.safe_load(TABLE.read_text("utf-8"))
    return found


def right_names(generator: str, effect: str, is_strict: bool = False) -> frozenset[str]:
    """Return the names that are right for an effect of a label; only its own one if `is_strict`."""
    others = _table()["accepted"].get(generator, {}).get(effect, ())
    return frozenset((effect,) if is_strict else (effect, *others))


def relatives_of(names: Iterable[str]) -> frozenset[str]:
    """Return the nearest relatives of names, without these names."""
    given = frozenset(names)
    groups = [group for group in _table()["relatives"] if given & set(group)]
    return frozenset(name for group in groups for name in group) - given
