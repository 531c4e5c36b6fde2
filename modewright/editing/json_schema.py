"""JSON Schema: convert the shapes of keys to a schema (draft-07) for editors."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from typing import Any

from language.text.project_files import DOCUMENT_KINDS, NON_HEAD_KEYS
from modewright.editing.key_shape import (
    Choice,
    Either,
    Key,
    ListOf,
    MappingOf,
    Shape,
    ShapeRef,
    Value,
    ValueKind,
    alternatives_of,
    shapes,
)

DRAFT = "http://json-schema.org/draft-07/schema#"
"""The identifier of the draft."""
SCALAR_TYPES = ["string", "number", "boolean"]
"""JSON types of a scalar; the checker decides the type of its text."""
JSON_TYPES: Mapping[str, object] = {
    "whole": "integer",
    "truth": "boolean",
    "name": "string",
    "unit": ["string", "number"],
}
"""JSON types of special scalars."""
NAME_PATTERN = "^\\$?[A-Za-z][A-Za-z0-9_]{0,30}$"
"""The form of a new name; an effect may have a placeholder."""
OVERLAY_PREFIX = "laid_"
"""Prefix of the definitions for overlays, in which no key is required and each may be removed."""
REMOVAL_DEFINITION = "removal"
"""The name of the definition of `{remove: true}`."""

JsonSchema = dict[str, Any]


def json_schema(kind: str | None = None) -> JsonSchema:
    """Return the JSON Schema (draft-07) of one of DOCUMENT_KINDS, or for None of all of them.

    It contains the definitions to which it refers only. Raises ValueError for unknown kinds.
    """
    if kind is not None and kind not in DOCUMENT_KINDS:
        raise ValueError(f"`{kind}` is not one of {', '.join(DOCUMENT_KINDS)}")
    head: JsonSchema = {
        "$schema": DRAFT,
        "title": f"modewright {kind or 'specification'}",
        "description": "Hybrid automata in YAML; `modewright schema` prints this.",
    }
    if kind is not None:
        body: JsonSchema = {"allOf": [_reference(kind)]}
    else:
        heads = {name: {"description": shapes()[name].about} for name in DOCUMENT_KINDS}
        body = {
            "type": "object",
            "required": ["language"],
            "properties": {"language": {"const": 1, "description": "version of the language"}}
            | heads,
            "oneOf": [_kind_condition(name) for name in DOCUMENT_KINDS],
            "allOf": [
                {"if": _kind_condition(name), "then": _reference(name)} for name in DOCUMENT_KINDS
            ],
        }
    return {**head, **body, "definitions": _definitions(kind)}


def _kind_condition(name: str) -> JsonSchema:
    """Return the condition that a file is of a kind; its name may be a key of other kinds."""
    others = [{"required": [kind]} for kind, keys in NON_HEAD_KEYS.items() if name in keys]
    return {"required": [name], **({"not": {"anyOf": others}} if others else {})}


def schema_text(kind: str | None = None) -> str:
    """Return the schema of `json_schema` as indented text with a final line feed.

    Raises ValueError for unknown kinds.
    """
    return json.dumps(json_schema(kind), indent=1) + "\n"


def _definitions(kind: str | None) -> JsonSchema:
    """Return all definitions to which the schema of a kind refers, directly or indirectly."""
    found: JsonSchema = {}
    waiting = [kind] if kind else list(DOCUMENT_KINDS)
    while waiting:
        name = waiting.pop()
        if name in found:
            continue
        found[name] = _definition(name)
        waiting += re.findall(r'"#/definitions/(\w+)"', json.dumps(found[name]))
    return dict(sorted(found.items()))


def _definition(name: str) -> JsonSchema:
    """Return the schema of one definition."""
    if name == REMOVAL_DEFINITION:
        return {
            "type": "object",
            "description": "removes what the base has",
            "properties": {"remove": {"const": True}},
            "required": ["remove"],
            "additionalProperties": False,
        }
    is_overlay = name.startswith(OVERLAY_PREFIX)
    shape = shapes()[name.removeprefix(OVERLAY_PREFIX)]
    if shape.alternatives:
        return {"anyOf": [_reference(each, is_overlay) for each in shape.alternatives]}
    if shape.overlay_kinds:
        return {
            "anyOf": [_reference(each, True) for each in shape.overlay_kinds],
            "required": _required_keys(shape),
        }
    return _object_schema(shape, is_overlay)


def _object_schema(shape: Shape, is_overlay: bool) -> JsonSchema:
    """Return the schema of a mapping with known keys."""
    keys = dict(shape.keys)
    is_file = shape.name in DOCUMENT_KINDS
    if is_overlay and is_file:
        del keys[shape.name]
        keys.update(shapes()["variant"].keys)
    properties = {key.name: _property_schema(key, is_overlay) for key in keys.values()}
    if is_overlay and not is_file:
        properties["remove"] = {"const": True, "description": "removes what the base has"}
    found: JsonSchema = {
        "type": "object" if is_file or shape.required else ["object", "null"],
        "description": shape.about,
        "properties": properties,
        "additionalProperties": False,
    }
    if not is_overlay and (needs := _required_keys(shape)):
        found["required"] = needs
    return found


def _required_keys(shape: Shape) -> list[str]:
    """Return the required keys of a shape."""
    head = ["language", shape.name] if shape.name in DOCUMENT_KINDS else []
    return [*head, *(word for word, _ in shape.discriminators), *shape.required]


def _property_schema(key: Key, is_overlay: bool) -> JsonSchema:
    """Return the schema of the value of a key, with its description."""
    if key.name == "language":
        return {"const": 1, "description": key.about}
    return {**_value_schema(key.kind, is_overlay), "description": key.about}


def _value_schema(kind: ValueKind, is_overlay: bool) -> JsonSchema:
    """Return the schema of a kind of value; in overlays it may be removed."""
    match kind:
        case Either():
            options = [_alternative_schema(each, is_overlay) for each in alternatives_of(kind)]
        case _:
            options = [_alternative_schema(kind, is_overlay)]
    if is_overlay and not isinstance(kind, ShapeRef):
        options.append(_reference(REMOVAL_DEFINITION))
    return options[0] if len(options) == 1 else {"anyOf": options}


def _alternative_schema(kind: ValueKind, is_overlay: bool) -> JsonSchema:
    """Return the schema of one alternative of a kind."""
    match kind:
        case Value(word, _):
            return {"type": JSON_TYPES.get(word, SCALAR_TYPES)}
        case Choice(words):
            return {"enum": [int(w) if re.fullmatch(r"-?\d+", w) else w for w in words]}
        case ListOf(item):
            return {"type": "array", "items": _value_schema(item, False)}
        case MappingOf(item, named):
            free: JsonSchema = {
                "type": ["object", "null"],
                "additionalProperties": _value_schema(item, is_overlay),
            }
            return {**free, "propertyNames": {"pattern": NAME_PATTERN}} if named else free
        case ShapeRef(shape):
            return _reference(shape, is_overlay)
        case Either():
            return _value_schema(kind, is_overlay)


def _reference(name: str, is_overlay: bool = False) -> JsonSchema:
    """Return the reference to a definition."""
    return {"$ref": f"#/definitions/{OVERLAY_PREFIX if is_overlay else ''}{name}"}
