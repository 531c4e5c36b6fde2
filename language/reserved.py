"""Reserved words of the languages in which names of a model end up: see reserved.txt."""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import cache
from importlib import resources

C_MACRO_PATTERN = re.compile(
    r"INFINITY|NAN|HUGE_VAL[FL]?|MATH_ERR\w*|math_errhandling|FP_\w+|(DBL|FLT|LDBL)_\w+|DECIMAL_DIG"
    r"|U?INT\w*_(MAX|MIN|C)|(PTRDIFF|SIZE|WCHAR|WINT|SIG_ATOMIC)_(MAX|MIN)|NULL|errno|M_(E|PI\w*)"
)
"""Macros of the headers that generated code includes."""
FILE_WORDS = frozenset({"main", "ha_math", "float", "math", "stdint", "stdbool", "string"})
"""Names of files beside which an automaton's own files would stand."""
DEVICE_NAME_PATTERN = re.compile(r"(con|prn|aux|nul|com\d|lpt\d)", re.IGNORECASE)
"""File names that Windows keeps for devices, whatever their ending."""


@cache
def reserved_words() -> Mapping[str, frozenset[str]]:
    """Return the words by language: GRAMMAR, YAML, C, C++, A2L, GENERATED."""
    text = resources.files("language").joinpath("reserved.txt").read_text("utf-8")
    sections: dict[str, frozenset[str]] = {}
    for section in text.split("\n[")[1:]:
        head, _, words = section.partition("\n")
        sections[head.partition("]")[0]] = frozenset(words.split())
    return sections
