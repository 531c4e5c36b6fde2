"""Manifest reader: read `study.json` of a store and validate each entry."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from language.expressions.name_rules import NAME_PATTERN
from language.text.regular_file import read_regular_bytes
from language.text.sanitise import escape_invisible, truncate
from sweep.definition.description import Description
from sweep.definition.measure import StoreColumn
from sweep.definition.presentation_reader import PLOT_OPTIONS
from sweep.definition.sampling_reader import MAX_POINTS, MAX_SEED, METHODS
from sweep.definition.study import MAX_CONFIDENCE, MIN_CONFIDENCE, Presentation
from sweep.store.block_file import LEADING_COLUMNS, STATUS_COLUMNS
from sweep.store.digest import STORE_FORMAT
from sweep.store.manifest import ARROW_TYPES, MANIFEST_NAME, Design, Manifest, seal_of, store_error

COLUMN_PATTERN = re.compile(r"[A-Za-z]\w*(\.\w+)*", re.ASCII)
"""The form of a column name."""
GROUP_COLUMNS = ("variant", "scenario")
"""Columns of text by which results can be grouped."""


def read_manifest(folder: Path) -> Manifest:
    """Return the manifest of the store in a folder, from its file MANIFEST_NAME.

    Raises SpecError if it is missing, no valid JSON, changed (its seal differs), of another schema
    version, or has an invalid entry. Blocks are not read.
    """
    try:
        data = json.loads(read_regular_bytes(folder / MANIFEST_NAME).decode("utf-8"))
        if isinstance(data, dict) and data.get("modewright", STORE_FORMAT) != STORE_FORMAT:
            label = "these results are in a form that is not known here"
            raise store_error(folder, label, "run the study into another folder")
        return _manifest(data)
    except FileNotFoundError:
        label = "there are no results of a study here"
        raise store_error(folder, label, "modewright sweep STUDY --out DIR") from None
    except (OSError, ValueError, RecursionError) as error:
        reason = error.strerror if isinstance(error, OSError) else None
        label = f"`{MANIFEST_NAME}` cannot be read: {reason or error}"
        hint = "put back what modewright has written; the blocks are as they were"
        raise store_error(folder, label, hint) from None


def _manifest(data: Any) -> Manifest:
    """Return the manifest of JSON data. Raises ValueError with the place of a fault."""
    table = _table(data, MANIFEST_NAME)
    _get(table, "modewright")
    _require(_get(table, "seal") == seal_of(table), "it is not as it was written")
    varied = _columns(_get(table, "varied"), "varied")
    measures = _columns(_get(table, "measures"), "measures")
    names = [column.name for column in (*varied, *measures)]
    names += [*LEADING_COLUMNS, *STATUS_COLUMNS]
    _require(len(set(names)) == len(names), "`varied` and `measures` have a name twice")
    return Manifest(
        study=_text(_get(table, "study"), "study"),
        digest=_text(_get(table, "digest"), "digest"),
        identity=_named_texts(_get(table, "identity"), "identity"),
        count=_whole(_get(table, "count"), "count", 0, MAX_POINTS),
        block_size=_whole(_get(table, "block"), "block", 1, None),
        varied=varied,
        words=_words(_get(table, "words"), varied),
        measures=measures,
        presentation=_presentation(_get(table, "presentation"), varied, measures),
        design=_design(_get(table, "design"), varied),
        description=_description(_get(table, "description")),
    )


def _presentation(
    data: Any, varied: Sequence[StoreColumn], measures: Sequence[StoreColumn]
) -> Presentation:
    """Return the presentation of JSON data. Raises ValueError."""
    table = _table(data, "presentation")
    groups = (*GROUP_COLUMNS, *(column.name for column in varied))
    confidence = _real(_get(table, "confidence"), "confidence")
    is_share = MIN_CONFIDENCE <= confidence <= MAX_CONFIDENCE
    _require(is_share, f"`confidence` is no share from {MIN_CONFIDENCE:g} to {MAX_CONFIDENCE!r}")
    plots = {}
    for name, plot in _table(_get(table, "plots"), "plots").items():
        _require(
            NAME_PATTERN.fullmatch(name) is not None, f"`{_quote(name)}` is no name of a picture"
        )
        plots[name] = _plot(_table(plot, f"plots.{name}"), f"plots.{name}", varied, measures)
    by = _choices(_get(table, "by"), "by", groups)
    return Presentation(by, confidence, plots)


def _plot(
    table: Mapping[str, Any],
    where: str,
    varied: Sequence[StoreColumn],
    measures: Sequence[StoreColumn],
) -> dict[str, Any]:
    """Return the options of a plot, in the form of sweep/definition/presentation_reader.py.

    Raises ValueError for unknown columns or options.
    """
    kind = _choice(_get(table, "kind"), f"{where}.kind", tuple(PLOT_OPTIONS))
    types = ("real", "whole", "truth", *(("list",) if kind == "histogram" else ()))
    of = _choices(
        _get(table, "of"), f"{where}.of", [one.name for one in measures if one.type in types]
    )
    _require(kind == "parallel" or len(of) == 1, f"`{where}.of` is not one measure")
    found: dict[str, Any] = {"kind": kind, "of": list(of)}
    names = [column.name for column in varied]
    if kind == "heat_map":
        found["over"] = list(_choices(_get(table, "over"), f"{where}.over", names))
        _require(len(found["over"]) == 2, f"`{where}.over` is not two things that vary")
    if "by" in table:
        found["by"] = list(_choices(table["by"], f"{where}.by", (*GROUP_COLUMNS, *names)))
    return found


def _design(data: Any, varied: Sequence[StoreColumn]) -> Design:
    """Return the sampling design of JSON data. Raises ValueError."""
    table = _table(data, "design")
    known = [column.name for column in varied]
    made = Design(
        method=_choice(_get(table, "method"), "design.method", METHODS),
        names=_choices(_get(table, "names"), "design.names", known),
        count=_whole(_get(table, "count"), "design.count", 0, MAX_POINTS),
        seed=_whole(_get(table, "seed"), "design.seed", 0, MAX_SEED),
        replicates=_whole(_get(table, "replicates"), "design.replicates", 1, MAX_POINTS),
    )
    _require(bool(made.names) == bool(made.count), "`design` has points of nothing, or none")
    _require(
        made.count % made.group_size == 0, f"`design.count` is {made.count}: some are not whole"
    )
    return made


def _description(data: Any) -> Description:
    """Return the description of JSON data. Raises ValueError."""
    found: dict[str, str | dict[str, str]] = {}
    for key, said in _table(data, "description").items():
        read = _named_texts if isinstance(said, dict) else _text
        found[_text(key, "description")] = read(said, f"description.{key}")
    return found


def _columns(data: Any, where: str) -> tuple[StoreColumn, ...]:
    """Return the columns of JSON data. Raises ValueError for invalid names, types and factors."""
    found = []
    for place, item in enumerate(_list(data, where)):
        here = f"{where}.{place}"
        table = _table(item, here)
        name = _text(_get(table, "name"), f"{here}.name")
        _require(COLUMN_PATTERN.fullmatch(name) is not None, f"`{here}.name` is no name")
        kind = _choice(_get(table, "type"), f"{here}.type", tuple(ARROW_TYPES))
        unit, shown = (_text(_get(table, key), f"{here}.{key}") for key in ("unit", "shown"))
        factor, offset = (_real(_get(table, key), f"{here}.{key}") for key in ("factor", "offset"))
        _require(factor > 0.0, f"`{here}.factor` is {factor}, not above zero")
        found.append(StoreColumn(name, kind, unit, shown, factor, offset))  # type: ignore[arg-type]
    return tuple(found)


def _words(data: Any, varied: Sequence[StoreColumn]) -> dict[str, tuple[str, ...]]:
    """Return the enumeration values by variable. Raises ValueError."""
    table = _table(data, "words")
    known = [column.name for column in varied]
    return {
        _choice(name, "words", known): tuple(
            _text(word, f"words.{name}") for word in _list(words, f"words.{name}")
        )
        for name, words in table.items()
    }


# Checks of JSON values; each raises ValueError with the place.
def _require(condition: bool, label: str) -> None:
    """Raise ValueError with a label unless a condition holds."""
    if not condition:
        raise ValueError(label)


def _get(table: Mapping[str, Any], key: str) -> Any:
    """Return the value of a required key."""
    _require(key in table, f"`{key}` is missing")
    return table[key]


def _table(value: Any, where: str) -> dict[str, Any]:
    """Return a value that must be a JSON object."""
    _require(isinstance(value, dict), f"`{where}` is no table")
    return dict(value)


def _list(value: Any, where: str) -> list[Any]:
    """Return a value that must be a JSON array."""
    _require(isinstance(value, list), f"`{where}` is no list")
    return list(value)


def _text(value: Any, where: str) -> str:
    """Return a value that must be a string without invisible characters."""
    is_text = isinstance(value, str) and escape_invisible(value) == value
    _require(is_text, f"`{where}` is {_quote(value)}, no text")
    return str(value)


def _named_texts(value: Any, where: str) -> dict[str, str]:
    """Return a value that must be an object with string values."""
    table = _table(value, where)
    return {_text(name, where): _text(text, f"{where}.{name}") for name, text in table.items()}


def _whole(value: Any, where: str, low: int, high: int | None) -> int:
    """Return a value that must be an integer from `low` to `high`.

    There is no upper limit if `high` is None.
    """
    is_whole = isinstance(value, int) and not isinstance(value, bool)
    is_fine = is_whole and low <= value and (high is None or value <= high)
    limits = f"from {low} on" if high is None else f"from {low} to {high}"
    _require(is_fine, f"`{where}` is {_quote(value)}, no whole number {limits}")
    return int(value)


def _real(value: Any, where: str) -> float:
    """Return a value that must be a finite float."""
    is_real = isinstance(value, float) and math.isfinite(value)
    _require(is_real, f"`{where}` is {_quote(value)}, no real number")
    return float(value)


def _choice(value: Any, where: str, known: Sequence[str]) -> str:
    """Return a value that must be one of the known strings."""
    is_known = isinstance(value, str) and value in known
    _require(is_known, f"`{where}` is {_quote(value)}, not one of {', '.join(known) or 'nothing'}")
    return str(value)


def _choices(value: Any, where: str, known: Sequence[str]) -> tuple[str, ...]:
    """Return an array whose items must be among the known strings."""
    return tuple(_choice(item, where, known) for item in _list(value, where))


def _quote(value: Any) -> str:
    """Return a value as short text with invisible characters escaped."""
    return escape_invisible(truncate(str(value), 40))
