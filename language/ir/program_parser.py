"""Parser of the complete text of a Program, as `serialise_program` prints it.

    parse_program(serialise_program(p)) == p

A text is refused if it does not agree with itself: the attributes of a line belong to its text, and
a block reads and writes exactly the names that it declares.
"""

from __future__ import annotations

import itertools
import json
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any, TypeVar, get_args

from language.ir.expression_parser import ExpressionSyntaxError, parse_expression_text
from language.ir.number_type import NUMBER_TYPES
from language.ir.ops import (
    Assign,
    Block,
    Branch,
    Count,
    Expr,
    FaultBit,
    Loop,
    Op,
    RunBlock,
    Store,
    Switch,
)
from language.ir.printer import ATTRIBUTE_MARK, INDENT, serialise_program
from language.ir.program import (
    Alarm,
    Constant,
    Function,
    IntegrationInfo,
    InvariantInfo,
    ModeInfo,
    ObserverInfo,
    OutputWire,
    Program,
    RegionInfo,
    StabilityLimit,
    TransitionInfo,
    ValueType,
    Variable,
)

RecordT = TypeVar("RecordT")
CITATION = "    # "
"""What separates an operation from its key."""


class ProgramSyntaxError(ValueError):
    """A text that is no Program, with the number of the line."""

    def __init__(self, number: int, message: str) -> None:
        super().__init__(f"line {number}: {message}")


@dataclass(frozen=True)
class _Line:
    """A line of the text: its number from 1, its depth of indentation, its text, its attributes."""

    number: int
    depth: int
    text: str
    attributes: Mapping[str, Any]


def parse_program(text: str) -> Program:
    """Return the Program of a text of `serialise_program`. Raises ProgramSyntaxError."""
    program = _ProgramReader(list(_lines_of(text))).read()
    given, own = text.splitlines(), serialise_program(program).splitlines()
    for number, (line, printed) in enumerate(itertools.zip_longest(given, own), start=1):
        if line != printed:
            raise ProgramSyntaxError(number, _format_difference(line or "", printed or ""))
    return program


def _format_difference(given: str, own: str) -> str:
    """Return how a line differs from the line that its Program has.

    Of attributes it names the first that differs, of a list the elements that are too many or
    missing.
    """
    lines = given.strip(), own.strip()
    if not all(line.startswith(ATTRIBUTE_MARK) for line in lines):
        return f"`{lines[0]}` does not agree with the rest, which gives `{lines[1]}`"
    said, real = (json.loads(line.removeprefix(ATTRIBUTE_MARK)) for line in lines)
    name = next((key for key in (*said, *real) if said.get(key) != real.get(key)), "")
    one, other = said.get(name), real.get(name)
    if isinstance(one, list) and isinstance(other, list):
        surplus = [part for part in one if part not in other]
        missing = [part for part in other if part not in one]
        return f"`{name}` does not agree with the rest: too many {surplus}, missing {missing}"
    return f"`{name}` does not agree with the rest: it is {one!r}, not {other!r}"


def _lines_of(text: str) -> Iterator[_Line]:
    """Yield the lines of a text, attribute lines joined with the line before them."""
    pending: _Line | None = None
    for number, raw in enumerate(text.splitlines(), start=1):
        stripped = raw.lstrip(" ")
        depth, rest = divmod(len(raw) - len(stripped), len(INDENT))
        if rest or not stripped:
            raise ProgramSyntaxError(number, "an indentation is a multiple of four blanks")
        if stripped.startswith(ATTRIBUTE_MARK):
            if pending is None or pending.attributes:
                raise ProgramSyntaxError(number, "attributes without a line before them")
            try:
                attributes = json.loads(stripped.removeprefix(ATTRIBUTE_MARK))
            except json.JSONDecodeError as error:
                raise ProgramSyntaxError(number, f"no JSON: {error}") from error
            pending = replace(pending, attributes=attributes)
            continue
        if pending:
            yield pending
        pending = _Line(number, depth, stripped, {})
    if pending:
        yield pending


