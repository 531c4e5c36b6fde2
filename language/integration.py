"""Integration: the method of a field by its name, with the limits of its step (rule 17d)."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from fractions import Fraction
from itertools import product

from language.affine import affine_parts
from language.constants import derive_block
from language.declaration import Formula
from language.euler import euler
from language.evaluate import Scalar, evaluate
from language.exact import exact
from language.exponential import Solved, exponential
from language.field import Field
from language.linear import Point
from language.midpoint import midpoint
from language.model import Automaton
from language.motion import Method
from language.number import rounded
from language.operation import Assign, Block
from language.parameter import tunables_of
from language.problem import Problems, Span
from language.program import MotionInfo, MotionLimit
from language.rk4 import rk4
from language.stability import check_step, limit_of
from language.working import working

STAGES: Mapping[str, Callable[[Field], Method]] = {"euler": euler, "midpoint": midpoint, "rk4": rk4}
SOLVED: Mapping[str, Callable[[Field, Solved, Span, Problems], Method]] = {
    "exponential": exponential,
    "exact": exact,
}
MOST_CORNERS = 10
"""Tunables whose ends are all combined: 2^10 matrices per mode, a second of work."""


def method_of(
    name: str,
    field: Field,
    blocks: Mapping[str, Block],
    point: Point,
    h: Fraction,
    span: Span,
    problems: Problems,
) -> tuple[Method, MotionInfo]:
    """Return a method by name and what it is; problems where its step `h` [s] is too long."""
    step = float(h)
    number = point.automaton.numbers
    rates = {m: working(blocks[f"rates_{m}"], number) for m in field.automaton.modes}
    depends_on = tunables_of(point.automaton, _formulas(field))
    if name in SOLVED and len(depends_on) > MOST_CORNERS:
        label = f"a method with solved numbers takes at most {MOST_CORNERS} tunable parameters"
        problems.error("method", span, label, f"these enter: {', '.join(depends_on)}")
        depends_on = depends_on[:MOST_CORNERS]
    if name == "exact" and field.timed:
        label = "`exact` holds the inputs over a step; one of them changes inside it"
        problems.error("method", span, label, "`exponential` takes them at the middle")
    corners = tuple(_corners(point, depends_on)) if name in SOLVED else ()
    solved = Solved(point, corners, h, rates, depends_on, number)
    limits = []
    for mode in field.automaton.modes:
        parts = affine_parts(rates[mode], field.states, point.values)
        limit = limit_of(field, mode, parts, name)
        if limit:
            check_step(limit, name, step, span, problems)
            value = limit.eigenvalue
            limits.append(MotionLimit(mode, limit.step, value, limit.term, limit.state))
    made = STAGES[name](field) if name in STAGES else SOLVED[name](field, solved, span, problems)
    return made, MotionInfo(
        name, step, made.terms, dict(made.norms), tuple(limits), len(field.states)
    )


def _formulas(field: Field) -> list[Formula]:
    found: list[Formula] = []
    for mode in field.automaton.all_modes:
        found += mode.equations.values()
        for balance in mode.flow.values():
            found += [Formula(balance.left, ""), Formula(balance.right, "")]
    return found


def _corners(point: Point, tunables: tuple[str, ...]) -> Iterator[Mapping[str, Scalar]]:
    """Yield the constants at every combination of the ends of the ranges of some tunables."""
    automaton: Automaton = point.automaton
    limits = {name: automaton.parameters[name].range for name in tunables}
    ranged = {name: limit for name, limit in limits.items() if limit}
    for ends in product(*ranged.values()) if ranged else ():
        values = dict(point.values)
        for name, end in zip(ranged, ends, strict=True):
            values[f"calibration.{name}"] = rounded(end)
        for op in derive_block(automaton):
            assert isinstance(op, Assign)
            values[op.target] = evaluate(op.value, values)
        yield values
