"""Witness: values of states and inputs that show what two guards can do together.

A search over fixed sample points and the boundaries of the guards. What it finds is true, for the
guards are evaluated at the very values shown; that it finds nothing proves nothing.
"""

from __future__ import annotations

import math
from collections import ChainMap
from collections.abc import Callable, Iterator, Mapping, MutableMapping
from dataclasses import dataclass

from language.action import place_of
from language.constants import parameter_constants, values_of
from language.declaration import Range
from language.evaluate import Scalar, evaluate
from language.lower import equations, expression, variable_names
from language.model import Automaton, Mode, Transition
from language.operation import Assign, Expr
from language.parameter import constant_names
from language.problem import Problems
from language.region import one_configuration
from language.syntax import Name, Relation, Tree, names, walk
from language.traversal import expr_names

SAMPLES = 64
"""Points of the search; a guard of one or two linear relations is met within a few."""
MOST_EVALUATIONS = 400_000
"""Expressions evaluated in a search, shared by all pairs of guards: a few seconds."""
DEFAULT_RANGE = (-10.0, 10.0)
"""Searched where a state or input gives no range, in SI."""
PRIMES = (2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37)
SHOWN_DIGITS = (4, 6, 9, 12)
"""Digits of the values shown: the first number of them at which the guards still hold."""

Point = MutableMapping[str, Scalar]


@dataclass(frozen=True)
class Lowered:
    """An expression with the equations that it needs, in order, and what they read from outside."""

    steps: tuple[tuple[str, Expr], ...]
    value: Expr
    reads: tuple[str, ...]


