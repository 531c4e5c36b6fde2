"""Shape: what keys a mapping of a spec may have, what each holds and means; read from shapes/.

The readers of the language name the keys that they know themselves; a test holds both equal.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

from language.document import Items, Scalar, Table, lines_of
from language.problem import Source
from language.tree import entries
from language.yaml_tree import parse

WORDS = ("name", "text", "literal", "expression", "balance", "unit", "whole", "truth")
"""What a single value may be."""


@dataclass(frozen=True)
class Value:
    """A single value: one of WORDS; of a name, what it names (`mode`), empty for a new name."""

    word: str
    of: str = ""


@dataclass(frozen=True)
class Choice:
    """One of some words."""

    words: tuple[str, ...]


@dataclass(frozen=True)
class ListOf:
    """A list."""

    item: Kind


@dataclass(frozen=True)
class MappingOf:
    """A mapping with free keys: new names (`named`), or names of something else, times ..."""

    item: Kind
    named: bool


@dataclass(frozen=True)
class Part:
    """A mapping with known keys: the name of its shape."""

    shape: str


@dataclass(frozen=True)
class Either:
    """One of several."""

    kinds: tuple[Kind, ...]


Kind = Value | Choice | ListOf | MappingOf | Part | Either


@dataclass(frozen=True)
class Key:
    """A key: what it holds and what it means."""

    name: str
    kind: Kind
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
    needs: tuple[str, ...] = ()
    when: tuple[tuple[str, str], ...] = ()
    either: tuple[str, ...] = ()
    over: tuple[str, ...] = ()


EVERYWHERE = (
    Key("about", Value("text"), "what this is, in words"),
    Key("req", Either((Value("text"), ListOf(Value("text")))), "the requirements that it meets"),
)
"""Keys that go on anything and have no influence."""


@cache
def shapes() -> Mapping[str, Shape]:
    """Return all shapes by name; that of a kind of file has its name."""
    folder = files("modewright.editing") / "shapes"
    found: dict[str, Shape] = {}
    for file in sorted(folder.iterdir(), key=lambda file: file.name):
        if file.name.endswith(".yaml"):
            text = file.read_text("utf-8")
            for entry in parse(Source(file.name, lines_of(text)), text):
                assert isinstance(entry.node, Table)
                found[entry.key] = _shape(entry.key, entry.node)
    return found


def _shape(name: str, body: Table) -> Shape:
    keys = [_key(key, text) for key, text in _texts(body, "keys")]
    about = body.get("about")
    return Shape(
        name=name,
        about=about.text if isinstance(about, Scalar) else "",
        keys={key.name: key for key in (*keys, *(EVERYWHERE if keys else ()))},
        needs=_words(body, "needs"),
        when=tuple(_texts(body, "when")),
        either=_words(body, "either"),
        over=_words(body, "over"),
    )


def _texts(body: Table, key: str) -> Iterator[tuple[str, str]]:
    for entry in entries(body.get(key)):
        if isinstance(entry.node, Scalar):
            yield entry.key, entry.node.text


def _words(body: Table, key: str) -> tuple[str, ...]:
    node = body.get(key)
    items = node.nodes if isinstance(node, Items) else ()
    return tuple(item.text for item in items if isinstance(item, Scalar))


def _key(name: str, text: str) -> Key:
    kind, _, about = text.partition(" -- ")
    return Key(name, kind_of(kind), about)


def kind_of(text: str) -> Kind:
    """Return the kind that a text like `list of name of mode | any literal or course` says.

    What `or` joins are the items of a list or mapping; ` | ` joins whole alternatives.
    """
    return _either(text.split(" | "))


def _either(options: list[str]) -> Kind:
    kinds = tuple(_kind(option.split(" ")) for option in options)
    return kinds[0] if len(kinds) == 1 else Either(kinds)


def _items(words: list[str]) -> Kind:
    return _either(" ".join(words).split(" or "))


def _kind(words: list[str]) -> Kind:
    match words:
        case ["one", "of", *rest]:
            return Choice(tuple(" ".join(rest).split(", ")))
        case ["list", "of", *rest]:
            return ListOf(_items(rest))
        case [("named" | "any") as first, *rest] if rest:
            return MappingOf(_items(rest), first == "named")
        case ["name", "of", thing]:
            return Value("name", thing)
        case [word] if word in WORDS:
            return Value(word)
        case [shape]:
            return Part(shape)
    raise ValueError(f"not a kind: {' '.join(words)}")


def kinds_in(kind: Kind) -> Iterator[Kind]:
    """Iterate over the alternatives of a kind."""
    if isinstance(kind, Either):
        for each in kind.kinds:
            yield from kinds_in(each)
    elif isinstance(kind, Part) and shapes()[kind.shape].either:
        for name in shapes()[kind.shape].either:
            yield Part(name)
    else:
        yield kind
