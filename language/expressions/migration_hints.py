"""Aliases: words of other tools for statecharts, and what they are here."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping

from language.text.document import ScalarNode, SequenceNode, YamlNode

KEY_ALIASES: Mapping[str, tuple[str, ...]] = {
    "en": ("entry",),
    "du": ("update",),
    "during": ("update",),
    "do": ("update",),
    "ex": ("exit",),
    "action": ("reset", "update"),
    "actions": ("reset", "update"),
    "condition_action": ("reset",),
    "transition_action": ("reset",),
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
    "states": ("modes",),
    "default": ("initial",),
}
"""Keys, each with what it may mean: the first that has a place counts."""
ROOT_KEYS = ("discrete", "inputs", "outputs", "parameters", "events", "tables", "period")
DISCRETE_HINT = (
    "what is kept is declared once, at the root: `discrete: {k: {type: int, initial: 0}}`"
)
MODE_TYPE_HINT = "a mode has no type: `modes` inside take turns, `regions` run side by side; "
MODE_TYPE_HINT += "in place of a junction each transition has the whole guard"
KEY_HINTS: Mapping[str, str] = {
    **dict.fromkeys(ROOT_KEYS, "it stands at the root of the automaton, for all modes"),
    **dict.fromkeys(("data", "local", "locals", "variables", "vars"), DISCRETE_HINT),
    **dict.fromkeys(("type", "decomposition", "junction", "junctions"), MODE_TYPE_HINT),
    "on": "a transition hears an event: `transitions: {x: {event: x, to: []}}`",
}
"""Keys that people write in a mode, and what is written here."""
ASSIGNMENT_PATTERN = re.compile(r"([A-Za-z]\w*)\s*=\s*([^=;,]+)")
INCREMENT_PATTERN = re.compile(r"([A-Za-z]\w*)?\s*(\+\+|--|[-+*/]=)")
EVENT_WITH_GUARD_PATTERN = re.compile(r"(\w+)\s*\[(.*)\]")
FUNCTION_HINTS: Mapping[str, str] = {
    "duration": "write `wait: 5 s` on the transition: how long its guard has to hold",
    "elapsed": "`after(5 s)` is a condition: 5 s since the mode was entered",
    "temporalCount": "`after(5 s)` is a condition: 5 s since the mode was entered",
    "before": "`not after(5 s)` is what holds before",
    "hasChanged": "`changed(x)`: what is inside is another value than a tick before",
    "crossing": "`rising(g)` or `falling(g)`: where a condition turns",
    "edge": "`rising(g)` or `falling(g)`: where a condition turns",
    "ln": "`log(x)` is the natural logarithm",
    "log10": "`log(x) / log(10)`",
    "log2": "`log(x) / log(2)`",
    "power": "`x^2` for a whole power, else `pow(x, 2.5)`",
    "atan": "`atan2(y, x)`: of a number x it is `atan2(x, 1)`",
    "send": "events are raised by a transition: `raise: name`",
}
"""Functions, each with what is written here."""


def key_alias_hint(word: str, known_keys: Collection[str]) -> str:
    """Return "did you mean `x`?" for a key of another tool, or an empty text."""
    found = next((key for key in KEY_ALIASES.get(word, ()) if key in known_keys), "")
    return f"did you mean `{found}`?" if found else ""


def key_hint(key: str, what: str) -> str:
    """Return what is written in place of a key of a mode, an empty text where nothing is known."""
    event_key = re.fullmatch(r"on[ _](\w+)", key)
    if event_key:
        name = event_key.group(1)
        return f"a transition hears an event: `transitions: {{{name}: {{event: {name}, to: []}}}}`"
    if key == "priority" and re.fullmatch(r"regions\.\w+", what):
        return "regions at the root are never left: those inside a mode have a priority"
    return KEY_HINTS.get(key, "") if re.match(r"(.*\.)?(modes|regions)\.", what) else ""


def mapping_hint(node: YamlNode, what: str) -> str:
    """Return how what is written as a text or list is written as a mapping, if that is known."""
    if what.endswith("transitions"):
        return "each has a name: `transitions: {fault: {to: fault, when: ...}}`"
    if re.search(r"transitions\.\w+$", what):
        return "like `{event: go, when: a, reset: {k: 1}}`"
    items = node.nodes if isinstance(node, SequenceNode) else (node,)
    text = ";".join(item.text for item in items if isinstance(item, ScalarNode))
    found = ASSIGNMENT_PATTERN.findall(text)
    parts = ", ".join(f"{name}: {value.strip()}" for name, value in found)
    return f"it is written `{{{parts}}}`" if parts else ""


def increment_hint(text: str) -> str:
    """Return what is written in place of `k++` and `k += 2`, an empty text for other texts."""
    match = INCREMENT_PATTERN.search(text)
    if not match:
        return ""
    name, sign = match.group(1), match.group(2)
    rest = text[match.end() :].strip() or "1"
    written = f": `{name}: {name} {sign[0]} {rest}`" if name else ", like `k: k + 1`"
    return f"the new value is written whole{written}"


def event_guard_hint(text: str, events: Collection[str]) -> str:
    """Return what is written in place of the event `go [a]`, an empty text for other texts."""
    match = EVENT_WITH_GUARD_PATTERN.fullmatch(text)
    if not match or match.group(1) not in events:
        return ""
    return f"a guard stands beside it: `event: {match.group(1)}, when: {match.group(2)}`"
