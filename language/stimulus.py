"""Stimulus reader: an input over time - a value, steps, a ramp, a chirp, a table, a formula."""

from __future__ import annotations

import itertools
import math
from collections.abc import Collection, Sequence
from fractions import Fraction

from language.declaration import Formula
from language.difference import difference
from language.dimension import DimensionCheck
from language.document import Entry, Node, Scalar, Table
from language.experiment import SystemInput
from language.problem import Span
from language.reader import Reader
from language.scope import Scope
from language.signal import Piece, Stimulus
from language.syntax import (
    Application,
    Arithmetic,
    Choice,
    Logic,
    Name,
    Not,
    Number,
    Relation,
    Tree,
    Truth,
    names,
    walk,
)
from language.units import NO_UNIT, SECOND, Unit, fits, parse_unit

FORMS = ("steps", "ramp", "chirp", "table", "pulses")
INPUT_KEYS = ("start", *FORMS, "hold")
JUMPING = (Choice, Relation, Logic, Not, Truth)
TIME = Unit("s", Fraction(1), SECOND)
PER_SECOND = parse_unit("1/s")
Point = tuple[Fraction, Fraction]


def linear(points: Sequence[Point]) -> tuple[Piece, ...]:
    """Return the pieces of a function that is linear between points and held outside them."""
    pieces = [] if points[0][0] <= 0 else [Piece(Fraction(0), points[0][1])]
    for (start, value), (end, later) in itertools.pairwise(points):
        pieces.append(Piece(start, value, (later - value) / (end - start)))
    return (*pieces, Piece(*points[-1]))


def held(points: Sequence[Point]) -> tuple[Piece, ...]:
    """Return the pieces of a function that keeps each value until the next point."""
    first = () if points[0][0] <= 0 else (Piece(Fraction(0), points[0][1]),)
    return (*first, *(Piece(*point) for point in points))


