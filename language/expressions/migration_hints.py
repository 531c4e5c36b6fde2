"""Migration hints: keys and functions of other statechart tools, and their form here."""

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
"""Keys of other tools with the keys they may correspond to.

The first one allowed at the place counts.
"""
ROOT_KEYS = ("discrete", "inputs", "outputs", "parameters", "events", "tables", "period")
DISCRETE_HINT = (
    "declare a retained variable once, at the root: `discrete: {k: {type: int, initial: 0}}`"
)
MODE_TYPE_HINT = (
    "a mode has no type: one of its `modes` is active, its `regions` are active in parallel; "
)
MODE_TYPE_HINT += "instead of a junction, write the whole guard on each transition"
KEY_HINTS: Mapping[str, str] = {
    **dict.fromkeys(ROOT_KEYS, "write it at the root of the automaton, for all modes"),
    **dict.fromkeys(("data", "local", "locals", "variables", "vars"), DISCRETE_HINT),
    **dict.fromkeys(("type", "decomposition", "junction", "junctions"), MODE_TYPE_HINT),
    "on": "name the event on a transition: `transitions: {x: {event: x, to: []}}`",
}
"""Keys that users write inside a mode, each with the help text for it."""
ASSIGNMENT_PATTERN = re.compile(r"([A-Za-z]\w*)\s*=\s*([^=;,]+)")
INCREMENT_PATTERN = re.compile(r"([A-Za-z]\w*)?\s*(\+\+|--|[-+*/]=)")
DECLARATION_KEY_PATTERN = re.compile(
    r"(inputs|parameters|states|discrete)\.(unit|range|value|initial|default|type|tunable|values)"
)
"""Path of a key of a declaration that stands beside the declarations."""
EVENT_WITH_GUARD_PATTERN = re.compile(r"(\w+)\s*\[(.*)\]")
FUNCTION_HINTS: Mapping[str, str] = {
    "duration": "write `wait: 5 s` on the transition: how long its guard has to hold",
    "elapsed": "`after(5 s)` is a condition: 5 s since the mode was entered",
    "temporalCount": "`after(5 s)` is a condition: 5 s since the mode was entered",
    "before": "`not after(5 s)` is true until 5 s since the mode was entered",
    "hasChanged": "`changed(x)` is true if x differs from its value at the tick before",
    "crossing": "`rising(g)` or `falling(g)`: where a condition becomes true or false",
    "edge": "`rising(g)` or `falling(g)`: where a condition becomes true or false",
    "ln": "`log(x)` is the natural logarithm",
    "log10": "`log(x) / log(10)`",
    "log2": "`log(x) / log(2)`",
    "power": "`x^2` for a whole power, else `pow(x, 2.5)`",
    **dict.fromkeys(("atan", "arctan"), "`atan2(y, x)`: of a number x it is `atan2(x, 1)`"),
    **dict.fromkeys(("asin", "arcsin"), "of a number x it is `atan2(x, sqrt(1 - x^2))`"),
    **dict.fromkeys(("acos", "arccos"), "of a number x it is `atan2(sqrt(1 - x^2), x)`"),
    "sinh": "`(exp(x) - exp(-x)) / 2`",
    "cosh": "`(exp(x) + exp(-x)) / 2`",
    "hypot": "`sqrt(x^2 + y^2)`",
    "ceil": "`-floor(-x)`",
    "round": "`floor(x + 0.5)`",
    **dict.fromkeys(("mod", "fmod", "rem"), "`x - m * floor(x / m)`"),
    **dict.fromkeys(("saturate", "sat", "limit", "clamp"), "`clip(x, low, high)`"),
    **dict.fromkeys(("sgn", "signum"), "`sign(x)`"),
    "fabs": "`abs(x)`",
    "send": "events are raised by a transition: `raise: name`",
}
"""Functions of other tools, each with the help text for it."""


def key_alias_hint(word: str, known_keys: Collection[str]) -> str:
    """Return "did you mean `x`?" for a key of another tool.

    x is the first of the keys in KEY_ALIASES for the word that is among `known_keys`. The text is
    empty if there is none.
    """
    alias = next((key for key in KEY_ALIASES.get(word, ()) if key in known_keys), "")
    return f"did you mean `{alias}`?" if alias else ""


def key_hint(key: str, what: str) -> str:
    """Return the help text for a key that is not allowed at `what`, the key path; empty if unknown.

    Known are `on x` and `on_x` at any place, `priority` of a region at the root, `range` of an
    input of a system or a scenario, and the keys of KEY_HINTS below `modes.` or `regions.`.
    """
    event_key = re.fullmatch(r"on[ _](\w+)", key)
    if event_key:
        name = event_key.group(1)
        return (
            f"name the event on a transition: `transitions: {{{name}: {{event: {name}, to: []}}}}`"
        )
    if key == "priority" and re.fullmatch(r"regions\.\w+", what):
        return "regions at the root are never left: those inside a mode have a priority"
    if key == "range" and re.fullmatch(r"inputs\.\w+", what):
        return "the range belongs to the input of the automaton that reads it"
    return KEY_HINTS.get(key, "") if re.match(r"(.*\.)?(modes|regions)\.", what) else ""


def mapping_hint(node: YamlNode, what: str) -> str:
    """Return the help text for a text or list where a mapping is needed; empty if none is known.

    A key like `inputs.range` gets the help text to indent it. If `what`, the key path, ends with
    `transitions` or a name below it, the text is an example of a transition. Else assignments like
    `k = 1` in the text, or in the items of the list, are shown as a mapping: "it is written
    `{k: 1}`".
    """
    if DECLARATION_KEY_PATTERN.fullmatch(what):
        section, _, key = what.partition(".")
        return f"`{key}` is a key of one of the `{section}`: indent it below its name"
    if what.endswith("transitions"):
        return "each has a name: `transitions: {fault: {to: fault, when: ...}}`"
    if re.search(r"transitions\.\w+$", what):
        return "like `{event: go, when: a, reset: {k: 1}}`"
    items = node.nodes if isinstance(node, SequenceNode) else (node,)
    text = ";".join(item.text for item in items if isinstance(item, ScalarNode))
    assignments = ASSIGNMENT_PATTERN.findall(text)
    parts = ", ".join(f"{name}: {value.strip()}" for name, value in assignments)
    return f"it is written `{{{parts}}}`" if parts else ""


def increment_hint(text: str) -> str:
    """Return the help text for a text that contains `k++`, `k--`, `k += 2` or the like; else empty.

    It is "write the whole new value: `k: k + 2`", or without a name before the sign a general
    example.
    """
    match = INCREMENT_PATTERN.search(text)
    if not match:
        return ""
    name, sign = match.group(1), match.group(2)
    rest = text[match.end() :].strip() or "1"
    written = f": `{name}: {name} {sign[0]} {rest}`" if name else ", like `k: k + 1`"
    return f"write the whole new value{written}"


def event_guard_hint(text: str, events: Collection[str]) -> str:
    """Return the help text for an event with its guard in brackets, `go [a]`; else empty.

    The name before the brackets has to be one of `events`. The text shows the keys `event` and
    `when`.
    """
    match = EVENT_WITH_GUARD_PATTERN.fullmatch(text)
    if not match or match.group(1) not in events:
        return ""
    return f"write the guard as a key of its own: `event: {match.group(1)}, when: {match.group(2)}`"
