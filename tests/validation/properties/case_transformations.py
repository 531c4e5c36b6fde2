"""Case transformations: a case written differently, so that the same physics is missing.

A case is a folder with spec.yaml, map.yaml and train/*.csv. A transformation changes such a folder,
or how it is diagnosed. A change of units multiplies every quantity by the factors of its base
units, as if these had another size: the numbers of the spec, of the map and of the time stamps
change, the recorded columns do not.
"""

from __future__ import annotations

import csv
import json
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from decimal import Decimal
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from language.expressions.number_literal import DECIMAL_PATTERN
from language.expressions.tokens import UNIT_PATTERN
from language.expressions.units import UnitError, parse_unit

Tree = dict[str, Any]
Table = list[list[str]]
BASE_UNITS = ("m", "kg", "s", "A", "K")
"""The base units, in the order of the powers of a dimension."""
LITERAL = re.compile(rf"(?<![\w.])({DECIMAL_PATTERN.pattern}) ({UNIT_PATTERN})")
NUMBER = re.compile(rf"-?{DECIMAL_PATTERN.pattern}")
REORDERED = ("parameters", "inputs", "states", "equations", "flow", "elements", "places", "outputs")
"""Sections of a spec whose entries may be in any order."""
PREFIXES = {"k": Decimal(1000), "m": Decimal("0.001")}


class NotWritableError(Exception):
    """The transformation does not apply to this case."""


@dataclass(frozen=True)
class Transformation:
    """A change of a case folder, and the factors of base units by which values in SI change.

    `environment` are variables of the process that diagnoses; with `reverses_effects` it takes the
    effects of the library in reverse order.
    """

    name: str
    about: str
    change: Callable[[Path], None] = lambda case: None
    factors: Mapping[str, int] = field(default_factory=dict)
    environment: Mapping[str, str] = field(default_factory=dict)
    reverses_effects: bool = False

    def factor_of(self, unit: str) -> float:
        """Return the factor by which values in a unit change."""
        return float(unit_factor(unit, self.factors))


def unit_factor(unit: str, factors: Mapping[str, int]) -> Decimal:
    """Return the product of the factors of the base units of a unit, with their powers."""
    powers = parse_unit(unit).dimension.powers
    found = Decimal(1)
    for base, power in zip(BASE_UNITS, powers, strict=True):
        found *= Decimal(factors.get(base, 1)) ** power
    return found


def reverse_files(case: Path) -> None:
    """Rename the recordings so that their names have the reverse order."""
    files = sorted((case / "train").glob("*.csv"))
    for k, file in enumerate(files):
        file.rename(file.with_name(f"{len(files) - k:03d}_{file.name}"))


def rename_files(case: Path) -> None:
    """Give the recordings other names in the same order."""
    for k, file in enumerate(sorted((case / "train").glob("*.csv"))):
        file.rename(file.with_name(f"A{k:03d} Fahrt é.csv"))


def reverse_names(case: Path) -> None:
    """Reverse the order of parameters, signals, states and columns."""
    spec, columns = read_tree(case / "spec.yaml"), read_tree(case / "map.yaml")
    for section in REORDERED:
        if section in spec:
            spec[section] = _reversed(spec[section])
    columns["columns"] = _reversed(columns["columns"])
    write_tree(case / "spec.yaml", spec)
    write_tree(case / "map.yaml", columns)
    for file in sorted((case / "train").glob("*.csv")):
        write_table(file, [row[::-1] for row in read_table(file)])


def change_units(case: Path, factors: Mapping[str, int]) -> None:
    """Multiply all values in SI by the factors of their base units."""
    spec, columns = read_tree(case / "spec.yaml"), read_tree(case / "map.yaml")
    signals = {**spec["inputs"], **_signal_tables(spec)}
    for column in columns["columns"].values():
        name = column.get("to") or column["compare"]
        factor = unit_factor(_unit_of(signals, name), factors)
        if factor != 1:
            number, _, unit = column.get("scale", "1").partition(" ")
            column["scale"] = f"{_text(Decimal(number) * factor)} {unit}".strip()
        if "delay" in column:
            column["delay"] = _scale_literals(column["delay"], factors)
    write_tree(case / "spec.yaml", _scale_tree(spec, factors))
    write_tree(case / "map.yaml", columns)
    if factors.get("s", 1) != 1:
        _stretch_stamps(case, columns["time"]["column"], Decimal(factors["s"]))