class StimulusReader(Reader):
    """The forms of an input in a scenario, one method each."""

    def stimulus(
        self, entry: Entry, of: SystemInput, periods: Collection[Fraction] = ()
    ) -> Stimulus:
        """Return the stimulus of an input that automata of some periods [s] read."""
        unit, truth = of.unit, of.truth
        if isinstance(entry.node, Scalar):
            return Stimulus((self._piece(entry.key, entry.node, of),), truth=truth)
        table = self.table(entry.node, f"inputs.{entry.key}", INPUT_KEYS)
        forms = [key for key in FORMS if table.get(key) is not None]
        if forms == ["pulses"]:
            return Stimulus(tuple(self._pulses(entry, table, of, periods)), truth=truth)
        if len(forms) > 1 or (of.type != "real" and forms not in ([], ["steps"])):
            other = table.entries[forms[-1]]
            label = f"`{forms[0]}` and `{forms[-1]}` exclude each other"
            if of.type != "real":
                what = "true or false" if truth else "a whole number or a name"
                pulses = ", or `pulses`" if truth else ""
                label = f"an input that is {what} has a value or `steps`{pulses}"
            self.problems.error("form", other.span, label)
            return Stimulus((Piece(Fraction(0), Fraction(0)),), truth=truth)
        if forms == ["table"]:
            return Stimulus(self._table(entry, table, unit))
        start = self._value(table.get("start"), "start", entry.span, of)
        first = Piece(Fraction(0), start)
        if forms == ["ramp"]:
            return Stimulus(self._ramp(table, first, unit))
        if forms == ["chirp"]:
            return Stimulus(self._chirp(table, first, unit))
        return Stimulus((first, *self._steps(entry, table, of)), truth=truth)

    def _piece(self, name: str, node: Scalar, of: SystemInput) -> Piece:
        formula = self.expression(node, "input", node.span)
        if formula and of.type == "real" and names(formula.tree):
            return Piece(Fraction(0), Fraction(0), formula=self._formula(formula, of.unit))
        return Piece(Fraction(0), self._value(node, name, node.span, of))

    def _formula(self, formula: Formula, unit: Unit) -> Formula:
        check = DimensionCheck(Scope({"time": SECOND}, place="in an input"), self.problems)
        check.quantity(formula.tree, unit.dimension, "the input")
        for part in walk(formula.tree):
            if isinstance(part, JUMPING) or (
                isinstance(part, Application) and part.function == "sign"
            ):
                label = "an input given as a formula of `time` has no jumps"
                self.problems.error("form", part.span, label, "a jump is one of `steps`: an event")
                break
        return formula

    def _value(self, node: Node | None, what: str, span: Span, of: SystemInput) -> Fraction:
        if not of.truth:
            return self.value(node, what, span, of.unit, of.type, of.values)
        scalar = self.scalar(node, what, span)
        if scalar and scalar.text not in ("true", "false"):
            label = f"`{what}` is true or false"
            self.problems.error("type", scalar.span, label)
        return Fraction(bool(scalar and scalar.text == "true"))

    def time(self, node: Node | None, what: str, span: Span, least: str = "above") -> Fraction:
        """Return a time above zero, or of at least zero."""
        value, unit = self.quantity(node, what, span, None)
        fine = value > 0 or (value == 0 and least == "at least")
        if not fine or (value and not fits(unit.dimension, SECOND)):
            if not self.problems.has_errors:
                place = node.span if node else span
                label = f"`{what}` is a time {least} zero, like `2.5 s`"
                self.problems.error("range", place, label)
            return Fraction(1)
        return value

    def _steps(self, entry: Entry, table: Table, of: SystemInput) -> list[Piece]:
        found: list[Piece] = []
        for step in self.table(table.get("steps"), f"inputs.{entry.key}.steps"):
            time = self.time(Scalar(step.key, step.span), "the time of a step", step.span)
            value = self._value(step.node, "step", step.span, of)
            if found and time <= found[-1].start:
                self.problems.error("order", step.span, "steps are in the order of time")
            found.append(Piece(time, value))
        return found

    def _pulses(
        self, entry: Entry, table: Table, of: SystemInput, periods: Collection[Fraction]
    ) -> list[Piece]:
        """Return what is true for one period of its reader from each time on: for one tick."""
        found = [Piece(Fraction(0), Fraction(0))]
        node = table.entries["pulses"]
        if not of.truth or len({*periods}) != 1:
            label = "`pulses` are of an input that is true or false, read by sampled automata of "
            self.problems.error(
                "form", node.span, f"{label}one period", "`steps` give any values at any times"
            )
            return found
        if "start" in table.entries:
            label = "`pulses` have no `start`: before and after each the input is false"
            self.problems.error("form", table.entries["start"].span, label)
        (period,) = {*periods}
        for item in self.items(node.node, "pulses"):
            time = self.time(item, "the time of a pulse", item.span)
            if time < found[-1].start:
                label = "pulses are in the order of time, a period apart"
                self.problems.error("order", item.span, label)
            if len(found) > 1 and time == found[-1].start:
                found.pop()
            found += [Piece(time, Fraction(1)), Piece(time + period, Fraction(0))]
        return found

    def _table(self, entry: Entry, table: Table, unit: Unit) -> tuple[Piece, ...]:
        hold = self.choice(table.get("hold"), "hold", ("linear", "previous"), "linear")
        points: list[Point] = []
        for point in self.table(table.get("table"), f"inputs.{entry.key}.table"):
            key = Scalar(point.key, point.span)
            time = self.time(key, "the time of a point", point.span, "at least")
            value, _ = self.quantity(point.node, "point", point.span, unit)
            if points and time <= points[-1][0]:
                self.problems.error("order", point.span, "points are in the order of time")
            points.append((time, value))
        if table.get("start"):
            label = "a `table` has no `start`: before its first point it has the first value"
            self.problems.error("form", table.entries["start"].span, label)
        if not points and not self.problems.has_errors:
            self.problems.error("missing", entry.span, "a `table` has at least one point")
        if not points or self.problems.has_errors:
            return (Piece(Fraction(0), Fraction(0)),)
        return linear(points) if hold == "linear" else held(points)

    def _span_of_time(self, table: Table, what: str) -> tuple[Fraction, Fraction]:
        begin = self.time(table.get("from"), "from", table.span, "at least")
        end = self.time(table.get("to"), "to", table.span)
        if end <= begin and not self.problems.has_errors:
            self.problems.error("order", table.span, f"a {what} ends after it begins")
        return begin, max(end, begin + Fraction(1, 10**9))

    def _ramp(self, table: Table, first: Piece, unit: Unit) -> tuple[Piece, ...]:
        ramp = self.table(table.get("ramp"), "ramp", ("from", "to", "value"))
        begin, end = self._span_of_time(ramp, "ramp")
        value, _ = self.quantity(ramp.get("value"), "value", ramp.span, unit)
        pieces = linear([(begin, first.value), (end, value)])
        return pieces

    def _chirp(self, table: Table, first: Piece, unit: Unit) -> tuple[Piece, ...]:
        """`start` + amplitude * sin(2 pi (f_0 s + (f_1 - f_0) s^2 / (2 T))), s from 0 to T."""
        node = table.get("chirp")
        chirp = self.table(node, "chirp", ("from", "to", "amplitude", "frequency"))
        begin, end = self._span_of_time(chirp, "chirp")
        amplitude = difference(self, chirp.get("amplitude"), "amplitude", chirp.span, unit)
        items = self.items(chirp.get("frequency"), "frequency")
        rates = [self.quantity(item, "frequency", item.span, PER_SECOND)[0] for item in items]
        if len(rates) != 2 or min(rates, default=Fraction(0)) < 0:
            label = "`frequency` is that at the begin and that at the end: `[0.5 Hz, 10 Hz]`"
            self.problems.error("form", chirp.span, label)
            return (first,)
        span = chirp.span
        sweep = (rates[1] - rates[0]) / (2 * (end - begin))
        since = Arithmetic("-", Name("time", span), Number(begin, TIME, span), span)
        turns: Tree = _product(
            since, _sum(_number(rates[0], span), _product(_number(sweep, span), since))
        )
        angle = _product(_number(Fraction(2 * math.pi), span), turns)
        wave = _product(_number(amplitude, span), Application("sin", (angle,), span))
        formula = Formula(_sum(_number(first.value, span), wave), "chirp")
        moving = Piece(begin, first.value, formula=formula)
        still = () if begin == 0 else (first,)
        return (*still, moving, Piece(end, first.value))


def _number(value: Fraction, span: Span) -> Number:
    return Number(value, NO_UNIT, span)


def _product(left: Tree, right: Tree) -> Tree:
    return Arithmetic("*", left, right, left.span)


def _sum(left: Tree, right: Tree) -> Tree:
    return Arithmetic("+", left, right, left.span)
