"""Arguments: conversion of the arguments of public functions, with errors that name the argument.

All functions raise TypeError for a value of another type, and ValueError for a value that is not
allowed.
"""

from __future__ import annotations

import math
import os
import reprlib
from collections.abc import Callable, Iterable, Mapping
from numbers import Integral, Real
from pathlib import Path
from typing import NoReturn, TypeVar

from language.text.project_files import Project
from language.text.sanitise import truncate

PathText = str | os.PathLike[str]
"""A name or a path: a text, or a path object such as `pathlib.Path`."""
PathTexts = PathText | Iterable[PathText]
"""One name or path, or several."""
TimeWindow = tuple[float, float]
"""Start and end [s]."""

T = TypeVar("T")


def optional(convert: Callable[[object, str], T], value: object, name: str) -> T | None:
    """Return the result of one of the other functions; None for None."""
    return None if value is None else convert(value, name)


def to_text(value: object, name: str, expected: str = "a name or path (str or Path)") -> str:
    """Return a name or path as text; `expected` describes it in the error."""
    text = os.fspath(value) if isinstance(value, os.PathLike) else value
    if not isinstance(text, str):
        _raise_type_error(value, name, expected)
    return text


def to_path(value: object, name: str) -> Path:
    """Return a path; ValueError for a text with a NUL character, which no path has."""
    text = to_text(value, name)
    if "\0" in text:
        raise ValueError(f"`{name}` is a path, not {reprlib.repr(text)}: it has a NUL character")
    return Path(text)


def to_project(root: object, texts: Mapping[Path, str] | None = None) -> Project:
    """Return the project in the folder `root`; None is the working folder.

    `texts` are those of `Project`. ValueError if `root` is no existing folder.
    """
    return Project(Path() if root is None else _to_folder(root, "root"), texts or {})


def _to_folder(value: object, name: str) -> Path:
    """Return the path of an existing folder; ValueError for another path."""
    folder = to_path(value, name)
    if not os.path.isdir(folder):
        reason = "this is no folder" if os.path.exists(folder) else "there is none"
        raise ValueError(f"`{name}` is an existing folder, not {truncate(str(folder))}: {reason}")
    return folder


def to_texts(value: object, name: str) -> tuple[str, ...]:
    """Return names or paths as texts, in their order; a single one counts as a list of one."""
    if isinstance(value, str | os.PathLike):
        return (to_text(value, name),)
    if not isinstance(value, Iterable) or isinstance(value, bytes | bytearray | Mapping):
        _raise_type_error(value, name, "a list of names or paths")
    return tuple(to_text(each, f"{name}[{position}]") for position, each in enumerate(value))


def to_some_texts(value: object, name: str) -> tuple[str, ...]:
    """Return names or paths as `to_texts`; an empty list raises ValueError."""
    texts = to_texts(value, name)
    if not texts:
        raise ValueError(f"`{name}` is empty: name at least one")
    return texts


def to_mapping(value: object, name: str) -> dict[str, object]:
    """Return a mapping whose keys are texts as a dict."""
    if not isinstance(value, Mapping):
        _raise_type_error(value, name, "a mapping of names to values")
    for key in value:
        if not isinstance(key, str):
            _raise_type_error(key, f"key of {name}", "a name")
    return dict(value)


def to_number(value: object, name: str) -> float:
    """Return a number; NaN raises ValueError, a truth value TypeError."""
    if isinstance(value, bool) or not isinstance(value, Real):
        _raise_type_error(value, name, "a number")
    number = float(value)
    if math.isnan(number):
        raise ValueError(f"`{name}` is a number, not NaN")
    return number


def to_non_negative(value: object, name: str) -> float:
    """Return a number that is not negative."""
    number = to_number(value, name)
    if number < 0.0:
        raise ValueError(f"`{name}` is at least 0, not {number:g}")
    return number


def to_count(value: object, name: str, low: int = 0) -> int:
    """Return a whole number that is at least `low`."""
    if isinstance(value, bool) or not isinstance(value, Integral):
        _raise_type_error(value, name, "a whole number")
    number = int(value)
    if number < low:
        raise ValueError(f"`{name}` is at least {low}, not {number}")
    return number


def to_choice(value: object, choices: Iterable[T], name: str) -> T:
    """Return the one of `choices` that equals a value; ValueError if there is none."""
    known = list(choices)
    for choice in known:
        if isinstance(value, type(choice)) and value == choice:
            return choice
    words = ", ".join(str(choice) for choice in known)
    raise ValueError(f"`{name}` is one of {words}, not {reprlib.repr(value)}")


def to_time_window(value: object, name: str) -> TimeWindow:
    """Return a start and an end [s], which may be infinite; ValueError if the end is earlier."""
    if not isinstance(value, Iterable) or isinstance(value, str | bytes | Mapping):
        _raise_type_error(value, name, "a start and an end [s]")
    ends = [to_number(each, f"{name}[{position}]") for position, each in enumerate(value)]
    if len(ends) != 2 or ends[0] > ends[1]:
        raise ValueError(f"`{name}` is a start and a later end [s], not {reprlib.repr(value)}")
    return ends[0], ends[1]


def require_instance(value: object, kind: type, name: str) -> None:
    """Raise TypeError for a value that is not an object of a class."""
    if not isinstance(value, kind):
        _raise_type_error(value, name, f"an object of class {kind.__name__}")


def _raise_type_error(value: object, name: str, expected: str) -> NoReturn:
    """Raise TypeError for an argument."""
    raise TypeError(f"`{name}` is {expected}, not {reprlib.repr(value)}")