def spell_units(case: Path) -> None:
    """Write quantities with other prefixes of their units, such as kN for N; values in SI stay."""
    spec, columns = read_tree(case / "spec.yaml"), read_tree(case / "map.yaml")
    factors: dict[str, Decimal] = {}
    for name, column in columns["columns"].items():
        column["unit"], factors[column.get("column", name)] = _with_prefix(column["unit"])
    write_tree(case / "spec.yaml", _spell_tree(spec))
    write_tree(case / "map.yaml", columns)
    for file in sorted((case / "train").glob("*.csv")):
        head, *rows = read_table(file)
        scales = [factors.get(name, Decimal(1)) for name in head]
        scaled = [
            [_text(Decimal(cell) / scale) for cell, scale in zip(row, scales, strict=True)]
            for row in rows
        ]
        write_table(file, [head, *scaled])


def cut_recording(case: Path) -> None:
    """Cut the longest recording in two, where its outputs are most like those at its start.

    A model starts there in its initial mode. The cut is in the middle half of the recording.
    """
    columns = read_tree(case / "map.yaml")["columns"]
    compared = [one.get("column", name) for name, one in columns.items() if "compare" in one]
    file = max(sorted((case / "train").glob("*.csv")), key=lambda one: len(read_table(one)))
    head, *rows = read_table(file)
    places = [head.index(name) for name in compared]
    values = np.array([[float(row[k]) for k in places] for row in rows])
    spread = np.maximum(values.std(axis=0), np.finfo(float).tiny)
    far = np.sum(((values - values[0]) / spread) ** 2, axis=1)
    first, last = len(rows) // 4, 3 * len(rows) // 4
    edge = first + int(np.argmin(far[first:last]))
    for part, some in (("a", rows[:edge]), ("b", rows[edge:])):
        write_table(file.with_name(f"{file.stem}{part}.csv"), [head, *some])
    file.unlink()


def sample_finer(case: Path) -> None:
    """Double the sampling rate: inputs follow their hold, outputs are unknown at new samples.

    Raises NotWritableError if the hold of an input is not known.
    """
    columns = read_tree(case / "map.yaml")
    holds: dict[str, str] = {}
    for name, one in columns["columns"].items():
        if "compare" in one:
            one["blank"] = "skip"
        else:
            holds[one.get("column", name)] = one.get("hold", "")
    for file in sorted((case / "train").glob("*.csv")):
        write_table(file, _twice_as_fine(read_table(file), columns["time"]["column"], holds))
    write_tree(case / "map.yaml", columns)


TRANSFORMATIONS = (
    Transformation("files", "reverse order of the training files", reverse_files),
    Transformation("effects", "reverse order of the effects", reverses_effects=True),
    Transformation("names", "reverse order of parameters, signals, states, columns", reverse_names),
    Transformation("prefixes", "units with other prefixes, such as kN for N", spell_units),
    *(
        Transformation(
            f"{kind}_{base}",
            f"the unit {base} {text}",
            partial(change_units, factors={base: factor}),
            factors={base: factor},
        )
        for kind, base, factor, text in (
            ("scale", "kg", 1000, "a thousand times smaller"),
            ("scale", "m", 1000, "a thousand times smaller"),
            ("scale", "A", 1000, "a thousand times smaller"),
            ("stretch", "s", 10, "ten times smaller"),
        )
    ),
    Transformation("cut", "one recording cut in two", cut_recording),
    Transformation("finer", "twice the sampling rate", sample_finer),
    *(
        Transformation(
            f"blas_{kernel.lower()}",
            f"the BLAS kernels of {kernel}",
            environment={"OPENBLAS_CORETYPE": kernel},
        )
        for kernel in ("Haswell", "Nehalem")
    ),
    Transformation("file_names", "other names of the files", rename_files),
)
"""All transformations, in the order of the table."""


def read_tree(path: Path) -> Tree:
    """Return a YAML file; all scalars are texts."""
    found: Tree = yaml.load(path.read_text("utf-8"), yaml.BaseLoader)
    return found


def write_tree(path: Path, tree: Tree) -> None:
    """Write a spec or a map as JSON, which is YAML."""
    path.write_text(json.dumps(tree, indent=1, ensure_ascii=False) + "\n", "utf-8")


def read_table(path: Path) -> Table:
    """Return the rows of a CSV file as texts, the header first."""
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.reader(file))


def write_table(path: Path, rows: Sequence[Sequence[str]]) -> None:
    """Write rows of texts as a CSV file."""
    with path.open("w", newline="", encoding="utf-8") as file:
        csv.writer(file, lineterminator="\n").writerows(rows)


def _reversed(entries: Any) -> Any:
    """Return a mapping or a list in reverse order."""
    is_mapping = isinstance(entries, dict)
    return dict(reversed(entries.items())) if is_mapping else list(reversed(entries))


def _signal_tables(spec: Tree) -> Tree:
    """Return the tables of states, by name."""
    return {name: one for name, one in spec.get("states", {}).items() if isinstance(one, dict)}


