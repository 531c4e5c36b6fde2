"""Signal words: what the words in the name of a column or of a signal say about it."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from language.expressions.unit_spellings import unit_meanings
from language.expressions.units import Dimension, Unit, parse_unit

WORD = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|\d+")
"""Pattern of a word in a name: `iq_A`, `motorSpeed`, `tau1`."""
BRACKETS = re.compile(r"\s*(?:\[[^\[\]]*\]|\([^()]*\))\s*$")
"""Pattern of a unit in brackets at the end of a name."""
UNIT_SUFFIXES = {
    "nm": "N*m", "radps": "rad/s", "rads": "rad/s", "rad_s": "rad/s", "rad_per_s": "rad/s",
    "deg_s": "deg/s", "deg_per_s": "deg/s", "km_h": "km/h", "kmh": "km/h", "m_s": "m/s",
    "m_per_s": "m/s", "mm_s": "mm/s", "m_s2": "m/s^2", "mps": "m/s", "mps2": "m/s^2",
    "rad_s2": "rad/s^2", "kn": "kN", "n": "N", "mm": "mm", "m": "m", "v": "V", "a": "A",
    "degc": "degC", "counts": "1", "count": "1", "ticks": "1",
}  # fmt: skip
"""Units by the suffixes of names, in lower case, that are no spelling of a unit as they stand."""
MAX_SUFFIX_WORDS = 3
"""Largest number of words of a suffix."""

QUANTITY_WORDS: Mapping[str, tuple[str, ...]] = {
    "torque": ("torque", "trq", "tq", "tau", "moment", "drehmoment"),
    "force": ("force", "frc", "kraft"),
    "speed": ("speed", "spd", "velocity", "vel", "rpm", "omega", "drehzahl", "rate"),
    "position": ("position", "pos", "angle", "ang", "theta", "th", "phi", "displacement", "travel"),
    "acceleration": ("acceleration", "acc", "accel"),
    "current": ("current", "curr", "cur", "iq", "strom"),
    "voltage": ("voltage", "volt", "spannung"),
    "temperature": ("temperature", "temp", "temperatur"),
    "pressure": ("pressure", "press", "druck"),
    "power": ("power", "leistung"),
}
"""Quantities, and the words in names that state them."""
QUANTITY_LETTERS: Mapping[str, tuple[str, ...]] = {
    "T": ("torque", "temperature"), "M": ("torque",), "F": ("force",),
    "w": ("speed",), "n": ("speed",), "v": ("speed", "voltage"), "dq": ("speed",),
    "x": ("position",), "q": ("position",), "p": ("pressure", "position"), "s": ("position",),
    "i": ("current",), "I": ("current",), "u": ("voltage",), "U": ("voltage",), "V": ("voltage",),
    "a": ("acceleration",), "P": ("power",),
}  # fmt: skip
"""Quantities that the first letter or letters of a name can state, by convention."""
QUANTITY_UNITS: Mapping[str, tuple[str, ...]] = {
    "torque": ("N*m",),
    "force": ("N",),
    "speed": ("rad/s", "m/s"),
    "position": ("rad", "m"),
    "acceleration": ("m/s^2", "rad/s^2"),
    "current": ("A",),
    "voltage": ("V",),
    "temperature": ("K",),
    "pressure": ("Pa",),
    "power": ("W",),
}
"""SI units of quantities."""
PLACE_WORDS: Mapping[str, tuple[str, ...]] = {
    "motor": ("motor", "mot", "em", "engine", "eng", "machine", "drive", "mtr"),
    "wheel": ("wheel", "wheels", "whl", "wh", "w"),
    "brake": ("brake", "brk", "br"),
    "vehicle": ("vehicle", "veh", "car"),
    "shaft": ("shaft", "hs", "halfshaft"),
    "link": ("link", "arm"),
    "load": ("load", "ld"),
    "battery": ("battery", "batt", "bat"),
    "inverter": ("inverter", "inv"),
    "ambient": ("ambient", "amb", "out", "outside", "env", "air"),
}
"""Parts of machines, and the words in names that state them."""
ROLE_WORDS: Mapping[str, tuple[str, ...]] = {
    "command": (
        *("ref", "reference", "req", "request", "requested", "set", "setpoint", "sp", "des"),
        *("desired", "cmd", "command", "target", "tgt", "soll", "demand", "dem"),
    ),
    "measured": ("meas", "measured", "act", "actual", "ist", "fb", "feedback"),
    "monitor": (
        *("counter", "cnt", "alive", "aliv", "crc", "checksum", "chksum", "lsb", "msb", "mux"),
        *("status", "stat", "qualifier", "qu", "flag", "valid", "error", "err", "fault"),
        *("max", "maximum", "min", "minimum", "limit", "lim"),
    ),
}
"""Roles of signals, and the words in names that state them."""
SIDE_WORDS = (
    ("a", "b", "c", "d"),
    ("l", "r"),
    ("left", "right"),
    ("fl", "fr", "rl", "rr"),
    ("front", "rear"),
    ("1", "2", "3", "4"),
)
"""Words that distinguish sensors of one quantity."""


@dataclass(frozen=True)
class NameMeaning:
    """What a name says: words of `quantities` and letters that may stand for them, and the rest.

    `quantities` are stated by a word, `letters` by the convention of a first letter. `places` are
    parts of a machine, `roles` are `command`, `measured` or `monitor` (a counter, a status or a
    limit instead of the quantity), and `others` the words without a known
    meaning.
    """

    quantities: frozenset[str]
    letters: frozenset[str]
    places: frozenset[str]
    roles: frozenset[str]
    others: frozenset[str]


@dataclass(frozen=True)
class UnitReading:
    """One reading of a name: the words of the name without its unit, and the unit or None."""

    stem: str
    unit: Unit | None


def split_words(name: str) -> list[str]:
    """Return the words of a name, such as `motor`, `Speed`, `1` of `motorSpeed1`."""
    return WORD.findall(BRACKETS.sub("", name.rpartition(".")[2]))


def read_unit_suffix(name: str) -> tuple[UnitReading, ...]:
    """Return the readings of a name by the unit in its last words; the last one has no unit.

    A suffix of several words is preferred. A single letter is a unit in the case of the unit only,
    because it is often a part of a machine: `T_m` is a torque of the motor, `batt_A` a current.
    """
    stem = BRACKETS.sub("", name.rpartition(".")[2])
    parts = stem.split("_")
    readings = []
    for count in range(min(MAX_SUFFIX_WORDS, len(parts) - 1), 0, -1):
        suffix = "_".join(parts[-count:])
        units = () if suffix.isdigit() else _units_of_suffix(suffix, count)
        readings += [UnitReading("_".join(parts[:-count]), unit) for unit in units]
    return (*readings, UnitReading(stem, None))


def _units_of_suffix(suffix: str, count: int) -> tuple[Unit, ...]:
    """Return the units that the last `count` words of a name can state."""
    known = UNIT_SUFFIXES.get(suffix.lower())
    if known is not None:
        is_letter = len(suffix) == 1 and suffix != parse_unit(known).text
        return () if is_letter else (parse_unit(known),)
    return unit_meanings(suffix)[:1] if count == 1 else ()


def read_meaning(stem: str) -> NameMeaning:
    """Return what the words of a name without its unit say."""
    words = split_words(stem)
    quantities: set[str] = set()
    letters: set[str] = set()
    places: set[str] = set()
    roles: set[str] = set()
    others: set[str] = set()
    for k, word in enumerate(words):
        low = word.lower()
        found = _concepts(low, QUANTITY_WORDS)
        place = _concepts(low, PLACE_WORDS) if k or len(low) > 1 else set()
        role = _concepts(low, ROLE_WORDS)
        if low == "m" and k:
            place = {"motor"}
        quantities |= found
        places |= place
        roles |= role
        if k == 0 and not found and not place:
            letters |= _quantities_of_letters(word)
            if word in ("y", "Y"):
                roles.add("measured")
        if not found and not place and not role and not word.isdigit() and len(low) > 1:
            others.add(low)
    return NameMeaning(*map(frozenset, (quantities, letters, places, roles, others)))


def _concepts(word: str, table: Mapping[str, Sequence[str]]) -> set[str]:
    """Return the concepts of a table that a word states."""
    return {concept for concept, words in table.items() if word in words}


def _quantities_of_letters(word: str) -> set[str]:
    """Return the quantities that the first letters of a short word can state."""
    if len(word) > 3:
        return set()
    return set(QUANTITY_LETTERS.get(word[:2], ()) or QUANTITY_LETTERS.get(word[:1], ()))


def quantities_of(dimension: Dimension) -> frozenset[str]:
    """Return the quantities of a dimension; the power of the angle does not count."""
    if not any(dimension.powers):
        return frozenset(["position"] if dimension.angle == 1 else [])
    return frozenset(
        quantity
        for quantity, units in QUANTITY_UNITS.items()
        if any(parse_unit(unit).dimension.powers == dimension.powers for unit in units)
    )


def side_of(name: str) -> tuple[tuple[str, ...], str]:
    """Return the words of a name without the one that states a side, and that word.

    The second value is empty if the name has none.
    """
    words = [word.lower() for word in split_words(name)]
    for k in range(len(words) - 1, -1, -1):
        if any(words[k] in sides for sides in SIDE_WORDS):
            return tuple(words[:k] + words[k + 1 :]), words[k]
    return tuple(words), ""
