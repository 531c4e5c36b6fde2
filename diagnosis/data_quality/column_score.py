"""Column score: how well a column of a file fits a signal of an automaton, and in which unit.

The score is the sum of `WEIGHTS` of what the unit, the name and the values say.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from diagnosis.data_quality.file_columns import FileColumn
from diagnosis.data_quality.signal_words import (
    QUANTITY_UNITS,
    NameMeaning,
    UnitReading,
    quantities_of,
    read_meaning,
    split_words,
)
from language.expressions.units import (
    Dimension,
    Unit,
    are_compatible,
    dimension_product,
    parse_unit,
)
from language.model.automaton import Automaton
from language.model.declaration import Range
from language.typecheck.types import TypeName

EXCLUDED = -1e6
"""Score of a pair that cannot be."""

WEIGHTS = {
    "words of the signal": 6.0,
    "unit": 4.0,
    "same name": 4.0,
    "command": 2.0,
    "words in the name": 2.0,
    "place": 1.75,
    "unit by a parameter": 1.5,
    "quantity": 1.5,
    "quantity by a parameter": 1.0,
    "other word": 1.0,
    "unit of a sensor": 0.5,
    "no unit": 0.5,
    "letter": 0.5,
    "mean of sensors": 0.5,
    "range": 0.5,
    "first value": 0.5,
    "quantity of a sensor": 0.25,
    "place of another signal": 0.25,
    "rarer sensor": -0.05,
    "other letter": -0.5,
    "no command": -0.5,
    "unit not read": -1.0,
    "other quantity": -1.5,
    "other place": -1.5,
    "constant": -1.5,
    "other role": -2.0,
    "out of range": -2.0,
    "no quantity": -2.5,
}
"""What speaks for a column as a signal, and against it.