def _unit_of(signals: Tree, name: str) -> str:
    """Return the unit of an input or state. Raises NotWritableError for another signal."""
    if name not in signals:
        raise NotWritableError(f"the unit of `{name}` is not stated in the spec")
    return str(signals[name]["unit"])


def _scale_tree(tree: Any, factors: Mapping[str, int]) -> Any:
    """Return a part of a spec with scaled literals; bare ranges have the unit of their value."""
    if isinstance(tree, str):
        return _scale_literals(tree, factors)
    if isinstance(tree, list):
        return [_scale_tree(one, factors) for one in tree]
    scaled = {key: _scale_tree(one, factors) for key, one in tree.items() if key != "about"}
    match = LITERAL.fullmatch(str(tree.get("value", "")))
    if match and isinstance(tree.get("range"), list):
        factor = unit_factor(match[5], factors)
        scaled["range"] = [
            _text(Decimal(end) * factor) if NUMBER.fullmatch(end) else scaled["range"][k]
            for k, end in enumerate(tree["range"])
        ]
    return scaled


def _scale_literals(text: str, factors: Mapping[str, int]) -> str:
    """Return a text with each quantity in it multiplied by the factor of its unit."""

    def scale(match: re.Match[str]) -> str:
        try:
            factor = unit_factor(match[5], factors)
        except UnitError:
            return match[0]
        return f"{_text(Decimal(match[1]) * factor)} {match[5]}"

    return LITERAL.sub(scale, text)


def _spell_tree(tree: Any) -> Any:
    """Return a part of a spec with other prefixes of units; bare ranges follow their value."""
    if isinstance(tree, str):
        return LITERAL.sub(_spell, tree)
    if isinstance(tree, list):
        return [_spell_tree(one) for one in tree]
    spelled = {key: _spell_tree(one) for key, one in tree.items() if key != "about"}
    match = LITERAL.fullmatch(str(tree.get("value", "")))
    if match and isinstance(tree.get("range"), list):
        factor = _with_prefix(match[5])[1]
        spelled["range"] = [
            _text(Decimal(end) / factor) if NUMBER.fullmatch(end) else spelled["range"][k]
            for k, end in enumerate(tree["range"])
        ]
    return spelled


def _spell(match: re.Match[str]) -> str:
    """Return a quantity with another prefix of its unit."""
    try:
        unit, factor = _with_prefix(match[5])
    except UnitError:
        return match[0]
    return f"{_text(Decimal(match[1]) / factor)} {unit}"


def _with_prefix(unit: str) -> tuple[str, Decimal]:
    """Return a unit with another prefix and its factor over the unit; the unit if there is none."""
    known = parse_unit(unit)
    for prefix, factor in PREFIXES.items():
        try:
            other = parse_unit(prefix + unit)
        except UnitError:
            continue
        is_same = other.dimension == known.dimension and not known.offset
        if is_same and float(other.factor / known.factor) == float(factor):
            return prefix + unit, factor
    return unit, Decimal(1)


def _stretch_stamps(case: Path, column: str, factor: Decimal) -> None:
    """Multiply the time stamps of all recordings."""
    for file in sorted((case / "train").glob("*.csv")):
        head, *rows = read_table(file)
        place = head.index(column)
        for row in rows:
            row[place] = _text(Decimal(row[place]) * factor)
        write_table(file, [head, *rows])


def _twice_as_fine(table: Table, time: str, holds: Mapping[str, str]) -> Table:
    """Return a table with a row between any two rows (`sample_finer`)."""
    head, *rows = table
    linear = {name: _is_linear(holds[name], head.index(name), rows) for name in holds}
    linear[time] = True
    fine = [head]
    for before, after in zip(rows, [*rows[1:], None], strict=True):
        fine.append(before)
        if after is not None:
            pairs = zip(head, before, after, strict=True)
            fine.append([_between(linear.get(name), *cells) for name, *cells in pairs])
    return fine


def _is_linear(hold: str, place: int, rows: Table) -> bool:
    """Return whether an input is linear between samples. Raises NotWritableError if not known."""
    if not hold and len({row[place] for row in rows}) > 2:
        raise NotWritableError("the hold of an input is not known")
    return hold == "linear"


def _between(is_linear: bool | None, before: str, after: str) -> str:
    """Return a cell between two cells; None for `is_linear` is an output."""
    if is_linear is None:
        return ""
    return _text((Decimal(before) + Decimal(after)) / 2) if is_linear else before


def _text(value: Decimal) -> str:
    """Return a number without an exponent."""
    text = f"{value.normalize():f}"
    return "0" if text == "-0" else text