class _ProgramReader:
    """A reader of the lines of a Program."""

    def __init__(self, lines: list[_Line]) -> None:
        self.lines = lines
        self.position = 0
        self.whole: set[str] = set()
        self.fields: dict[str, Any] = {"period": None}
        self.modes: list[ModeInfo] = []
        self.regions: dict[str, list[ModeInfo]] = {}
        self.run_modes: list[ModeInfo] = []
        self.transitions: list[TransitionInfo] = []
        self.alarms: list[Alarm] = []
        self.invariants: list[InvariantInfo] = []
        self.faults: list[str] = []
        self.constants: list[Constant] = []
        self.variables: list[Variable] = []
        self.defaults: dict[str, float | bool] = {}
        self.outputs: list[OutputWire] = []
        self.functions: list[Function] = []
        self.blocks: dict[str, Block] = {}
        self.inlining: dict[str, Any] = {}

    def read(self) -> Program:
        """Return the Program of all lines."""
        while self.position < len(self.lines):
            line = self.lines[self.position]
            self.position += 1
            for pattern, read in DECLARATIONS:
                match = re.fullmatch(pattern, line.text)
                if match and line.depth == 0:
                    read(self, line, match)
                    break
            else:
                raise ProgramSyntaxError(line.number, f"no declaration: `{line.text}`")
        missing = {"name", "number_type", "major_step"} - self.fields.keys()
        if missing:
            raise ProgramSyntaxError(1, f"there is no {', '.join(sorted(missing))}")
        return Program(
            constants=tuple(self.constants),
            variables=tuple(self.variables),
            outputs=tuple(self.outputs),
            modes=tuple(self.modes),
            transitions=tuple(self.transitions),
            faults=tuple(self.faults),
            functions=tuple(self.functions),
            blocks=self.blocks,
            run_modes=tuple(self.run_modes),
            defaults=self.defaults,
            regions=tuple(RegionInfo(name, tuple(of)) for name, of in self.regions.items()),
            invariants=tuple(self.invariants),
            alarms=tuple(self.alarms),
            inlining=self.inlining,
            **self.fields,
        )

    def read_program(self, line: _Line, match: re.Match[str]) -> None:
        """Read the name, the observers and the integration."""
        self.fields["name"] = match[1]
        observers = line.attributes.get("observers", ())
        self.fields["observers"] = tuple(_record(line, ObserverInfo, of) for of in observers)
        if motion := line.attributes.get("integration"):
            limits = tuple(
                StabilityLimit(**{**of, "eigenvalue": complex(*of["eigenvalue"])})
                for of in motion["stability_limits"]
            )
            motion = {**motion, "stability_limits": limits}
            self.fields["integration"] = _record(line, IntegrationInfo, motion)

    def read_numbers(self, line: _Line, match: re.Match[str]) -> None:
        """Read the number type."""
        if match[1] not in NUMBER_TYPES:
            raise ProgramSyntaxError(line.number, f"no number type: `{match[1]}`")
        self.fields["number_type"] = match[1]

    def read_step(self, line: _Line, match: re.Match[str]) -> None:
        """Read the period or the major step."""
        step = Fraction(match[2])
        self.fields["period"] = step if match[1] == "period" else None
        self.fields["major_step"] = Fraction(line.attributes.get("major_step", step))

    def read_mode(self, line: _Line, match: re.Match[str]) -> None:
        """Read a mode of the root, of a region or of the model that is run."""
        info = ModeInfo(match[3], int(match[2]))
        if match[1] == "":
            self.modes.append(info)
        elif match[1] == "run ":
            self.run_modes.append(info)
        else:
            name = match[1].removeprefix("region ").rstrip()
            self.regions.setdefault(name, []).append(info)

    def read_transition(self, line: _Line, match: re.Match[str]) -> None:
        """Read a transition."""
        self.transitions.append(_record(line, TransitionInfo, line.attributes))

    def read_alarm(self, line: _Line, match: re.Match[str]) -> None:
        """Read an alarm."""
        self.alarms.append(_record(line, Alarm, line.attributes))

    def read_invariant(self, line: _Line, match: re.Match[str]) -> None:
        """Read an invariant."""
        self.invariants.append(_record(line, InvariantInfo, line.attributes))

    def read_fault(self, line: _Line, match: re.Match[str]) -> None:
        """Read a fault."""
        self.faults.append(match[1])

    def read_constant(self, line: _Line, match: re.Match[str]) -> None:
        """Read a constant."""
        constant = _record(line, Constant, {"name": match[1], **line.attributes})
        self.constants.append(constant)
        if constant.type == "whole":
            self.whole.add(constant.name)

    def read_variable(self, line: _Line, match: re.Match[str]) -> None:
        """Read a variable."""
        head = {"name": match[1], "size": int(match[2] or 0), "type": match[3]}
        variable = _record(line, Variable, {**head, **line.attributes})
        self.variables.append(variable)
        if variable.type == "whole":
            self.whole.add(variable.name)

    def read_default(self, line: _Line, match: re.Match[str]) -> None:
        """Read the default of an input."""
        value = self.parse(line, match[2])
        self.defaults[match[1]] = value.value  # type: ignore[union-attr]

    def read_output(self, line: _Line, match: re.Match[str]) -> None:
        """Read an output."""
        head = {"name": match[1], "source": match[2]}
        self.outputs.append(_record(line, OutputWire, {**head, **line.attributes}))

    def read_function(self, line: _Line, match: re.Match[str]) -> None:
        """Read a function."""
        whole, self.whole = self.whole, set()
        body = self.read_block(1)
        self.whole = whole
        function = _record(line, Function, {"name": match[1], "body": (), **line.attributes})
        self.functions.append(replace(function, body=body))

    def read_named_block(self, line: _Line, match: re.Match[str]) -> None:
        """Read a block of the Program."""
        name = match[1]
        if name in self.blocks:
            raise ProgramSyntaxError(line.number, f"block {name} is there twice")
        self.blocks[name] = self.read_block(1)
        if mark := line.attributes.get("inlining"):
            self.inlining[name] = mark

    def read_block(self, depth: int) -> Block:
        """Return the operations of the next lines with at least a depth of indentation."""
        ops: list[Op] = []
        while self.position < len(self.lines) and self.lines[self.position].depth >= depth:
            line = self.lines[self.position]
            if line.depth > depth:
                raise ProgramSyntaxError(line.number, "the line is indented too far")
            self.position += 1
            ops.append(self.read_op(line, depth))
        return tuple(ops)

    def read_op(self, line: _Line, depth: int) -> Op:
        """Return the operation of a line and of those that belong to it."""
        text, _, key = line.text.partition(CITATION)
        if match := re.fullmatch(r"if (.+)", text):
            then = self.read_block(depth + 1)
            other: Block = ()
            if self.is_next(depth, "else"):
                self.position += 1
                other = self.read_block(depth + 1)
            return Branch(self.parse(line, match[1]), then, other)
        if match := re.fullmatch(r"when (\S+) is (-?\d+)", text):
            cases = [(int(match[2]), self.read_block(depth + 1))]
            while self.is_next(depth, f"when {match[1]} is "):
                following = self.lines[self.position]
                if following.attributes.get("switch") == "new":
                    break
                self.position += 1
                number = int(following.text.removeprefix(f"when {match[1]} is "))
                cases.append((number, self.read_block(depth + 1)))
            return Switch(match[1], tuple(cases))
        if match := re.fullmatch(r"repeat (-?\d+) times as (\S+)", text):
            return Loop(int(match[1]), match[2], self.read_block(depth + 1))
        if match := re.fullmatch(r"count (\S+) up to (-?\d+) while (.+)", text):
            return Count(match[1], self.parse(line, match[3]), int(match[2]), key)
        if match := re.fullmatch(r"(no )?fault (\S+)(?: of (.+))?", text):
            return FaultBit(match[2], match[3] or "", not match[1])
        if match := re.fullmatch(r"run (\S+)", text):
            return RunBlock(match[1])
        if match := re.fullmatch(r"([\w.]+) := (.+)", text):
            return Assign(match[1], self.parse(line, match[2]), key)
        if match := re.fullmatch(r"([\w.]+)\[(.+)\] := (.+)", text):
            return Store(match[1], self.parse(line, match[2]), self.parse(line, match[3]))
        raise ProgramSyntaxError(line.number, f"no operation: `{line.text}`")

    def is_next(self, depth: int, start: str) -> bool:
        """Return whether the next line has a depth and starts with a text."""
        if self.position >= len(self.lines):
            return False
        line = self.lines[self.position]
        return line.depth == depth and line.text.startswith(start)

    def parse(self, line: _Line, text: str) -> Expr:
        """Return the expression of a part of a line."""
        try:
            return parse_expression_text(text, self.whole)
        except ExpressionSyntaxError as error:
            raise ProgramSyntaxError(line.number, f"{error} in `{text}`") from error


