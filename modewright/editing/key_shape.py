"""Shape: what keys a mapping of a spec may have, what each holds and means; read from shapes/.

The readers of the language name the keys that they know themselves; a test holds both equal.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

from language.text.diagnostic import Source
from language.text.document import MappingNode, ScalarNode, SequenceNode, lines_of
from language.text.node_edit import entries
from language.text.yaml_parser import parse_yaml

VALUE_TYPES = ("name", "text", "literal", "expression", "balance", "unit", "whole", "truth")
"""What a single value may be."""


@dataclass(frozen=True)
class Value:
    """A single value: one of WORDS; of a name, what it names (`mode`), empty for a new name."""

    type: str
    target: str = ""


@dataclass(frozen=True)
class Choice:
    """One of some words."""

    words: tuple[str, ...]


@dataclass(frozen=True)
class ListOf:
    """A list."""

    item: ValueKind


@dataclass(frozen=True)
class MappingOf:
    """A mapping with free keys: new names (`named`), or names of something else, times ..."""

    item: ValueKind
    has_new_names: bool


@dataclass(frozen=True)
class ShapeRef:
    """A mapping with known keys: the name of its shape."""

    shape: str


@dataclass(frozen=True)
class Either:
    """One of several."""

    kinds: tuple[ValueKind, ...]


ValueKind = Value | Choice | ListOf | MappingOf | ShapeRef | Either


@dataclass(frozen=True)
class Key:
    """A key: what it holds and what it means."""

    name: str
    kind: ValueKind
    about: str


@dataclass(frozen=True)
class Shape:
    """A mapping with known keys, or (`either`) one of several others.

    `needs` must be there, `when` says by which words it is told from others, `over` are the kinds
    of files whose keys it may have too.
    """

    name: str
    about: str
    keys: Mapping[str, Key]
    required: tuple[str, ...] = ()
    discriminators: tuple[tuple[str, str], ...] = ()
    alternatives: tuple[str, ...] = ()
    overlay_kinds: tuple[str, ...] = ()


COMMON_KEYS = (
    Key("about", Value("text"), "what this is, in words"),
    Key("req", Either((Value("text"), ListOf(Value("text")))), "the requirements that it meets"),
)
"""Keys that go on anything and have no influence."""


@cache
def shapes() -> Mapping[str, Shape]:
    """Return all shapes by name; that of a kind of file has its name."""
    folder = files("modewright.editing") / "key_shapes"
    found: dict[str, Shape] = {}
    for file in sorted(folder.iterdir(), key=lambda file: file.name):
        if file.name.endswith(".yaml"):
            text = file.read_text("utf-8")
            for entry in parse_yaml(Source(file.name, lines_of(text)), text):
                assert isinstance(entry.node, MappingNode)
                found[entry.key] = _read_shape(entry.key, entry.node)
    return found


def _read_shape(name: str, body: MappingNode) -> Shape:
    keys = [_parse_key(key, text) for key, text in _read_texts(body, "keys")]
    about = body.get("about")
    return Shape(
        name=name,
        about=about.text if isinstance(about, ScalarNode) else "",
        keys={key.name: key for key in (*keys, *(COMMON_KEYS if keys else ()))},
        required=_read_words(body, "needs"),
        discriminators=tuple(_read_texts(body, "when")),
        alternatives=_read_words(body, "either"),
        overlay_kinds=_read_words(body, "over"),
    )


def _read_texts(body: MappingNode, key: str) -> Iterator[tuple[str, str]]:
    for entry in entries(body.get(key)):
        if isinstance(entry.node, ScalarNode):
            yield entry.key, entry.node.text


def _read_words(body: MappingNode, key: str) -> tuple[str, ...]:
    node = body.get(key)
    items = node.nodes if isinstance(node, SequenceNode) else ()
    return tuple(item.text for item in items if isinstance(item, ScalarNode))


def _parse_key(name: str, text: str) -> Key:
    kind, _, about = text.partition(" -- ")
    return Key(name, parse_kind(kind), about)


def parse_kind(text: str) -> ValueKind:
    """Return the kind that a text like `list of name of mode | any literal or course` says.

    What `or` joins are the items of a list or mapping; ` | ` joins whole alternatives.
    """
    return _parse_alternatives(text.split(" | "))


def _parse_alternatives(options: list[str]) -> ValueKind:
    kinds = tuple(_parse_single_kind(option.split(" ")) for option in options)
    return kinds[0] if len(kinds) == 1 else Either(kinds)


def _parse_items(words: list[str]) -> ValueKind:
    return _parse_alternatives(" ".join(words).split(" or "))


def _parse_single_kind(words: list[str]) -> ValueKind:
    match words:
        case ["one", "of", *rest]:
            return Choice(tuple(" ".join(rest).split(", ")))
        case ["list", "of", *rest]:
            return ListOf(_parse_items(rest))
        case [("named" | "any") as first, *rest] if rest:
            return MappingOf(_parse_items(rest), first == "named")
        case ["name", "of", thing]:
            return Value("name", thing)
        case [word] if word in VALUE_TYPES:
            return Value(word)
        case [shape]:
            return ShapeRef(shape)
    raise ValueError(f"not a kind: {' '.join(words)}")


def alternatives_of(kind: ValueKind) -> Iterator[ValueKind]:
    """Iterate over the alternatives of a kind."""
    if isinstance(kind, Either):
        for each in kind.kinds:
            yield from alternatives_of(each)
    elif isinstance(kind, ShapeRef) and shapes()[kind.shape].alternatives:
        for name in shapes()[kind.shape].alternatives:
            yield ShapeRef(name)
    else:
        yield kind
