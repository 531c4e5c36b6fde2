"""Schema: the shapes as a JSON Schema (draft-07), from which editors complete and explain keys."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from typing import Any

from language.finding import INSIDE, KINDS
from modewright.editing.shape import (
    Choice,
    Either,
    Key,
    Kind,
    ListOf,
    MappingOf,
    Part,
    Shape,
    Value,
    kinds_in,
    shapes,
)

DRAFT = "http://json-schema.org/draft-07/schema#"
SCALAR = ["string", "number", "boolean"]
"""How a single value of a spec looks to YAML; what it is, the checker decides from its text."""
TYPES: Mapping[str, object] = {
    "whole": "integer",
    "truth": "boolean",
    "name": "string",
    "unit": ["string", "number"],
}
NAME = "^\\$?[A-Za-z][A-Za-z0-9_]{0,30}$"
"""A new name; in an effect a hole may stand for one."""
LAID = "laid_"
"""How the shapes of a variant begin: nothing is needed in them, everything may be removed."""
REMOVAL = "removal"

Json = dict[str, Any]


def schema(kind: str | None = None) -> Json:
    """Return the JSON Schema of one kind of file, or of all. Raises ValueError for others."""
    if kind is not None and kind not in KINDS:
        raise ValueError(f"`{kind}` is not one of {', '.join(KINDS)}")
    head: Json = {
        "$schema": DRAFT,
        "title": f"modewright {kind or 'specification'}",
        "description": "Hybrid automata in YAML; `modewright schema` prints this.",
    }
    if kind is not None:
        body: Json = {"allOf": [_reference(kind)]}
    else:
        heads = {name: {"description": shapes()[name].about} for name in KINDS}
        body = {
            "type": "object",
            "required": ["language"],
            "properties": {"language": {"const": 1, "description": "version of the language"}}
            | heads,
            "oneOf": [_is(name) for name in KINDS],
            "allOf": [{"if": _is(name), "then": _reference(name)} for name in KINDS],
        }
    return {**head, **body, "definitions": _definitions(kind)}


def _is(name: str) -> Json:
    """What tells that a file is of a kind, whose name may be a key of other kinds, too."""
    others = [{"required": [kind]} for kind, keys in INSIDE.items() if name in keys]
    return {"required": [name], **({"not": {"anyOf": others}} if others else {})}


def schema_text(kind: str | None = None) -> str:
    """Return the JSON Schema as text, with a line feed at its end."""
    return json.dumps(schema(kind), indent=1) + "\n"


def _definitions(kind: str | None) -> Json:
    """Return what the schema of a kind refers to, directly or not."""
    found: Json = {}
    waiting = [kind] if kind else list(KINDS)
    while waiting:
        name = waiting.pop()
        if name in found:
            continue
        found[name] = _definition(name)
        waiting += re.findall(r'"#/definitions/(\w+)"', json.dumps(found[name]))
    return dict(sorted(found.items()))


def _definition(name: str) -> Json:
    if name == REMOVAL:
        return {
            "type": "object",
            "description": "removes what the base has",
            "properties": {"remove": {"const": True}},
            "required": ["remove"],
            "additionalProperties": False,
        }
    is_laid = name.startswith(LAID)
    shape = shapes()[name.removeprefix(LAID)]
    if shape.either:
        return {"anyOf": [_reference(each, is_laid) for each in shape.either]}
    if shape.over:
        return {"anyOf": [_reference(each, True) for each in shape.over], "required": _needs(shape)}
    return _closed(shape, is_laid)


def _closed(shape: Shape, is_laid: bool) -> Json:
    keys = dict(shape.keys)
    is_file = shape.name in KINDS
    if is_laid and is_file:
        del keys[shape.name]
        keys.update(shapes()["variant"].keys)
    properties = {key.name: _property(key, is_laid) for key in keys.values()}
    if is_laid and not is_file:
        properties["remove"] = {"const": True, "description": "removes what the base has"}
    found: Json = {
        "type": "object" if is_file or shape.needs else ["object", "null"],
        "description": shape.about,
        "properties": properties,
        "additionalProperties": False,
    }
    if not is_laid and (needs := _needs(shape)):
        found["required"] = needs
    return found


def _needs(shape: Shape) -> list[str]:
    head = ["language", shape.name] if shape.name in KINDS else []
    return [*head, *(word for word, _ in shape.when), *shape.needs]


def _property(key: Key, is_laid: bool) -> Json:
    if key.name == "language":
        return {"const": 1, "description": key.about}
    return {**_value(key.kind, is_laid), "description": key.about}


def _value(kind: Kind, is_laid: bool) -> Json:
    match kind:
        case Either():
            options = [_plain(each, is_laid) for each in kinds_in(kind)]
        case _:
            options = [_plain(kind, is_laid)]
    if is_laid and not isinstance(kind, Part):
        options.append(_reference(REMOVAL))
    return options[0] if len(options) == 1 else {"anyOf": options}


def _plain(kind: Kind, is_laid: bool) -> Json:
    match kind:
        case Value(word, _):
            return {"type": TYPES.get(word, SCALAR)}
        case Choice(words):
            return {"enum": [int(w) if re.fullmatch(r"-?\d+", w) else w for w in words]}
        case ListOf(item):
            return {"type": "array", "items": _value(item, False)}
        case MappingOf(item, named):
            free: Json = {
                "type": ["object", "null"],
                "additionalProperties": _value(item, is_laid),
            }
            return {**free, "propertyNames": {"pattern": NAME}} if named else free
        case Part(shape):
            return _reference(shape, is_laid)
        case Either():
            return _value(kind, is_laid)


def _reference(name: str, is_laid: bool = False) -> Json:
    return {"$ref": f"#/definitions/{LAID if is_laid else ''}{name}"}