FRACTION_FIELDS = ("wait", "time")
"""Fields of records that are exact numbers."""


def _record(line: _Line, kind: Callable[..., RecordT], values: Mapping[str, Any]) -> RecordT:
    """Return a record of its fields as JSON values. Raises ProgramSyntaxError for wrong ones."""
    fields = {
        name: Fraction(value) if name in FRACTION_FIELDS else _to_tuples(value)
        for name, value in values.items()
    }
    try:
        return kind(**fields)
    except TypeError as error:
        raise ProgramSyntaxError(line.number, f"wrong attributes: {error}") from error


def _to_tuples(value: Any) -> Any:
    """Return a JSON value with tuples for lists."""
    if isinstance(value, list):
        return tuple(_to_tuples(part) for part in value)
    if isinstance(value, dict):
        return {name: _to_tuples(part) for name, part in value.items()}
    return value


DECLARATIONS: tuple[tuple[str, Callable[[_ProgramReader, _Line, re.Match[str]], None]], ...] = (
    (r"program (\S+)", _ProgramReader.read_program),
    (r"numbers (\S+)", _ProgramReader.read_numbers),
    (r"(period|major step) (\d+(?:/\d+)?)", _ProgramReader.read_step),
    (r"(|run |region \S+ )mode (-?\d+) (\S+)", _ProgramReader.read_mode),
    (r"transition (-?\d+) .+", _ProgramReader.read_transition),
    (r"alarm .+", _ProgramReader.read_alarm),
    (r"invariant .+", _ProgramReader.read_invariant),
    (r"fault \d+ (\S+)", _ProgramReader.read_fault),
    (r"default input\.(\S+) = (.+)", _ProgramReader.read_default),
    (r"output (\S+) = (\S+)", _ProgramReader.read_output),
    (r"function (\w+)(?: of .+)?", _ProgramReader.read_function),
    (r"block (\S+)", _ProgramReader.read_named_block),
    (r"([a-z_]+\.\S+) = .+", _ProgramReader.read_constant),
    (
        rf"([a-z_]+\.[^\s\[:]+)(?:\[(\d+)\])?: ({'|'.join(get_args(ValueType))}) .+",
        _ProgramReader.read_variable,
    ),
)
"""The declarations of a text: the pattern of a line, and the method that reads it."""
