"""Linearised: a model whose flows are replaced by their tangents at a point."""

from __future__ import annotations

import dataclasses

from language.linear import (
    LinearisationPoint,
    affine_form,
    affine_offset,
    inline_equations,
    symbolic_jacobian,
    symbolic_rates,
)
from language.model import Automaton, Balance, Mode, ModelRun
from language.problem import Problems, SpecError
from language.syntax import FunctionCall, Name, names


def linearise_model(
    model: Automaton, run: ModelRun, point: LinearisationPoint, problems: Problems
) -> Automaton:
    """Return the model with affine flows: what is linear stays, what is curved has its tangent.

    Equations and guards stay as they are. `point` gives values and parameters, not yet places.
    """
    places = {name: formula.tree for name, formula in (run.linearise or {}).items()}
    there = dataclasses.replace(point, substitutions=places)
    modes = {}
    for name, mode in model.modes.items():
        modes[name] = mode
        with problems.collect_errors():
            modes[name] = _linearise_mode(mode, run, there)
    return dataclasses.replace(model, modes=modes)


def _linearise_mode(mode: Mode, run: ModelRun, point: LinearisationPoint) -> Mode:
    flow = symbolic_rates(mode, inline_equations(mode, {}))
    slopes = symbolic_jacobian(flow, tuple(flow), point)
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
        left = FunctionCall("der", (Name(state, span),), span)
        right = affine_form(slopes.get(state, {}), affine_offset(tree, tuple(flow), point))
        balances[state] = Balance(state, left, right, mode.flow[state].key)
    if problems.has_errors:
        raise SpecError(problems.reported)
    return dataclasses.replace(mode, flow=balances)
