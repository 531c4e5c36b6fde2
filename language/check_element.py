"""Check of elements and places: no influence on the dynamics, but their names exist."""

from __future__ import annotations

from collections.abc import Mapping

from language.dimension import TypeChecker
from language.kind import ExprType
from language.model import Automaton
from language.problem import Problems, suggest_name
from language.scope import NameEnvironment


def check_elements(automaton: Automaton, names: Mapping[str, ExprType], problems: Problems) -> None:
    """Report names in elements and places that are not there."""
    check = TypeChecker(NameEnvironment(names), problems)
    for element in automaton.elements.values():
        for formula in element.parts.values():
            check.infer_type(formula.tree)
        for name, span in element.far.items():
            if name not in names:
                label = f"`{name}` is not known here"
                problems.error("name", span, label, suggest_name(name, names))
    balanced = {name for mode in automaton.modes.values() for name in mode.flow}
    known = {*balanced, *automaton.inputs, *automaton.outputs}
    for name, formulas in automaton.places.items():
        for formula in formulas.values():
            check.infer_type(formula.tree)
            if name not in known:
                label = f"`{name}` is not a balance, an input or an output"
                problems.error("name", formula.span, label, suggest_name(name, known))
