"""Aliases: words of other tools for statecharts, and what they are here."""

from __future__ import annotations

from collections.abc import Collection, Mapping

KEYS: Mapping[str, tuple[str, ...]] = {
    "en": ("entry",),
    "du": ("update",),
    "during": ("update",),
    "do": ("update",),
    "ex": ("exit",),
    "action": ("reset", "update"),
    "actions": ("reset", "update"),
    "entry": ("reset",),
    "guard": ("when",),
    "condition": ("when",),
    "on": ("event",),
    "trigger": ("event",),
    "send": ("raise",),
    "emit": ("raise",),
    "target": ("to",),
    "sample_time": ("period",),
    "parallel": ("regions",),
    "invariants": ("invariant",),
}
"""Keys, each with what it may mean: the first that has a place counts."""
FUNCTIONS: Mapping[str, str] = {
    "duration": "write `wait: 5 s` on the transition: how long its guard has to hold",
    "elapsed": "`after(5 s)` is a condition: 5 s since the mode was entered",
    "temporalCount": "`after(5 s)` is a condition: 5 s since the mode was entered",
    "before": "`not after(5 s)` is what holds before",
    "hasChanged": "`changed(x)`: what is inside is another value than a tick before",
    "crossing": "`rising(g)` or `falling(g)`: where a condition turns",
    "edge": "`rising(g)` or `falling(g)`: where a condition turns",
    "send": "events are raised by a transition: `raise: name`",
}
"""Functions, each with what is written here."""


def known_as(word: str, known: Collection[str]) -> str:
    """Return "did you mean `x`?" for a key of another tool, or an empty text."""
    found = next((key for key in KEYS.get(word, ()) if key in known), "")
    return f"did you mean `{found}`?" if found else ""
