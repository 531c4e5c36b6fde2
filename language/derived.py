"""Derived: an observer's A, B, C and what remains, taken from a mode of the model."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from contextlib import suppress

from language.declaration import Formula
from language.evaluate import Scalar
from language.linear import Point, Rows, inlined, matrix, rates, remains, tangent
from language.model import Automaton, Mode, Observer
from language.problem import Problems, SpecError, nearest
from language.simplify import is_zero, number
from language.syntax import Name, Number, Tree, Truth, names


def with_model(
    automaton: Automaton,
    name: str,
    observer: Observer,
    values: Mapping[str, Scalar],
    problems: Problems,
) -> Observer | None:
    """Return an observer with the matrices of its mode of the model; None where reported.

    dx/dt = A x + B u + f with A and B at the point `at`; f, read each tick, is what remains of the
    balances: it holds the values of states and inputs that are not in x and u. Measurements of
    equations likewise: y = C x + g. `name` is that of the mode here.
    """
    model = automaton.model
    if observer.of is None or model is None:
        return observer
    mode = model.modes[observer.of]
    at = {name: formula.tree for name, formula in observer.at.items()}
    with problems.collecting():
        known = inlined(mode, _absent_inputs(automaton, observer))
        flow = rates(mode, known)
        _check_states(automaton, observer, mode, flow)
        seen = _measured(observer, mode, known)
        point = Point(automaton, values, at)
        balances = {name: flow[name] for name in observer.states}
        a = matrix(balances, observer.states, point)
        c = matrix(seen, observer.states, point)
        _check_constant(automaton, observer, {"A": a, "C": c})
        b = _inputs(automaton, balances, point)
        inputs = tuple(u for u in automaton.inputs if any(u in row for row in b.values()))
        f, f_constants = _rests(balances, (*observer.states, *inputs), point, f"{name}_f_constant")
        g, g_constants = _rests(seen, observer.states, point, f"{name}_g_constant")
        return dataclasses.replace(
            observer,
            inputs=inputs,
            a=_formulas(a, f"{observer.key}.A"),
            b=_formulas(b, f"{observer.key}.B"),
            c=_formulas(c, f"{observer.key}.C"),
            f={row: Formula(tree, f"{observer.key}.of") for row, tree in f.items()},
            g={row: Formula(tree, f"{observer.key}.g.{row}") for row, tree in g.items()},
            constants={
                part: Formula(tree, f"{observer.key}.{part}")
                for part, tree in {**f_constants, **g_constants}.items()
            },
        )
    return None


def _absent_inputs(automaton: Automaton, observer: Observer) -> dict[str, Tree]:
    """Inputs of the model that are none of ours have their default, as in a run."""
    assert automaton.model
    found: dict[str, Tree] = {}
    for name, thing in automaton.model.inputs.items():
        if name not in automaton.inputs and thing.default is not None:
            default = thing.default
            truth = Truth(bool(default), observer.span)
            found[name] = truth if thing.type == "bool" else number(default, observer.span)
    return found


def _check_states(
    automaton: Automaton, observer: Observer, mode: Mode, flow: Mapping[str, Tree]
) -> None:
    """What the observer leaves out stands still in that mode and has a value here."""
    problems = Problems()
    assert automaton.model
    for name in observer.states:
        if name not in flow:
            label = f"`{name}` is not a state of `{automaton.model.name}`"
            problems.error("observer", observer.span, label, nearest(name, flow))
    problems.stop_if_any()
    for name, tree in flow.items():
        if name not in observer.states and not observer.runs and not is_zero(tree):
            label = f"`{name}` moves in `{automaton.model.name}.{mode.name}`: the observer has to "
            problems.error("observer", observer.span, f"{label}have it among its states")
    known = {*automaton.parameters, *automaton.inputs, *automaton.states}
    for name in observer.states:
        for read in names(flow[name]):
            if read.path not in known:
                label = f"the balance of `{name}` reads `{read.path}`, which has no value here"
                help = f"give `{automaton.name}` a state or an input `{read.path}`"
                problems.error("observer", observer.span, label, help)
    problems.stop_if_any()


def _measured(observer: Observer, mode: Mode, known: Mapping[str, Tree]) -> dict[str, Tree]:
    found: dict[str, Tree] = {}
    for measure, name in observer.measures.items():
        found[measure] = known[name] if name in mode.equations else Name(name, observer.span)
    return found


def _check_constant(automaton: Automaton, observer: Observer, matrices: Mapping[str, Rows]) -> None:
    problems = Problems()
    known = [(what, row, m[row]) for what, m in matrices.items() for row in m]
    for what, row, entries in known:
        for column, tree in entries.items():
            for name in dict.fromkeys(read.path for read in names(tree)):
                if name not in automaton.parameters:
                    label = f"{what} has no constant entry {row}, {column}: it depends on `{name}`"
                    help = f"give the point: `at: {{{name}: ...}}`, made of parameters"
                    problems.error("observer", observer.span, label, help)
    problems.stop_if_any()


def _inputs(automaton: Automaton, balances: Mapping[str, Tree], point: Point) -> Rows:
    """The columns of B: of the inputs that enter linearly; any other stays in f by its value."""
    found: Rows = {}
    for name, thing in automaton.inputs.items():
        if thing.type != "real":
            continue
        try:
            column = matrix(balances, (name,), point)
        except SpecError:
            continue
        if all(_is_constant(automaton, row[name]) for row in column.values()):
            for row, entries in column.items():
                found.setdefault(row, {}).update(entries)
    return found


def _rests(
    trees: Mapping[str, Tree], columns: tuple[str, ...], point: Point, prefix: str
) -> tuple[dict[str, Tree], dict[str, Tree]]:
    """Return what is neither A x nor B u, as sums of slope * value and a constant, and these."""
    found: dict[str, Tree] = {}
    constants: dict[str, Tree] = {}
    for row, tree in trees.items():
        left = remains(tree, columns, point)
        reads = dict.fromkeys(read.path for read in names(left))
        values = [name for name in reads if name not in point.automaton.parameters]
        with suppress(SpecError):  # what does not enter linearly is read as it stands
            slopes = matrix({row: left}, values, point).get(row, {})
            if all(_is_constant(point.automaton, slope) for slope in slopes.values()):
                constant = remains(left, values, point)
                if not isinstance(constant, Number):
                    constants[f"{prefix}.{row}"] = constant
                    constant = Name(f"{prefix}.{row}", tree.span)
                left = tangent(slopes, constant)
        if not is_zero(left):
            found[row] = left
    return found, constants


def _is_constant(automaton: Automaton, tree: Tree) -> bool:
    return all(read.path in automaton.parameters for read in names(tree))


def _formulas(rows: Rows, key: str) -> dict[str, dict[str, Formula]]:
    return {
        row: {column: Formula(tree, f"{key}.{row}.{column}") for column, tree in entries.items()}
        for row, entries in rows.items()
    }
