"""Stimulus reader: an input over time as a value, steps, ramp, chirp, table, pulses or formula."""

from __future__ import annotations

import itertools
import math
from collections.abc import Collection, Sequence
from fractions import Fraction

from language.expressions.syntax_tree import (
    Arithmetic,
    BoolLiteral,
    Conditional,
    FunctionCall,
    Logic,
    Name,
    Not,
    NumberLiteral,
    Relation,
    SyntaxTree,
    names,
    walk,
)
from language.expressions.units import NO_UNIT, SECOND, Unit, are_compatible, parse_unit
from language.ir.number_type import MAX_FINITE
from language.model.declaration import Formula
from language.model.system import Stimulus, StimulusPiece, SystemInput
from language.readers.base_reader import Reader
from language.readers.difference_literal import read_difference
from language.text.diagnostic import Span
from language.text.document import Entry, MappingNode, ScalarNode, YamlNode
from language.typecheck.infer import TypeChecker
from language.typecheck.name_environment import NameEnvironment

FORMS = ("steps", "ramp", "chirp", "table", "pulses")
"""Keys that give an input as a function of time; at most one is allowed."""
INPUT_KEYS = ("start", *FORMS, "hold")
DISCONTINUOUS = (Conditional, Relation, Logic, Not, BoolLiteral)
"""Nodes of expressions that make a formula of time discontinuous."""
TIME = Unit("s", Fraction(1), SECOND)
PER_SECOND = parse_unit("1/s")
LARGEST_SLOPE = MAX_FINITE["float64"]
"""Largest slope of an input [SI/s]."""
Breakpoint = tuple[Fraction, Fraction]
"""A time [s] and the value (SI) at that time."""


def linear_pieces(points: Sequence[Breakpoint]) -> tuple[StimulusPiece, ...]:
    """Return the pieces of a piecewise linear function through points in ascending order of time.

    It is constant before the first and after the last point. A piece is (start, value, slope); the
    first begins at 0 if the first point is later. Raises IndexError without points,
    ZeroDivisionError for two points of one time.
    """
    pieces = [] if points[0][0] <= 0 else [StimulusPiece(Fraction(0), points[0][1])]
    for (start, value), (end, later) in itertools.pairwise(points):
        pieces.append(StimulusPiece(start, value, (later - value) / (end - start)))
    return (*pieces, StimulusPiece(*points[-1]))


def constant_pieces(points: Sequence[Breakpoint]) -> tuple[StimulusPiece, ...]:
    """Return the pieces of a piecewise constant function: each value holds until the next point.

    Before the first point, from 0 on, it has the first value. Raises IndexError without points.
    """
    first = () if points[0][0] <= 0 else (StimulusPiece(Fraction(0), points[0][1]),)
    return (*first, *(StimulusPiece(*point) for point in points))