class WitnessSearch:
    """The sample points of one automaton, and what its guards are there."""

    def __init__(self, automaton: Automaton, pairs: int = 1) -> None:
        """Take the parameters' present values; the effort is shared by some pairs of guards."""
        self.automaton = automaton
        self.known: dict[str, Expr] = {
            **constant_names(automaton),
            **variable_names(automaton, "input"),
        }
        self.constants = values_of(parameter_constants(automaton, Problems()))
        self.lowered: dict[tuple[str, int], Lowered | None] = {}
        self.samples: dict[int, Point] = {}
        self.configurations: dict[tuple[str, str], Mode] = {}
        self.share = MOST_EVALUATIONS // max(pairs, 1)
        self.evaluations = 0

    def _mode(self, transition: Transition) -> Mode:
        """Return the source of a transition with the equations of all regions."""
        place = transition.region, transition.source
        if place not in self.configurations:
            self.configurations[place] = one_configuration(self.automaton, transition)
        return self.configurations[place]

    def both(self, first: Transition, second: Transition) -> Point | None:
        """Return values at which two guards of one mode hold together, if some are found."""
        mode = self._mode(first)
        for point in self._points([first.when.tree, second.when.tree], mode):
            if self._hold(first, second, point):
                return _shortened(point, lambda shorter: self._hold(first, second, shorter))
        return None

    def _hold(self, first: Transition, second: Transition, point: Point) -> bool:
        mode = self._mode(first)
        return self._holds(first, mode, point) and self._holds(second, mode, point)

    def refires(self, out: Transition, back: Transition) -> Point | None:
        """Return values at which `out` and `back` fire in turn for ever, if some are found."""
        there = self._mode(back)
        for start in self._points([out.when.tree, back.when.tree], there):
            if self._refires_at(out, back, start):
                return _shortened(start, lambda shorter: self._refires_at(out, back, shorter))
        return None

    def _refires_at(self, out: Transition, back: Transition, start: Point) -> bool:
        here = self._mode(out)
        there = self._mode(back)
        if not self._holds(out, here, start):
            return False
        arrived = self._reset(out, here, start)
        if arrived is None or not self._holds(back, there, arrived):
            return False
        returned = self._reset(back, there, arrived)
        if returned is None or not self._holds(out, here, returned):
            return False
        again = self._reset(out, here, returned)
        return again is not None and self._holds(back, there, again)

    def shown(self, point: Point, trees: list[Tree]) -> str:
        """Return the values of the names that some trees read, directly or through equations."""
        wanted = self._read(trees)
        texts = [
            f"{name} = {_shortest(float(value))}"
            for name, value in ((n.partition(".")[2], v) for n, v in point.items())
            if name in wanted
        ]
        return ", ".join(texts)

    def _read(self, trees: list[Tree]) -> set[str]:
        found: set[str] = set()
        stack = [read.path for tree in trees for read in names(tree)]
        while stack:
            name = stack.pop()
            if name not in found:
                found.add(name)
                for mode in self.automaton.all_modes:
                    if name in mode.equations:
                        stack += [read.path for read in names(mode.equations[name].tree)]
        return found

    def _points(self, guards: list[Tree], mode: Mode) -> Iterator[Point]:
        """Yield the sample points, each also moved onto every boundary that a guard names.

        It ends where the pair has used its share of evaluations: the same ones on every machine.
        """
        self.evaluations = 0
        boundaries = [
            part for guard in guards for part in walk(guard) if isinstance(part, Relation)
        ]
        for index in range(1, SAMPLES + 1):
            if self.evaluations > self.share:
                return
            if index not in self.samples:
                self.samples[index] = self._sample(index)
            point = self.samples[index]
            for boundary in boundaries:
                moved = self._on_boundary(boundary, point, mode)
                if moved is not None:
                    yield moved
            yield point

    def _sample(self, index: int) -> Point:
        ranges: dict[str, Range | None] = {}
        point: dict[str, Scalar] = {}
        for name, thing in self.automaton.inputs.items():
            ranges[f"input.{name}"] = thing.range
        for name, state in self.automaton.states.items():
            ranges[f"state.{name}"] = state.range
        for name, state in self.automaton.discrete.items():
            ranges[f"discrete.{name}"] = state.range
        for position, (name, limits) in enumerate(ranges.items()):
            low, high = (float(limits[0]), float(limits[1])) if limits else DEFAULT_RANGE
            fraction = _radical_inverse(index, PRIMES[position % len(PRIMES)])
            point[name] = low + fraction * (high - low)
        for name, thing in self.automaton.inputs.items():
            if thing.default is not None:
                point[f"input.{name}"] = float(thing.default)
        types = {f"input.{n}": (v.type, v.values) for n, v in self.automaton.inputs.items()}
        for name, variable in self.automaton.discrete.items():
            types[f"discrete.{name}"] = variable.type, variable.values
        for position, (name, (kind, values)) in enumerate(types.items()):
            if kind == "bool":
                point[name] = bool(index >> position % 6 & 1)
            elif kind == "enum":
                point[name] = index % len(values)
            elif kind == "int":
                point[name] = math.floor(point[name])
        return point

    def _on_boundary(self, relation: Relation, point: Point, mode: Mode) -> Point | None:
        for side, other in ((relation.left, relation.right), (relation.right, relation.left)):
            if isinstance(side, Name) and side.path in self.automaton.states:
                value = self._value(other, mode, point)
                if value is not None:
                    return ChainMap({f"state.{side.path}": value}, point)
        return None

    def _holds(self, transition: Transition, mode: Mode, point: Point) -> bool:
        return bool(self._value(transition.when.tree, mode, point))

    def _reset(self, transition: Transition, mode: Mode, point: Point) -> Point | None:
        after: dict[str, Scalar] = {}
        for name, formula in transition.reset.items():
            value = self._value(formula.tree, mode, point)
            if value is None:
                return None
            after[place_of(self.automaton, name)] = value
        return ChainMap(after, point)

    def _value(self, tree: Tree, mode: Mode, point: Point) -> Scalar | None:
        key = (mode.name, id(tree))
        if key not in self.lowered:
            self.lowered[key] = self._lower(tree, mode)
        lowered = self.lowered[key]
        if lowered is None:
            return None
        values: dict[str, Scalar] = {}
        self.evaluations += len(lowered.steps) + 1
        try:
            for name in lowered.reads:
                values[name] = point[name] if name in point else self.constants[name]
            for target, value in lowered.steps:
                values[target] = evaluate(value, values)
            return evaluate(lowered.value, values)
        except (KeyError, OverflowError):
            return None

    def _lower(self, tree: Tree, mode: Mode) -> Lowered | None:
        known = dict(self.known)
        steps: list[tuple[str, Expr]] = []
        try:
            for op in equations(mode, known, "equation.", "", [n.path for n in names(tree)]):
                if not isinstance(op, Assign):
                    return None  # what a region beside sets depends on its mode
                steps.append((op.target, op.value))
            value = expression(tree, known)
        except KeyError:
            return None
        own = {target for target, _ in steps}
        read = {name for part in (value, *(step[1] for step in steps)) for name in expr_names(part)}
        outside = {name for name in read - own if not name.startswith("call ")}
        return Lowered(tuple(steps), value, tuple(sorted(outside)))


