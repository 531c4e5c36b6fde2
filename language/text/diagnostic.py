"""Diagnostics: problems of a user's spec or data with their places, and their rendering as text."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Literal

from language.text.error_codes import code_of
from language.text.sanitise import crop_line, escape_invisible, mask_invisible, truncate

MAX_LABEL_LENGTH = 1000
"""Longest label or help text that is printed [characters]; longer texts are truncated."""

Severity = Literal["error", "warning"]

SIMILARITY_CUTOFF = 0.6
"""Smallest similarity at which a known name is suggested (the default of difflib)."""


@dataclass(frozen=True)
class Source:
    """A text that spans refer to: the name that the user sees and the lines of the text.

    If an effect inserted the lines, `layer` names the effect and its place, and `applied_at` is the
    place in the spec that applies the effect.
    """

    name: str
    lines: tuple[str, ...] = field(repr=False, compare=False, default=())
    layer: str = ""
    applied_at: Span | None = field(repr=False, default=None)


@dataclass(frozen=True, slots=True)
class Span:
    """A place in a source: line and column, counted from 1, and a width of at least 1 character.

    An atomic span belongs to a text that an overlay rewrote: parts of that text have no own place.
    """

    source: Source
    line: int
    column: int
    width: int = 1
    is_atomic: bool = False

    def subspan(self, offset: int, width: int = 1) -> Span:
        """Return the span that starts `offset` characters after the start of this one, on its line.

        An atomic span returns itself. A width below 1 becomes 1. The end is not limited to that of
        this span.
        """
        if self.is_atomic:
            return self
        return Span(self.source, self.line, self.column + offset, max(1, width))

    def __str__(self) -> str:
        """Return `file:line:column`."""
        return f"{self.source.name}:{self.line}:{self.column}"


@dataclass(frozen=True)
class Problem:
    """One mistake of the user: its kind, its place, a label that describes it, and a help text."""

    kind: str
    span: Span
    label: str
    help: str = ""
    severity: Severity = "error"

    @property
    def code(self) -> str:
        """The code of the kind, like `MW201` (docs/problems.md); empty if the kind has none."""
        return code_of(self.kind)


class SpecError(Exception):
    """An error that ends a stage of reading or checking; it carries all problems found so far."""

    def __init__(self, problems: Sequence[Problem]) -> None:
        """Store the problems; the caller renders them."""
        super().__init__(problems)
        self.problems = tuple(problems)

    def __str__(self) -> str:
        """Return the places and labels of all problems on one line, separated by `; `."""
        return "; ".join(f"{p.span}: {p.label}" for p in self.problems)


class Problems:
    """A collector of problems: a stage adds to it and continues after an error where possible."""

    def __init__(self) -> None:
        """Create an empty collector."""
        self.reported: list[Problem] = []

    def error(self, kind: str, span: Span, label: str, help: str = "") -> None:
        """Append a problem of severity "error"."""
        self.reported.append(Problem(kind, span, label, help))

    def warning(self, kind: str, span: Span, label: str, help: str = "") -> None:
        """Append a problem of severity "warning"."""
        self.reported.append(Problem(kind, span, label, help, "warning"))

    @property
    def has_errors(self) -> bool:
        """Return whether the collector holds an error; warnings do not count."""
        return any(p.severity == "error" for p in self.reported)

    def raise_if_errors(self) -> None:
        """Raise SpecError with all problems, warnings included, if one of them is an error.

        With warnings only, or without problems, nothing happens.
        """
        if self.has_errors:
            raise SpecError(self.reported)

    @contextmanager
    def collect_errors(self) -> Iterator[None]:
        """Return a context that catches a SpecError of its body and appends its problems.

        If the problems of the error begin with all that this collector holds, only the remaining
        ones are appended. The SpecError does not leave the context; other exceptions do.
        """
        try:
            yield
        except SpecError as error:
            known = len(self.reported)
            is_ours = error.problems[:known] == tuple(self.reported)
            self.reported.extend(error.problems[known:] if is_ours else error.problems)


def suggest_name(name: str, candidates: Iterable[str]) -> str:
    """Return "did you mean `x`?" with the candidate most similar to `name`, or an empty text.

    The text is empty if no candidate has a similarity (difflib) of at least SIMILARITY_CUTOFF. Of
    equally similar candidates the alphabetically last one is taken.
    """
    matches = difflib.get_close_matches(name, sorted(candidates), n=1, cutoff=SIMILARITY_CUTOFF)
    return f"did you mean `{matches[0]}`?" if matches else ""


def render_problem(problem: Problem) -> str:
    """Return a problem as text: `file:line:col: severity: label [code]`, source line, carets, help.

    The parts are lines; the source line and the carets are indented by two blanks, and the help
    begins with `help: `. Source line and carets are left out if the source does not have that line,
    help and code if they are empty. A last line `in <layer>, applied at <place>` follows if an
    effect inserted the text. Label and help are cut to MAX_LABEL_LENGTH, the source line to
    MAX_LINE_LENGTH around the place; invisible characters are escaped (in the source line
    replaced).
    """
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
        rows.append(f"in {span.source.layer}, applied at {span.source.applied_at}")
    return "\n".join(rows)


def sort_problems(problems: Iterable[Problem]) -> list[Problem]:
    """Return the problems sorted by name of the file, line, column and label, each once.

    Problems are duplicates if all their fields are equal.
    """
    unique = dict.fromkeys(problems)
    return sorted(unique, key=lambda p: (p.span.source.name, p.span.line, p.span.column, p.label))


def render_all(problems: Iterable[Problem]) -> str:
    """Return the problems as one text, each once, sorted by place and separated by blank lines.

    Each is formatted by `render_problem`, in the order of `sort_problems`. Without problems the
    text is empty.
    """
    return "\n\n".join(render_problem(problem) for problem in sort_problems(problems))


class DataError(ValueError):
    """The content of a file or a run prevents what was requested; the request itself is right.

    A ValueError that is no DataError states a wrong argument.
    """


class MissingToolError(Exception):
    """An error for a missing program or package; the message says how to install it."""


class BrokenToolError(MissingToolError):
    """An error for an installed program that does not work; the message has the reason."""


class LargeRunWarning(UserWarning):
    """A run records so many rows that it takes long and may need more memory than there is."""


class AssumptionWarning(UserWarning):
    """A reader of a recording assumed what neither the file nor the map states."""
