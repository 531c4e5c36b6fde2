"""Symbolic matrices of an observer, derived from a mode of the model."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from contextlib import suppress

from language.expressions.simplify import is_zero, make_number
from language.expressions.syntax_tree import BoolLiteral, Name, NumberLiteral, SyntaxTree, names
from language.lowering.linearisation import (
    LinearisationPoint,
    SymbolicMatrix,
    affine_offset,
    inline_equations,
    sum_affine_terms,
    symbolic_jacobian,
    symbolic_rates,
)
from language.model.automaton import Automaton, Mode, Observer
from language.model.declaration import Formula
from language.numerics.evaluate import Scalar
from language.text.diagnostic import Problems, SpecError, suggest_name


def derive_observer_matrices(
    automaton: Automaton,
    name: str,
    observer: Observer,
    values: Mapping[str, Scalar],
    problems: Problems,
) -> Observer | None:
    """Return an observer with the matrices of its mode of the model, as formulas.

    dx/dt = A x + B u + f and y = C x + g. A, B and C are derivatives at the point `at`; u are the
    real inputs that enter linearly with constant coefficients. f and g hold the other terms, with
    values of states and inputs that are not in x and u. `name` is the mode of this automaton and
    opens the names of constants. An observer without `of` is returned unchanged. None means a
    problem, which is reported: an unknown state, a state that is left out although it moves, a name
    without a value, or an entry of A or C that is not constant.
    """
    model = automaton.model
    if observer.of is None or model is None:
        return observer
    mode = model.modes[observer.of]
    at = {name: formula.tree for name, formula in observer.at.items()}
    with problems.collect_errors():
        known = inline_equations(mode, _default_inputs(automaton, observer))
        flow = symbolic_rates(mode, known)
        _check_states(automaton, observer, mode, flow)
        outputs = _output_equations(observer, mode, known)
        point = LinearisationPoint(automaton, values, at)
        balances = {name: flow[name] for name in observer.states}
        a = symbolic_jacobian(balances, observer.states, point)
        c = symbolic_jacobian(outputs, observer.states, point)
        _check_constant(automaton, observer, {"A": a, "C": c})
        b = _input_matrix(automaton, balances, point)
        inputs = tuple(u for u in automaton.inputs if any(u in row for row in b.values()))
        f, f_constants = _affine_offsets(
            balances, (*observer.states, *inputs), point, f"{name}_f_constant"
        )
        g, g_constants = _affine_offsets(outputs, observer.states, point, f"{name}_g_constant")
        return dataclasses.replace(
            observer,
            inputs=inputs,
            a=_to_formulas(a, f"{observer.key}.A"),
            b=_to_formulas(b, f"{observer.key}.B"),
            c=_to_formulas(c, f"{observer.key}.C"),
            f={row: Formula(tree, f"{observer.key}.of") for row, tree in f.items()},
            g={row: Formula(tree, f"{observer.key}.g.{row}") for row, tree in g.items()},
            constants={
                part: Formula(tree, f"{observer.key}.{part}")
                for part, tree in {**f_constants, **g_constants}.items()
            },
        )
    return None


def _default_inputs(automaton: Automaton, observer: Observer) -> dict[str, SyntaxTree]:
    """Return the defaults of the inputs of the model that the automaton does not have, by name."""
    assert automaton.model
    found: dict[str, SyntaxTree] = {}
    for name, thing in automaton.model.inputs.items():
        if name not in automaton.inputs and thing.default is not None:
            default = thing.default
            truth = BoolLiteral(bool(default), observer.span)
            found[name] = truth if thing.type == "bool" else make_number(default, observer.span)
    return found


def _check_states(
    automaton: Automaton, observer: Observer, mode: Mode, flow: Mapping[str, SyntaxTree]
) -> None:
    """Raise SpecError unless the states of the observer fit the flow of the mode.

    Each state is one of the model; a state that the observer omits has the rate 0, unless a run
    predicts; the balances of the states read only names of the automaton.
    """
    problems = Problems()
    assert automaton.model
    for name in observer.states:
        if name not in flow:
            label = f"`{name}` is not a state of `{automaton.model.name}`"
            problems.error("observer", observer.span, label, suggest_name(name, flow))
    problems.raise_if_errors()
    for name, tree in flow.items():
        if name not in observer.states and not observer.predicts_by_run and not is_zero(tree):
            label = f"`{name}` moves in `{automaton.model.name}.{mode.name}`: the observer has to "
            problems.error("observer", observer.span, f"{label}have it among its states")
    known = {*automaton.parameters, *automaton.inputs, *automaton.states}
    for name in observer.states:
        for read in names(flow[name]):
            if read.path not in known:
                label = f"the balance of `{name}` reads `{read.path}`, which has no value here"
                help = f"give `{automaton.name}` a state or an input `{read.path}`"
                problems.error("observer", observer.span, label, help)
    problems.raise_if_errors()


def _output_equations(
    observer: Observer, mode: Mode, known: Mapping[str, SyntaxTree]
) -> dict[str, SyntaxTree]:
    """Return the expression of each measurement: the inlined equation or the measured state."""
    found: dict[str, SyntaxTree] = {}
    for measure, name in observer.measures.items():
        found[measure] = known[name] if name in mode.equations else Name(name, observer.span)
    return found


def _check_constant(
    automaton: Automaton, observer: Observer, matrices: Mapping[str, SymbolicMatrix]
) -> None:
    """Raise SpecError if an entry of a matrix depends on anything but parameters."""
    problems = Problems()
    known = [(what, row, m[row]) for what, m in matrices.items() for row in m]
    for what, row, entries in known:
        for column, tree in entries.items():
            for name in dict.fromkeys(read.path for read in names(tree)):
                if name not in automaton.parameters:
                    label = f"{what} has no constant entry {row}, {column}: it depends on `{name}`"
                    help = f"give the point: `at: {{{name}: ...}}`, made of parameters"
                    problems.error("observer", observer.span, label, help)
    problems.raise_if_errors()


def _input_matrix(
    automaton: Automaton, balances: Mapping[str, SyntaxTree], point: LinearisationPoint
) -> SymbolicMatrix:
    """Return the columns of B of the inputs that enter linearly with constant coefficients.

    The other inputs stay in f by their values.
    """
    found: SymbolicMatrix = {}
    for name, thing in automaton.inputs.items():
        if thing.type != "real":
            continue
        try:
            column = symbolic_jacobian(balances, (name,), point)
        except SpecError:
            continue
        if all(_is_constant(automaton, row[name]) for row in column.values()):
            for row, entries in column.items():
                found.setdefault(row, {}).update(entries)
    return found


def _affine_offsets(
    trees: Mapping[str, SyntaxTree],
    columns: tuple[str, ...],
    point: LinearisationPoint,
    prefix: str,
) -> tuple[dict[str, SyntaxTree], dict[str, SyntaxTree]]:
    """Return the terms of each tree that are not linear in the columns, and their constant parts.

    An offset that is affine in the other names becomes a sum of slope * value and a constant. The
    constant is named `<prefix>.<row>` unless it is a literal. Rows with the offset 0 are left out.
    """
    found: dict[str, SyntaxTree] = {}
    constants: dict[str, SyntaxTree] = {}
    for row, tree in trees.items():
        left = affine_offset(tree, columns, point)
        reads = dict.fromkeys(read.path for read in names(left))
        values = [name for name in reads if name not in point.automaton.parameters]
        with suppress(SpecError):  # a nonlinear offset is evaluated as it stands
            slopes = symbolic_jacobian({row: left}, values, point).get(row, {})
            if all(_is_constant(point.automaton, slope) for slope in slopes.values()):
                constant = affine_offset(left, values, point)
                if not isinstance(constant, NumberLiteral):
                    constants[f"{prefix}.{row}"] = constant
                    constant = Name(f"{prefix}.{row}", tree.span)
                left = sum_affine_terms(slopes, constant)
        if not is_zero(left):
            found[row] = left
    return found, constants


def _is_constant(automaton: Automaton, tree: SyntaxTree) -> bool:
    """Return whether an expression reads parameters only."""
    return all(read.path in automaton.parameters for read in names(tree))


def _to_formulas(rows: SymbolicMatrix, key: str) -> dict[str, dict[str, Formula]]:
    """Return the entries of a symbolic matrix as formulas; keys are `<key>.<row>.<column>`."""
    return {
        row: {column: Formula(tree, f"{key}.{row}.{column}") for column, tree in entries.items()}
        for row, entries in rows.items()
    }
