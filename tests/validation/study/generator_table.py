"""Generators of the study and their groups of cases, as `generators.yaml` states them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import yaml

TABLE = Path(__file__).with_name("generators.yaml")
IN_CASE_FOLDER = "in the case folder"
COMPARED = ("full", "clean")
"""Groups on which simpler methods are run as well."""


@dataclass(frozen=True)
class Group:
    """Cases of one kind of a generator.

    `effects` is in the words of the generator, `seed` makes the cases. `without_own` removes the
    effects of a case from the effect library before the diagnosis.
    """

    generator: str
    name: str
    seed: int
    effects: str
    strength: float = 1.0
    without_own: bool = False

    @property
    def key(self) -> str:
        """The name with that of the generator."""
        return f"{self.generator}/{self.name}"


@dataclass(frozen=True)
class Generator:
    """A package that writes cases; `spec` is a spec of the product or `IN_CASE_FOLDER`.

    `fixed` are the words for the cases whose verdicts CI compares with stored ones.
    """

    name: str
    package: str
    spec: str
    about: str
    groups: tuple[Group, ...]
    fixed: str

    @property
    def is_compared(self) -> bool:
        """Whether simpler methods can be run: they know one spec only."""
        return self.spec != IN_CASE_FOLDER


@cache
def _table() -> dict[str, Any]:
    """Return the content of the table."""
    found: dict[str, Any] = yaml.safe_load(TABLE.read_text("utf-8"))
    return found


def study_seed() -> int:
    """Return the seed of the study."""
    return int(_table()["seed"])


def generators(seed: int | None = None) -> tuple[Generator, ...]:
    """Return the generators whose packages exist, with groups for a seed (that of the study)."""
    first = study_seed() if seed is None else seed
    return tuple(
        Generator(
            name,
            one["package"],
            one["spec"],
            one["about"],
            tuple(
                Group(name, group, first + k, _words(more["effects"]), *_options(more))
                for k, (group, more) in enumerate(one["groups"].items())
            ),
            one["fixed"],
        )
        for name, one in _table()["generators"].items()
        if _exists(one["package"])
    )


def _options(group: dict[str, Any]) -> tuple[float, bool]:
    return float(group.get("strength", 1.0)), bool(group.get("without_own", False))


def _words(effects: str) -> str:
    """Return a list of effects without the line breaks of the file."""
    return "".join(effects.split())


def _exists(package: str) -> bool:
    try:
        return find_spec(f"{package}.__main__") is not None
    except ModuleNotFoundError:
        return False