class StimulusReader(Reader):
    """Reads the forms of an input in a scenario."""

    def read_stimulus(
        self, entry: Entry, declaration: SystemInput, periods: Collection[Fraction] = ()
    ) -> Stimulus:
        """Return the stimulus of an input; wrong forms are reported and give the constant 0.

        A scalar is a constant, or for a real input a formula of `time` without jumps. A mapping has
        `start` and at most one of FORMS; without one it is the constant `start`. An input that is
        not real has only `steps`, a bool one also `pulses`. `table` is linear, or constant between
        points with `hold: previous`; other forms have no `hold`.

        `periods` [s] are those of the sampled automata that read the input; `pulses` need exactly
        one, which is their length.
        """
        unit, truth = declaration.unit, declaration.is_bool
        if isinstance(entry.node, ScalarNode):
            return Stimulus((self._read_piece(entry.key, entry.node, declaration),), is_bool=truth)
        table = self.read_mapping(entry.node, f"inputs.{entry.key}", INPUT_KEYS)
        forms = [key for key in FORMS if table.get(key) is not None]
        if "hold" in table.entries and forms != ["table"]:
            label = "`hold` belongs to a `table`"
            self.problems.error("form", table.entries["hold"].span, label)
        if forms == ["pulses"]:
            return Stimulus(
                tuple(self._read_pulses(entry, table, declaration, periods)), is_bool=truth
            )
        if len(forms) > 1 or (declaration.type != "real" and forms not in ([], ["steps"])):
            other = table.entries[forms[-1]]
            label = f"`{forms[0]}` and `{forms[-1]}` exclude each other"
            if declaration.type != "real":
                what = "true or false" if truth else "a whole number or a name"
                pulses = ", or `pulses`" if truth else ""
                label = f"an input that is {what} has a value or `steps`{pulses}"
            self.problems.error("form", other.span, label)
            return Stimulus((StimulusPiece(Fraction(0), Fraction(0)),), is_bool=truth)
        if forms == ["table"]:
            return Stimulus(self._read_table(entry, table, unit))
        start = self._read_value(table.get("start"), "start", entry.span, declaration)
        first = StimulusPiece(Fraction(0), start)
        if forms == ["ramp"]:
            return Stimulus(self._read_ramp(table, first, unit))
        if forms == ["chirp"]:
            return Stimulus(self._read_chirp(table, first, unit))
        return Stimulus((first, *self._read_steps(entry, table, declaration)), is_bool=truth)

    def _read_piece(self, name: str, node: ScalarNode, declaration: SystemInput) -> StimulusPiece:
        """Return a value as a piece from time 0; for a real input also a formula of `time`."""
        formula = self.read_expression(node, "input", node.span)
        if formula and declaration.type == "real" and names(formula.tree):
            return StimulusPiece(
                Fraction(0), Fraction(0), formula=self._check_formula(formula, declaration.unit)
            )
        return StimulusPiece(Fraction(0), self._read_value(node, name, node.span, declaration))

    def _check_formula(self, formula: Formula, unit: Unit) -> Formula:
        """Return a formula of `time`; a wrong dimension and discontinuities are reported."""
        check = TypeChecker(
            NameEnvironment({"time": SECOND}, location="in an input"), self.problems
        )
        check.check_quantity(formula.tree, unit.dimension, "the input")
        for part in walk(formula.tree):
            if isinstance(part, DISCONTINUOUS) or (
                isinstance(part, FunctionCall) and part.function == "sign"
            ):
                label = "an input given as a formula of `time` has no jumps"
                self.problems.error("form", part.span, label, "a jump is one of `steps`: an event")
                break
        return formula

    def _read_value(
        self, node: YamlNode | None, what: str, span: Span, declaration: SystemInput
    ) -> Fraction:
        """Return a value of the type of an input as a number; a bool is 0 or 1."""
        if not declaration.is_bool:
            return self.read_typed_value(
                node, what, span, declaration.unit, declaration.type, declaration.values
            )
        scalar = self.read_scalar(node, what, span)
        if scalar and scalar.text not in ("true", "false"):
            label = f"`{what}` is true or false"
            self.problems.error("type", scalar.span, label)
        return Fraction(bool(scalar and scalar.text == "true"))

    def read_time(
        self, node: YamlNode | None, what: str, span: Span, lower_bound: str = "above"
    ) -> Fraction:
        """Return a time [s] like `read_valid_time`; 1 s after a problem."""
        time = self.read_valid_time(node, what, span, lower_bound)
        return Fraction(1) if time is None else time

    def read_valid_time(
        self, node: YamlNode | None, what: str, span: Span, lower_bound: str = "above"
    ) -> Fraction | None:
        """Return a time [s] above zero, or with `lower_bound="at least"` of at least zero.

        A missing node, an expression, another value and another dimension are reported and give
        None. `what` names the time in messages.
        """
        known = len(self.problems.reported)
        value, unit = self.read_quantity(node, what, span, None)
        if len(self.problems.reported) > known:
            return None
        fine = value > 0 or (value == 0 and lower_bound == "at least")
        if not fine or (value and not are_compatible(unit.dimension, SECOND)):
            place = node.span if node else span
            label = f"`{what}` is a time {lower_bound} zero, like `2.5 s`"
            self.problems.error("range", place, label)
            return None
        return value

    def _read_steps(
        self, entry: Entry, table: MappingNode, declaration: SystemInput
    ) -> list[StimulusPiece]:
        """Return one piece for each step; times that do not ascend are reported."""
        pieces: list[StimulusPiece] = []
        for step in self.read_mapping(table.get("steps"), f"inputs.{entry.key}.steps"):
            key = ScalarNode(step.key, step.span)
            time = self.read_valid_time(key, "the time of a step", step.span)
            value = self._read_value(step.node, "step", step.span, declaration)
            if time is None:
                continue
            if pieces and time <= pieces[-1].start:
                self.problems.error("order", step.span, "steps are in the order of time")
            pieces.append(StimulusPiece(time, value))
        return pieces

    def _read_pulses(
        self,
        entry: Entry,
        table: MappingNode,
        declaration: SystemInput,
        periods: Collection[Fraction],
    ) -> list[StimulusPiece]:
        """Return the pieces of a bool input that is true for one tick of its readers at each time.

        Adjacent pulses are merged, overlapping ones are reported.
        """
        pieces = [StimulusPiece(Fraction(0), Fraction(0))]
        node = table.entries["pulses"]
        if not declaration.is_bool or len({*periods}) != 1:
            label = "`pulses` are of an input that is true or false, read by sampled automata of "
            self.problems.error(
                "form", node.span, f"{label}one period", "`steps` give any values at any times"
            )
            return pieces
        if "start" in table.entries:
            label = "`pulses` have no `start`: before and after each the input is false"
            self.problems.error("form", table.entries["start"].span, label)
        (period,) = {*periods}
        for item in self.read_list(node.node, "pulses"):
            time = self.read_valid_time(item, "the time of a pulse", item.span)
            if time is None:
                continue
            if time < pieces[-1].start:
                label = "pulses are in the order of time, a period apart"
                self.problems.error("order", item.span, label)
            if len(pieces) > 1 and time == pieces[-1].start:
                pieces.pop()
            pieces += [StimulusPiece(time, Fraction(1)), StimulusPiece(time + period, Fraction(0))]
        return pieces

    def _read_table(
        self, entry: Entry, table: MappingNode, unit: Unit
    ) -> tuple[StimulusPiece, ...]:
        """Return the pieces through the points of a table.

        They are linear, or constant with `hold: previous`. Problems give the constant 0.
        """
        known = len(self.problems.reported)
        hold = self.read_choice(table.get("hold"), "hold", ("linear", "previous"), "linear")
        points: list[Breakpoint] = []
        for point in self.read_mapping(table.get("table"), f"inputs.{entry.key}.table"):
            key = ScalarNode(point.key, point.span)
            time = self.read_valid_time(key, "the time of a point", point.span, "at least")
            value, _ = self.read_quantity(point.node, "point", point.span, unit)
            if time is None:
                continue
            if points and time <= points[-1][0]:
                self.problems.error("order", point.span, "points are in the order of time")
            points.append((time, value))
        if table.get("start"):
            label = "a `table` has no `start`: before its first point it has the first value"
            self.problems.error("form", table.entries["start"].span, label)
        if not points and len(self.problems.reported) == known:
            self.problems.error("missing", entry.span, "a `table` has at least one point")
        if not points or len(self.problems.reported) > known:
            return (StimulusPiece(Fraction(0), Fraction(0)),)
        if hold != "linear":
            return constant_pieces(points)
        return self._require_finite_slopes(linear_pieces(points), entry.span)

    def _read_time_span(self, table: MappingNode, what: str) -> tuple[Fraction, Fraction]:
        """Return `from` and `to` [s]; an end that is not after the begin is reported."""
        known = len(self.problems.reported)
        begin = self.read_time(table.get("from"), "from", table.span, "at least")
        end = self.read_time(table.get("to"), "to", table.span)
        if end <= begin and len(self.problems.reported) == known:
            self.problems.error("order", table.span, f"a {what} ends after it begins")
        return begin, max(end, begin + Fraction(1, 10**9))

    def _read_ramp(
        self, table: MappingNode, first: StimulusPiece, unit: Unit
    ) -> tuple[StimulusPiece, ...]:
        """Return the pieces of a ramp from the start value to `value`."""
        ramp = self.read_mapping(table.get("ramp"), "ramp", ("from", "to", "value"))
        begin, end = self._read_time_span(ramp, "ramp")
        value, _ = self.read_quantity(ramp.get("value"), "value", ramp.span, unit)
        pieces = linear_pieces([(begin, first.value), (end, value)])
        return self._require_finite_slopes(pieces, ramp.span)

    def _require_finite_slopes(
        self, pieces: tuple[StimulusPiece, ...], span: Span
    ) -> tuple[StimulusPiece, ...]:
        """Return the pieces; the first slope that no float64 holds is reported."""
        steep = next((p for p in pieces if abs(p.slope) > LARGEST_SLOPE), None)
        if steep is not None:
            label = f"from {float(steep.start):g} s on the input is steeper than "
            label += f"{LARGEST_SLOPE:.1e} per second"
            self.problems.error("range", span, label, "a jump is one of `steps`: an event")
        return pieces

    def _read_chirp(
        self, table: MappingNode, first: StimulusPiece, unit: Unit
    ) -> tuple[StimulusPiece, ...]:
        """Return the pieces of a linear chirp: start value, sweep, start value.

        The sweep is start + amplitude * sin(2 pi (f0 s + (f1 - f0) s^2 / (2 T))) with s = t - from,
        T = to - from and `frequency: [f0, f1]`.
        """
        node = table.get("chirp")
        chirp = self.read_mapping(node, "chirp", ("from", "to", "amplitude", "frequency"))
        begin, end = self._read_time_span(chirp, "chirp")
        amplitude = read_difference(self, chirp.get("amplitude"), "amplitude", chirp.span, unit)
        items = self.read_list(chirp.get("frequency"), "frequency")
        rates = [self.read_quantity(item, "frequency", item.span, PER_SECOND)[0] for item in items]
        if len(rates) != 2 or min(rates, default=Fraction(0)) < 0:
            label = "`frequency` is that at the begin and that at the end: `[0.5 Hz, 10 Hz]`"
            self.problems.error("form", chirp.span, label)
            return (first,)
        span = chirp.span
        half_rate = (rates[1] - rates[0]) / (2 * (end - begin))
        if abs(half_rate) > LARGEST_SLOPE:
            label = f"the frequency changes by more than {LARGEST_SLOPE:.1e} Hz per second"
            self.problems.error("range", span, label, "a longer sweep, or frequencies that exist")
            return (first,)
        since = Arithmetic("-", Name("time", span), NumberLiteral(begin, TIME, span), span)
        cycles: SyntaxTree = _product(
            since, _sum(_number(rates[0], span), _product(_number(half_rate, span), since))
        )
        angle = _product(_number(Fraction(2 * math.pi), span), cycles)
        wave = _product(_number(amplitude, span), FunctionCall("sin", (angle,), span))
        formula = Formula(_sum(_number(first.value, span), wave), "chirp")
        sweep_piece = StimulusPiece(begin, first.value, formula=formula)
        lead = () if begin == 0 else (first,)
        return (*lead, sweep_piece, StimulusPiece(end, first.value))


def _number(value: Fraction, span: Span) -> NumberLiteral:
    """Return a literal without a unit."""
    return NumberLiteral(value, NO_UNIT, span)


def _product(left: SyntaxTree, right: SyntaxTree) -> SyntaxTree:
    """Return the expression left * right."""
    return Arithmetic("*", left, right, left.span)


def _sum(left: SyntaxTree, right: SyntaxTree) -> SyntaxTree:
    """Return the expression left + right."""
    return Arithmetic("+", left, right, left.span)
