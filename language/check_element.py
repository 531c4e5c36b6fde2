"""Check of elements and places: no influence on the dynamics, but their names exist."""

from __future__ import annotations

from collections.abc import Mapping

from language.dimension import DimensionCheck
from language.kind import Kind
from language.model import Automaton
from language.problem import Problems, nearest
from language.scope import Scope


def check_laid_on(automaton: Automaton, names: Mapping[str, Kind], problems: Problems) -> None:
    """Report names in elements and places that are not there."""
    check = DimensionCheck(Scope(names), problems)
    for element in automaton.elements.values():
        for formula in element.parts.values():
            check.kind(formula.tree)
        for name, span in element.far.items():
            if name not in names:
                label = f"`{name}` is not known here"
                problems.error("name", span, label, nearest(name, names))
    balanced = {name for mode in automaton.modes.values() for name in mode.flow}
    known = {*balanced, *automaton.inputs, *automaton.outputs}
    for name, formulas in automaton.places.items():
        for formula in formulas.values():
            check.kind(formula.tree)
            if name not in known:
                label = f"`{name}` is not a balance, an input or an output"
                problems.error("name", formula.span, label, nearest(name, known))
