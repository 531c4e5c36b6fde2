"""Check of an observer: names, and dimensions of its matrices, vectors and noise densities."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping

from language.expressions.syntax_tree import names as names_of
from language.expressions.units import SECOND, Dimension, are_compatible, dimension_product
from language.model.automaton import Automaton, Observer
from language.model.declaration import Formula
from language.text.diagnostic import Problems, suggest_name
from language.typecheck.infer import TypeChecker
from language.typecheck.types import ExprType


def check_observer(
    automaton: Automaton, observer: Observer, kinds: Mapping[str, ExprType], check: TypeChecker
) -> None:
    """Report unknown names of an observer, and entries whose dimension does not fit its equations.

    The equations are dx/dt = A x + B u + f, y = C x. `kinds` are the types of all names of the
    automaton; `check` knows those that formulas may read.

    Also reported are a `correct` that is no bool, an `unknown_instant` of no real input, and a
    formula of `f` or of the process noise that reads an equation, or in `f` a state of the
    observer. If a listed name has no dimension, matrices and vectors are not checked.
    """
    problems = check.problems
    for listed, known, what in (
        (observer.states, automaton.states, "a state"),
        ((*observer.inputs, *observer.measures), automaton.inputs, "an input"),
    ):
        for name in listed:
            if name not in known:
                label = f"`{name}` is not {what}"
                problems.error("name", observer.span, label, suggest_name(name, known))
    if observer.correct is not None and kinds.get(observer.correct) != "truth":
        label = f"`correct` names an input of type bool, `{observer.correct}` is none"
        truths = [name for name, thing in automaton.inputs.items() if thing.is_bool]
        problems.error("name", observer.span, label, suggest_name(observer.correct, truths))
    _check_instants(automaton, observer, check)
    equations = _observed_equations(automaton, observer)
    for measure, state in observer.measures.items():
        if state not in observer.states and state not in equations:
            label = f"`{measure}` measures `{state}`, which is not a state of the observer"
            problems.error(
                "name", observer.span, label, suggest_name(state, [*observer.states, *equations])
            )
    _check_reads(automaton, observer, kinds, problems)
    _check_point(automaton, observer, check)
    named = (*observer.states, *observer.measures, *observer.inputs)
    sizes = {name: kind for name, kind in kinds.items() if isinstance(kind, Dimension)}
    sizes = {**equations, **sizes}
    if all(name in sizes for name in named):
        _check_matrices(observer, sizes, check)
        _check_vectors(observer, sizes, check)
        _check_limits(observer, sizes, check)
        for measure, state in observer.measures.items():
            if (
                not observer.c
                and state in sizes
                and not are_compatible(sizes[measure], sizes[state])
            ):
                label = f"`{measure}` is in `{sizes[measure]}`, `{state}` is in `{sizes[state]}`"
                problems.error("dimension", observer.span, label)


def _check_reads(
    automaton: Automaton, observer: Observer, kinds: Mapping[str, ExprType], problems: Problems
) -> None:
    """Report states of the observer in `f`, and equations in `f` and in the process noise."""
    for formula in observer.f.values():
        for read in names_of(formula.tree):
            if read.path in observer.states:
                label = f"`f` reads the observer's own state `{read.path}`: that belongs into `A`"
                problems.error("observer", read.span, label)
    known = {*automaton.parameters, *automaton.inputs, *automaton.states}
    for formula in (*observer.f.values(), *observer.process_noise.values()):
        for read in names_of(formula.tree):
            if read.path in kinds and read.path not in known:
                label = f"`{read.path}` is an equation: an observer reads states and inputs"
                problems.error("observer", read.span, label)


def _check_instants(automaton: Automaton, observer: Observer, check: TypeChecker) -> None:
    """Report `unknown_instant` entries that name no real input or are not a time."""
    known = [name for name, thing in automaton.inputs.items() if thing.type == "real"]
    for name, formula in observer.unknown_instant.items():
        if name not in known:
            label = f"`unknown_instant` is of real inputs, `{name}` is none"
            check.problems.error("name", formula.span, label, suggest_name(name, known))
        check.check_quantity(formula.tree, SECOND, "unknown_instant")


def _observed_equations(automaton: Automaton, observer: Observer) -> dict[str, Dimension]:
    """Return the dimensions of the equations of the observed mode of the model.

    A measurement may be one of these equations.
    """
    model = automaton.model
    if observer.of is None or model is None:
        return {}
    equations = model.modes[observer.of].equations
    return {name: model.dimensions[name] for name in equations if name in model.dimensions}


def _check_point(automaton: Automaton, observer: Observer, check: TypeChecker) -> None:
    """Report entries of the linearisation point whose dimension differs from that of the name."""
    known = automaton.model.dimensions if automaton.model else {}
    for name, formula in observer.at.items():
        if name in known:
            check.check_quantity(formula.tree, known[name], name)


def _check_matrices(observer: Observer, sizes: Mapping[str, Dimension], check: TypeChecker) -> None:
    """Report entries of A, B and C whose dimension does not fit their row and column."""
    for matrix, per_second in ((observer.a, True), (observer.b, True), (observer.c, False)):
        for row, entries in matrix.items():
            result = _rate_dimension(sizes[row]) if per_second else sizes[row]
            for column, formula in entries.items():
                _check_entry(check, formula, dimension_product(result, sizes[column], -1))


def _check_vectors(observer: Observer, sizes: Mapping[str, Dimension], check: TypeChecker) -> None:
    """Report entries of `f` and of the noise densities with a wrong dimension.

    Process noise of a recursive gain may call `previous`.
    """
    for row, formula in observer.f.items():
        _check_entry(check, formula, _rate_dimension(sizes[row]))
    memory = frozenset({"previous"} if observer.gain == "recursive" else ())
    noise = TypeChecker(
        dataclasses.replace(check.environment, memory_functions=memory), check.problems
    )
    for row, formula in observer.process_noise.items():
        _check_entry(noise, formula, _rate_dimension(dimension_product(sizes[row], sizes[row])))
    for row, formula in observer.measurement_noise.items():
        _check_entry(check, formula, dimension_product(sizes[row], sizes[row]))


def _check_limits(observer: Observer, sizes: Mapping[str, Dimension], check: TypeChecker) -> None:
    """Report variance limits whose dimension is not that of the squared state."""
    for name, limits in observer.variance_limits.items():
        for formula in limits:
            _check_entry(check, formula, dimension_product(sizes[name], sizes[name]))


def _check_entry(check: TypeChecker, formula: Formula, expected: Dimension) -> None:
    """Report an entry of a wrong dimension.

    Its power of the angle is free because entries are quotients.
    """
    check.check_quantity(formula.tree, Dimension(expected.powers, None), formula.key)


def _rate_dimension(dimension: Dimension) -> Dimension:
    """Return the dimension per second, with the same power of the angle."""
    return Dimension(dimension_product(dimension, SECOND, -1).powers, dimension.angle)
