"""Linearised: a model whose flows are replaced by their tangents at a point."""

from __future__ import annotations

import dataclasses

from language.linear import Point, inlined, matrix, rates, remains, tangent
from language.model import Automaton, Balance, Mode, Run
from language.problem import Problems, SpecError
from language.syntax import Application, Name, names


def linearised(model: Automaton, run: Run, point: Point, problems: Problems) -> Automaton:
    """Return the model with affine flows: what is linear stays, what is curved has its tangent.

    Equations and guards stay as they are. `point` gives values and parameters, not yet places.
    """
    places = {name: formula.tree for name, formula in (run.linearise or {}).items()}
    there = dataclasses.replace(point, places=places)
    modes = {}
    for name, mode in model.modes.items():
        modes[name] = mode
        with problems.collecting():
            modes[name] = _linearised(mode, run, there)
    return dataclasses.replace(model, modes=modes)


def _linearised(mode: Mode, run: Run, point: Point) -> Mode:
    flow = rates(mode, inlined(mode, {}))
    slopes = matrix(flow, tuple(flow), point)
    problems = Problems()
    balances = {}
    for state, tree in flow.items():
        for column, slope in slopes.get(state, {}).items():
            for read in names(slope):
                if read.path not in point.automaton.parameters:
                    label = f"the tangent of `{state}` by `{column}` depends on `{read.path}`"
                    help = f"give its point in `linearise`: `at: {{{read.path}: ...}}`"
                    problems.error("method", run.span, label, help)
        if problems.has_errors:
            continue
        span = tree.span
        left = Application("der", (Name(state, span),), span)
        right = tangent(slopes.get(state, {}), remains(tree, tuple(flow), point))
        balances[state] = Balance(state, left, right, mode.flow[state].key)
    if problems.has_errors:
        raise SpecError(problems.found)
    return dataclasses.replace(mode, flow=balances)