def report_refiring(automaton: Automaton, problems: Problems) -> None:
    """Report transitions that fire for ever at one instant, with a witness (rules 9 and 12)."""
    pairs = list(_there_and_back(automaton))
    search = WitnessSearch(automaton, len(pairs)) if pairs else None
    seen: set[frozenset[str]] = set()
    for out, back in pairs if search else ():
        pair = frozenset({out.key, back.key})
        point = search.refires(out, back) if search and pair not in seen else None
        if search and point is not None:
            seen.add(pair)
            _report(search, out, back, point, problems)


def _there_and_back(automaton: Automaton) -> Iterator[tuple[Transition, Transition]]:
    """Yield the pairs of transitions that lead to a mode and back without a wait.

    Assignments on entry and exit are not searched.
    """
    ways: dict[tuple[str, str, str], list[Transition]] = {}
    for mode in automaton.all_modes:
        for way in mode.transitions:
            ways.setdefault((way.region, way.source, way.target), []).append(way)
    for mode in automaton.all_modes:
        for out in mode.transitions:
            target = automaton.target(out)
            acting = any(each.entry or each.exit for each in (mode, target))
            for back in () if acting else ways.get((out.region, out.target, out.source), ()):
                if not out.wait and not back.wait:
                    yield out, back


def _report(
    search: WitnessSearch,
    out: Transition,
    back: Transition,
    point: Mapping[str, Scalar],
    problems: Problems,
) -> None:
    values = search.shown(dict(point), [out.when.tree, back.when.tree])
    path = f"`{out.source}` -> `{out.target}` -> `{back.target}`"
    label = f"this fires again at the same instant, for ever: {path}"
    hint = f"at {values}; write the direction of motion too, like `x >= limit and v > 0 m/s`"
    states = search.automaton.states
    open_ended = [f"`{name}`" for name, state in states.items() if state.range is None]
    if open_ended:
        hint += f", or give {', '.join(open_ended)} a `range` if this is out of reach"
    bare = next((t for t in (back, out) if _has_boundary(t.when.tree, states)), back)
    problems.error("refire", bare.when.span, label, hint)


def _has_boundary(guard: Tree, states: Mapping[str, object]) -> bool:
    """Tell whether a guard holds where a state sits exactly on a limit: `x >= limit`."""
    for part in walk(guard):
        if isinstance(part, Relation) and part.operator in ("<=", ">="):
            sides = (part.left, part.right)
            if any(isinstance(side, Name) and side.path in states for side in sides):
                return True
    return False


def _shortened(point: Point, holds: Callable[[Point], bool]) -> Point:
    """Return a point with as few digits as still show what it shows."""
    for digits in SHOWN_DIGITS:
        shorter: Point = {
            name: value if isinstance(value, bool) else float(f"{value:.{digits}g}")
            for name, value in point.items()
        }
        if holds(shorter):
            return shorter
    return point


def _shortest(value: float) -> str:
    """Return the shortest text that reads back as the value, without a needless `.0`."""
    return next(text for n in (4, 6, 9, 12, 15, 17) if float(text := f"{value:.{n}g}") == value)


def _radical_inverse(index: int, base: int) -> float:
    """Return the van der Corput number of an index in a base, in [0, 1)."""
    result, scale = 0.0, 1.0 / base
    while index > 0:
        index, digit = divmod(index, base)
        result += digit * scale
        scale /= base
    return result
