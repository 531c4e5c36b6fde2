"""Spec: one random spec - its texts, what its inputs are steered to - and its Program."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from language.ir.number_type import NumberType
from language.ir.program import Program
from language.loading.load import automaton_of, program_of
from language.lowering.range_saturation import require_ranges
from language.model.automaton import Automaton
from language.overlays.expand_document import Project, read_document

SHORT: Mapping[NumberType, str] = {"float64": "f64", "float32": "f32"}


@dataclass(frozen=True)
class Aim:
    """An input: its type, its range, and the values at which something changes."""

    name: str
    type: str
    low: float
    high: float
    levels: tuple[float, ...]


@dataclass(frozen=True)
class Spec:
    """The files of a random automaton by name; `waits` are in ticks (or major steps)."""

    name: str
    texts: Mapping[str, str]
    aims: tuple[Aim, ...]
    waits: tuple[int, ...]

    @property
    def text(self) -> str:
        """The text of the automaton itself."""
        return self.texts[self.name]


def automaton(spec: Spec, number: NumberType, folder: Path) -> Automaton:
    """Return the checked automaton of a spec with a number type."""
    home = folder / spec.name / "spec"
    home.mkdir(parents=True, exist_ok=True)
    for name, text in spec.texts.items():
        (home / f"{name}.yaml").write_text(text)
    project = Project(home.parent)
    found = automaton_of(read_document(project.path_of(spec.name)), project)
    if found.is_sampled:
        require_ranges(found)
    return dataclasses.replace(found, numbers=number)


def program(spec: Spec, number: NumberType, folder: Path) -> Program:
    """Return the Program of a spec through the whole front end; its name says the type too."""
    made = program_of(automaton(spec, number, folder))
    return dataclasses.replace(made, name=f"{spec.name}_{SHORT[number]}")
