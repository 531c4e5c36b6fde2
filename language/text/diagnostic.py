"""Problems: mistakes in the user's spec or data, each with its place, collected and rendered."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Literal

from language.text.error_codes import code_of
from language.text.sanitise import crop_line, escape_invisible, mask_invisible, truncate

MAX_LABEL_LENGTH = 1000
"""Characters of a message; a name of a million characters is quoted in part."""

Severity = Literal["error", "warning"]

SIMILARITY_CUTOFF = 0.6
"""Similarity above which a known name is proposed for an unknown one (difflib's own default)."""


@dataclass(frozen=True)
class Source:
    """A text that spans point into: the name shown to the user and the lines of the text.

    `layer` says which effect its lines were laid by, `laid` where that was asked for.
    """

    name: str
    lines: tuple[str, ...] = field(repr=False, compare=False, default=())
    layer: str = ""
    applied_at: Span | None = field(repr=False, default=None)


@dataclass(frozen=True, slots=True)
class Span:
    """A place in a source: line and column count from 1, width in characters (at least 1).

    A `whole` place is that of a text that an overlay rewrote: its parts have no other place.
    """

    source: Source
    line: int
    column: int
    width: int = 1
    is_atomic: bool = False

    def subspan(self, offset: int, width: int = 1) -> Span:
        """Return the span `offset` characters into this one."""
        if self.is_atomic:
            return self
        return Span(self.source, self.line, self.column + offset, max(1, width))

    def __str__(self) -> str:
        """Return `file:line:column`."""
        return f"{self.source.name}:{self.line}:{self.column}"


@dataclass(frozen=True)
class Problem:
    """One mistake of the user: what kind, where, what is wrong, and what would help."""

    kind: str
    span: Span
    label: str
    help: str = ""
    severity: Severity = "error"

    @property
    def code(self) -> str:
        """The number of its kind, like `MW201`: docs/problems.md explains it."""
        return code_of(self.kind)


class SpecError(Exception):
    """Raised where a stage cannot go on: carries all problems found until then."""

    def __init__(self, problems: Sequence[Problem]) -> None:
        """Keep the problems; they are rendered in one place, by the caller."""
        super().__init__(problems)
        self.problems = tuple(problems)

    def __str__(self) -> str:
        """Return all problems in one line."""
        return "; ".join(f"{p.span}: {p.label}" for p in self.problems)


class Problems:
    """A collector: a stage reports into it and goes on as long as that makes sense."""

    def __init__(self) -> None:
        """Start empty."""
        self.reported: list[Problem] = []

    def error(self, kind: str, span: Span, label: str, help: str = "") -> None:
        """Report an error."""
        self.reported.append(Problem(kind, span, label, help))

    def warning(self, kind: str, span: Span, label: str, help: str = "") -> None:
        """Report a warning."""
        self.reported.append(Problem(kind, span, label, help, "warning"))

    @property
    def has_errors(self) -> bool:
        """Tell whether an error (not only warnings) was reported."""
        return any(p.severity == "error" for p in self.reported)

    def raise_if_errors(self) -> None:
        """Raise SpecError with everything found so far, if an error is among it."""
        if self.has_errors:
            raise SpecError(self.reported)

    @contextmanager
    def collect_errors(self) -> Iterator[None]:
        """Take the problems of a SpecError raised inside and go on.

        What it carries may begin with those that are here already: they are taken once.
        """
        try:
            yield
        except SpecError as error:
            known = len(self.reported)
            is_ours = error.problems[:known] == tuple(self.reported)
            self.reported.extend(error.problems[known:] if is_ours else error.problems)


def suggest_name(name: str, candidates: Iterable[str]) -> str:
    """Return "did you mean `x`?" for the known name nearest to `name`, or an empty text."""
    matches = difflib.get_close_matches(name, sorted(candidates), n=1, cutoff=SIMILARITY_CUTOFF)
    return f"did you mean `{matches[0]}`?" if matches else ""


def render_problem(problem: Problem) -> str:
    """Return `file:line:col: severity: label [code]`, the line, carets and the help."""
    span = problem.span
    code = f" [{problem.code}]" if problem.code else ""
    label = truncate(problem.label, MAX_LABEL_LENGTH) + code
    rows = [escape_invisible(f"{span}: {problem.severity}: {label}")]
    if 1 <= span.line <= len(span.source.lines):
        line = span.source.lines[span.line - 1]
        width = max(1, min(span.width, len(line) - span.column + 1))
        text, column, width = crop_line(line, span.column, width)
        rows += [f"  {mask_invisible(text)}", "  " + " " * (column - 1) + "^" * width]
    if problem.help:
        rows.append(escape_invisible(f"help: {truncate(problem.help, MAX_LABEL_LENGTH)}"))
    if span.source.applied_at:
        rows.append(f"in {span.source.layer}, laid at {span.source.applied_at}")
    return "\n".join(rows)


def sort_problems(problems: Iterable[Problem]) -> list[Problem]:
    """Return the problems without repetitions, sorted by file, line and column."""
    unique = dict.fromkeys(problems)
    return sorted(unique, key=lambda p: (p.span.source.name, p.span.line, p.span.column, p.label))


def render_all(problems: Iterable[Problem]) -> str:
    """Return all problems rendered, sorted by place, with blank lines between."""
    return "\n\n".join(render_problem(problem) for problem in sort_problems(problems))


class MissingToolError(Exception):
    """A program or package that is needed is not installed; the message says how to get it."""