Their order is the knowledge: a unit that fits counts as much as the name of the signal and more
than any word in a name. Their sizes are set by hand; a person checks each proposed line.
"""

SAME_NAME = "it has the name of the signal"
"""Reason of a line whose column has the name of its signal."""

RANGE_MARGIN = 0.1
"""Part of the width of a range by which values may exceed it."""

OTHER_UNITS: tuple[tuple[str, ...], ...] = (
    ("rad/s", "rpm", "deg/s"),
    ("m/s", "km/h"),
    ("rad", "deg"),
    ("m", "mm"),
    ("N*m", "kN*m"),
    ("N", "kN"),
    ("K", "degC"),
    ("1", "percent"),
)
"""Usual units of one dimension; the one whose values are in the range of the signal is proposed."""

SENSED_BY = {
    "current": {"torque", "force"},
    "voltage": {"torque", "force", "position", "speed"},
    "number": {"position"},
    "speed": {"speed"},
}
"""Quantities that a quantity of another unit stands for, by a factor that a person knows; the most
frequent ones first."""


@dataclass(frozen=True)
class ModelSignal:
    """An input or output of an automaton with its unit, range and first value in SI.

    `first` is the constant initial value of the state of that name, if it has one. `words` are the
    texts of an enumeration.
    """

    name: str
    is_input: bool
    has_default: bool
    dimension: Dimension
    unit: str
    type: TypeName
    range: Range | None
    first: float | None
    meaning: NameMeaning
    words: tuple[str, ...] = ()

    @property
    def kind(self) -> str:
        """The key of the signal in MIN_SCORE."""
        return ("optional" if self.has_default else "input") if self.is_input else "output"


@dataclass(frozen=True)
class ProposedColumn:
    """A proposed line of a map: the columns, their signal, unit and scale, and the reasons.

    `scale` is a text of the language or empty. `is_open` tells that a person has to state a number.
    `hold` is `linear` for an input that is interpolated, else empty.
    """

    column: FileColumn
    signal: ModelSignal
    unit: str
    scale: str
    score: float
    reasons: tuple[str, ...]
    is_open: bool = False
    hold: Literal["", "linear"] = ""


def score_column(
    column: FileColumn, signal: ModelSignal, automaton: Automaton, context: frozenset[str]
) -> ProposedColumn | None:
    """Return the best reading of a column as a signal with its score; None if it cannot be."""
    found = [
        pair
        for reading in column.readings
        if (pair := _score_reading(column, reading, signal, automaton, context)) is not None
    ]
    return max(found, key=lambda pair: pair.score, default=None)


def _score_reading(
    column: FileColumn,
    reading: UnitReading,
    signal: ModelSignal,
    automaton: Automaton,
    context: frozenset[str],
) -> ProposedColumn | None:
    """Return a reading of a column as a signal with its score; None if the units exclude it."""
    if column.texts and not np.isfinite(column.values).any():
        return _score_words(column, signal)
    meaning = read_meaning(reading.stem)
    if reading.unit is not None:
        proposed = _by_unit(column, reading.unit, signal, automaton)
    else:
        proposed = _without_unit(column, meaning, signal, automaton)
    if proposed is None:
        return None
    score, reasons = _score_name(reading, meaning, proposed, context)
    proposed = replace(proposed, reasons=(*proposed.reasons, *reasons))
    if reading.unit is None:
        is_unit = any(len(r.stem) < len(reading.stem) - 2 for r in column.readings)
        score += WEIGHTS["unit not read"] * is_unit
    value_score, value_reason = _score_values(column, proposed, signal)
    mean = WEIGHTS["mean of sensors"] if len(column.names) > 1 else 0.0
    return replace(
        proposed,
        score=proposed.score + score + value_score + mean,
        reasons=tuple(text for text in (*proposed.reasons, value_reason) if text),
    )


def _score_words(column: FileColumn, signal: ModelSignal) -> ProposedColumn | None:
    """Return a column of words as a truth value or an enumeration; None for other signals."""
    known = {"true", "false", "on", "off", "yes", "no"} if signal.type == "bool" else set()
    known |= {word.casefold() for word in signal.words}
    if not known or not {text.casefold() for text in column.texts} <= known:
        return None
    return ProposedColumn(
        column,
        signal,
        "1",
        "",
        WEIGHTS["words of the signal"],
        ("its words are those of the signal",),
    )


def _by_unit(
    column: FileColumn, unit: Unit, signal: ModelSignal, automaton: Automaton
) -> ProposedColumn | None:
    """Return a column with a known unit as a signal: directly, by a parameter, or by a sensor."""
    where = "the file" if column.written else "its name"
    if are_compatible(unit.dimension, signal.dimension):
        reasons = (f"the unit in {where} fits",)
        return ProposedColumn(column, signal, unit.text, "", WEIGHTS["unit"], reasons)
    by_parameter = _scale_by_parameter(unit.dimension, signal.dimension, automaton)
    if by_parameter:
        scale, name = by_parameter
        reasons = (f"the unit in {where} fits with parameter `{name}`",)
        score = WEIGHTS["unit by a parameter"]
        return ProposedColumn(column, signal, unit.text, scale, score, reasons)
    own = quantities_of(unit.dimension) or ({"number"} if unit.dimension.is_number else set())
    wanted = quantities_of(signal.dimension)
    rank = next((k for k, q in enumerate(SENSED_BY) if q in own and SENSED_BY[q] & wanted), None)
    if rank is not None:
        scale = _unit_quotient(signal, unit)
        reasons = (f"the factor of the scale is unknown: `{unit.text}` is no unit of the signal",)
        score = WEIGHTS["unit of a sensor"] + rank * WEIGHTS["rarer sensor"]
        return ProposedColumn(column, signal, unit.text, scale, score, reasons, is_open=True)
    return None


def _without_unit(
    column: FileColumn, meaning: NameMeaning, signal: ModelSignal, automaton: Automaton
) -> ProposedColumn | None:
    """Return a column without a unit as a signal.

    Its unit is that of the signal, or another one of its dimension in which the values are in the
    range of the signal. If the name states another quantity that a parameter without a range
    converts to the signal, it is the unit of that quantity.
    """
    wanted = quantities_of(signal.dimension)
    if meaning.quantities and wanted and not meaning.quantities & wanted:
        units = [parse_unit(text) for q in sorted(meaning.quantities) for text in QUANTITY_UNITS[q]]
        found = (_by_unit(column, unit, signal, automaton) for unit in units)
        sensed = next((line for line in found if line is not None), None)
        reason = f"a {' or '.join(sorted(meaning.quantities))} by its name, without a unit"
        return (
            replace(
                sensed,
                score=sensed.score - WEIGHTS["quantity of a sensor"],
                reasons=(reason,),
                is_open=True,
            )
            if sensed
            else None
        )
    if meaning.letters and wanted and not meaning.letters & wanted:
        for quantity in sorted(meaning.letters):
            for text in QUANTITY_UNITS.get(quantity, ()):
                by_parameter = _scale_by_parameter(
                    parse_unit(text).dimension, signal.dimension, automaton, only_products=True
                )
                if by_parameter:
                    scale, name = by_parameter
                    reason = f"a {quantity} by its name, with parameter `{name}`"
                    score = WEIGHTS["quantity by a parameter"]
                    return ProposedColumn(
                        column, signal, text, scale, score, (reason,), is_open=True
                    )
    unit = _unit_in_range(column, signal)
    reasons = ("no unit in the file",)
    return ProposedColumn(column, signal, unit, "", WEIGHTS["no unit"], reasons, is_open=True)


def _unit_in_range(column: FileColumn, signal: ModelSignal) -> str:
    """Return the unit of a signal, or a usual one in which the values are in its range."""
    own = parse_unit(signal.unit) if signal.unit != "?" else None
    if own is None or signal.range is None or _are_in_range(column.values, own, signal.range):
        return signal.unit
    for units in OTHER_UNITS:
        if any(are_compatible(parse_unit(text).dimension, own.dimension) for text in units):
            for text in units:
                if _are_in_range(column.values, parse_unit(text), signal.range):
                    return text
    return signal.unit


def _are_in_range(values: NDArray[np.float64], unit: Unit, range: Range) -> bool:
    """Return whether values in a unit are in a range in SI, or near it."""
    known = values[np.isfinite(values)]
    if not len(known):
        return True
    low, high = map(float, range)
    margin = RANGE_MARGIN * (high - low)
    scaled = float(unit.factor) * known + float(unit.offset)
    return bool(low - margin <= scaled.min() and scaled.max() <= high + margin)


def _scale_by_parameter(
    unit: Dimension, signal: Dimension, automaton: Automaton, only_products: bool = False
) -> tuple[str, str] | None:
    """Return a scale from the dimension of a column to that of a signal, and its parameter.

    A parameter counts if it has no range, because it is then known. The scale multiplies by it or
    divides by it: `35.1507 N/V`, `1 rad / 0.3183 m`.
    """
    for name, item in automaton.parameters.items():
        if item.value is None or item.range is not None or item.type != "real" or not item.value:
            continue
        if item.unit.dimension.is_number or item.unit.offset:
            continue
        number = f"{float(item.value / item.unit.factor):.15g} {item.unit.text}"
        product = dimension_product(unit, item.unit.dimension)
        if are_compatible(product, signal):
            return number, name
        quotient = dimension_product(unit, item.unit.dimension, -1)
        if not only_products and are_compatible(quotient, signal):
            angle = "rad" if signal.angle == 1 and unit.angle == 0 else ""
            return f"1 {angle} / {number}".replace("  ", " "), name
    return None


def _unit_quotient(signal: ModelSignal, unit: Unit) -> str:
    """Return the scale of 1 from a unit to the unit of a signal, such as `1 N*m/A`."""
    below = "" if unit.text == "1" else "/" + unit.text.replace("*", "/")
    return f"1 {signal.unit}{below}"


def _score_name(
    reading: UnitReading, meaning: NameMeaning, proposed: ProposedColumn, context: frozenset[str]
) -> tuple[float, list[str]]:
    """Return the score of a name for the signal of a proposed line, and the reasons."""
    score, reasons = 0.0, list[str]()
    signal = proposed.signal
    own = signal.meaning
    if reading.stem.casefold() == signal.name.casefold():
        return WEIGHTS["same name"], [SAME_NAME]
    wanted = quantities_of(signal.dimension)
    stated = quantities_of(parse_unit(proposed.unit).dimension) if proposed.scale else frozenset()
    if meaning.quantities & wanted:
        score += WEIGHTS["quantity"]
    elif meaning.quantities - stated and wanted:
        score += WEIGHTS["other quantity"]
    elif meaning.letters and wanted:
        score += WEIGHTS["letter" if meaning.letters & wanted else "other letter"]
    places = meaning.places & own.places
    if places:
        score += WEIGHTS["place"] * len(places)
        reasons.append(f"its name says {' and '.join(sorted(places))}")
    elif meaning.places and own.places:
        score += WEIGHTS["other place"]
    elif meaning.places & context:
        score += WEIGHTS["place of another signal"]
    if ("command" in meaning.roles) != ("command" in own.roles):
        score += WEIGHTS["other role" if "command" in meaning.roles else "no command"]
    elif "command" in own.roles:
        score += WEIGHTS["command"]
        reasons.append("its name says command")
    if "monitor" in meaning.roles and "monitor" not in own.roles:
        score += WEIGHTS["no quantity"]
    words = {word.casefold() for word in split_words(signal.name)}
    if len(words) > 1 and words <= {word.casefold() for word in split_words(reading.stem)}:
        score += WEIGHTS["words in the name"]
        reasons.append("it has the words of the signal")
    shared = meaning.others & own.others
    score += WEIGHTS["other word"] * len(shared)
    if shared:
        reasons.append(f"its name says {' and '.join(sorted(shared))}")
    return score, reasons


def _score_values(
    column: FileColumn, proposed: ProposedColumn, signal: ModelSignal
) -> tuple[float, str]:
    """Return the score of the values of a column for a signal, and a reason or an empty text."""
    known = column.values[np.isfinite(column.values)]
    score = 0.0
    if not np.ptp(known) and SAME_NAME not in proposed.reasons:
        score += WEIGHTS["constant"]
    if proposed.scale:
        return score, ""
    unit = parse_unit(proposed.unit) if proposed.unit != "?" else None
    if unit is None:
        return score, ""
    if signal.type in ("bool", "int", "enum") and np.any(known != np.round(known)):
        return EXCLUDED, ""
    if signal.range is not None:
        if not _are_in_range(column.values, unit, signal.range):
            return score + WEIGHTS["out of range"], ""
        score += WEIGHTS["range"]
    if signal.first and len(known):
        first = float(unit.factor) * known[0] + float(unit.offset)
        span = float(unit.factor) * float(np.ptp(known))
        if abs(first - signal.first) <= RANGE_MARGIN * span:
            return score + WEIGHTS["first value"], "its first value is the initial value"
    return score, ""
