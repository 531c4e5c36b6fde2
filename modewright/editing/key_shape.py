"""Key shapes: the keys that a mapping of a spec may have, with types and descriptions.

The shapes are read from `key_shapes/*.yaml`. The readers of the language define their keys
independently; a test compares both.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

from language.text.diagnostic import Source
from language.text.document import MappingNode, ScalarNode, SequenceNode, lines_of
from language.text.node_edit import mapping_entries
from language.text.yaml_parser import parse_yaml

VALUE_TYPES = ("name", "text", "literal", "expression", "balance", "unit", "whole", "truth")
"""The types of scalars."""


@dataclass(frozen=True)
class Value:
    """A scalar of one of VALUE_TYPES; `target` is what a name refers to, empty for a new name."""

    type: str
    target: str = ""


@dataclass(frozen=True)
class Choice:
    """One of several words."""

    words: tuple[str, ...]


@dataclass(frozen=True)
class ListOf:
    """A list of items."""

    item: ValueKind


@dataclass(frozen=True)
class MappingOf:
    """A mapping with free keys: new names if `has_new_names`, else existing names, times, etc."""

    item: ValueKind
    has_new_names: bool


@dataclass(frozen=True)
class ShapeRef:
    """A mapping with known keys, by the name of its shape."""

    shape: str


@dataclass(frozen=True)
class Either:
    """One of several kinds."""

    kinds: tuple[ValueKind, ...]


ValueKind = Value | Choice | ListOf | MappingOf | ShapeRef | Either


@dataclass(frozen=True)
class Key:
    """A key with the kind of its value and a description."""

    name: str
    kind: ValueKind
    about: str


@dataclass(frozen=True)
class Shape:
    """A mapping with known keys, or one of several `alternatives`.

    `required` keys must be present. `discriminators` are pairs of key and word that identify the
    shape. `overlay_kinds` are the kinds of files whose keys it may have.
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
"""Keys that all mappings may have and that do not influence results."""


@cache
def shapes() -> Mapping[str, Shape]:
    """Return all shapes by name, read from `key_shapes/*.yaml` at the first call and cached.

    The shape of a kind of file has the name of the kind. Each shape with keys also has COMMON_KEYS.
    """
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
    """Return the shape of an entry of a shape file."""
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
    """Yield key and text of the scalar entries of a section."""
    for entry in mapping_entries(body.get(key)):
        if isinstance(entry.node, ScalarNode):
            yield entry.key, entry.node.text


def _read_words(body: MappingNode, key: str) -> tuple[str, ...]:
    """Return the scalars of a list; empty if the key is absent."""
    node = body.get(key)
    items = node.nodes if isinstance(node, SequenceNode) else ()
    return tuple(item.text for item in items if isinstance(item, ScalarNode))


def _parse_key(name: str, text: str) -> Key:
    """Return the key of a text `kind -- description`."""
    kind, _, about = text.partition(" -- ")
    return Key(name, parse_kind(kind), about)


def parse_kind(text: str) -> ValueKind:
    """Return the kind of a text such as `list of name of mode | any literal or course`.

    ` | ` separates the alternatives of the whole value, ` or ` those of items. A single word that
    is not in VALUE_TYPES is the name of a shape, which need not exist. Raises ValueError for
    another text of several words.
    """
    return _parse_alternatives(text.split(" | "))


def _parse_alternatives(options: list[str]) -> ValueKind:
    """Return the kind of one or several options."""
    kinds = tuple(_parse_single_kind(option.split(" ")) for option in options)
    return kinds[0] if len(kinds) == 1 else Either(kinds)


def _parse_items(words: list[str]) -> ValueKind:
    """Return the kind of the items of a list or mapping."""
    return _parse_alternatives(" ".join(words).split(" or "))


def _parse_single_kind(words: list[str]) -> ValueKind:
    """Return the kind of a list of words. Raises ValueError."""
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
    """Yield the alternatives of a kind, with those of an `Either` in it in its place.

    A reference to a shape with `alternatives` yields references to these. Any other kind yields
    itself.
    """
    if isinstance(kind, Either):
        for each in kind.kinds:
            yield from alternatives_of(each)
    elif isinstance(kind, ShapeRef) and shapes()[kind.shape].alternatives:
        for name in shapes()[kind.shape].alternatives:
            yield ShapeRef(name)
    else:
        yield kind
