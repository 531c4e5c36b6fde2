"""Calibrations: export, import and recompute the calibration pages of automata."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from codegen.exchange.calibration.calibration_page import (
    page_characteristics,
    page_constants,
    page_name,
)
from codegen.exchange.calibration.characteristic import PageFile
from codegen.exchange.calibration.file_formats import FORMATS, read_page
from codegen.exchange.calibration.name_filter import NameFilter
from codegen.exchange.calibration.page_import import ImportedValues, import_values
from codegen.exchange.calibration.value_conversion import Remark
from language.ir.program import Constant, Program
from language.loading.load import automaton_of, program_of
from language.model.automaton import Automaton
from language.overlays.expand_document import Project
from language.overlays.literal_format import (
    format_calibration,
    format_value_in_unit,
    has_exact_literal,
)
from language.text.arguments import (
    PathText,
    PathTexts,
    optional,
    to_choice,
    to_path,
    to_project,
    to_text,
)
from language.text.diagnostic import Problem, Problems, Source, Span
from language.text.document import Document, ScalarNode, YamlNode
from language.text.node_edit import format_inline
from modewright.api.documents import Values, load_calibrated_document, parse_values


@dataclass(frozen=True)
class CalibrationPage:
    """The calibration page of an automaton; its solved numbers belong to its parameter values."""

    automaton: Automaton = field(repr=False)
    program: Program = field(repr=False)

    @property
    def tunable(self) -> tuple[Constant, ...]:
        """The constants of the tunable parameters, in the order of the page."""
        return tuple(c for c in page_constants(self.program) if c.kind == "tunable")

    @property
    def solved(self) -> tuple[Constant, ...]:
        """The constants of the solved numbers in the order of the page, after the tunables."""
        return tuple(c for c in page_constants(self.program) if c.kind == "solved")

    def text(self, form: str) -> str:
        """Return the page as the text of a file in the format `dcm`, `cdfx` or `csv`.

        The heading names automaton and number type; the text has no date. Raises ValueError for
        another format.
        """
        known = to_choice(form, FORMATS, "form")
        name, number = self.program.name, self.program.number_type
        heading = (f"calibration page of {name}, {number}, SI units", "written by modewright")
        return FORMATS[known].write(
            name, heading, page_characteristics(self.automaton, self.program)
        )


@dataclass(frozen=True)
class SolvedChange:
    """A solved number that changed; `relative` is |change| over the larger magnitude."""

    name: str
    before: float
    after: float

    @property
    def relative(self) -> float:
        """|after - before| over the larger of |after| and |before|; between 0 and 2."""
        size = max(abs(self.after), abs(self.before))
        return abs(self.after / size - self.before / size)


@dataclass(frozen=True)
class ImportedPage:
    """The values of a calibration file for an automaton.

    `values` are literals of the language by parameter, `stale` the solved numbers in the file that
    belong to other values, `warnings` problems of the file.
    """

    page: CalibrationPage
    values: Mapping[str, str]
    remarks: tuple[Remark, ...]
    stale: tuple[SolvedChange, ...]
    warnings: tuple[Problem, ...]

    def calibration(self, name: str, origin: str = "", date: str = "") -> str:
        """Return the text of a calibration file (YAML) with the imported parameter values.

        `name` is the name of the calibration; an empty `origin` or `date` is left out. Solved
        numbers are not contained.
        """
        return format_calibration(name, self.page.program.name, origin, date, self.values)


@dataclass(frozen=True)
class ResolvedPage:
    """A page with recomputed solved numbers, the changes, and the numbers that were absent
    before.
    """

    page: CalibrationPage
    changes: tuple[SolvedChange, ...]
    added: tuple[str, ...]
    remarks: tuple[Remark, ...] = ()
    warnings: tuple[Problem, ...] = ()


def export_calibration(
    reference: PathText,
    values: Values | None = None,
    root: PathText | None = None,
    calibrations: PathTexts = (),
) -> CalibrationPage:
    """Return the calibration page of an automaton, with calibrations, then `values`, applied.

    Solved numbers are computed for the parameter values as the number type of the automaton stores
    them. Writes no file. Raises SpecError.
    """
    project, scalars = to_project(root), parse_values(values)
    name = to_text(reference, "reference")
    return _build_page(load_calibrated_document(name, project, calibrations), project, scalars)


def import_calibration(
    file: PathText,
    of: PathText,
    root: PathText | None = None,
    form: str | None = None,
    own_only: bool = False,
) -> ImportedPage:
    """Return the values of a calibration file for the automaton `of`, and their page.

    `form` is `dcm`, `cdfx` or `csv`; None takes it from the suffix. Parameters that are not in the
    file keep the value of the spec and get a remark. With `own_only` names that do not begin with
    the name of the automaton and a dot are ignored, each with a remark; else an unknown name is an
    error. Raises SpecError, and ValueError for another `form`.
    """
    project, path, known = to_project(root), to_path(file, "file"), _format_of(form)
    document = load_calibrated_document(to_text(of, "of"), project, ())
    return _import_page(path, known, document, project, {}, own_only)


def resolve_calibration(
    reference: PathText,
    page: PathText | None = None,
    values: Values | None = None,
    root: PathText | None = None,
    calibrations: PathTexts = (),
    form: str | None = None,
) -> ResolvedPage:
    """Return the page of an automaton with solved numbers computed again.

    With the file `page` the parameter values are those of the file, and changes are relative to its
    solved numbers. Without it they are those of `calibrations` and `values`, and changes are
    relative to the spec without both. A solved number that is not in the file or in the spec is in
    `added`. `form` is the format of the file. Raises SpecError, and ValueError for another `form`.
    """
    project, scalars, name = to_project(root), parse_values(values), to_text(reference, "reference")
    path, known = optional(to_path, page, "page"), _format_of(form)
    document = load_calibrated_document(name, project, calibrations)
    if path:
        imported = _import_page(path, known, document, project, scalars)
        absent = [remark.name for remark in imported.remarks if remark.kind == "missing"]
        solved = {page_name(imported.page.program, c) for c in imported.page.solved}
        added = tuple(name for name in absent if name in solved)
        remarks = tuple(remark for remark in imported.remarks if remark.name not in added)
        return ResolvedPage(imported.page, imported.stale, added, remarks, imported.warnings)
    before = _build_page(load_calibrated_document(name, project, ()), project, {})
    after = _build_page(document, project, scalars)
    old = {constant.name: constant.value for constant in before.solved}
    added = tuple(page_name(after.program, c) for c in after.solved if c.name not in old)
    return ResolvedPage(after, _changed_constants(old, after), added)


def _format_of(form: str | None) -> str | None:
    """Return the name of a format; None for None. Raises ValueError, which names the formats."""
    return None if form is None else to_choice(form, FORMATS, "form")


def _import_page(
    file: Path,
    form: str | None,
    document: Document,
    project: Project,
    scalars: Mapping[str, ScalarNode],
    own_only: bool = False,
) -> ImportedPage:
    """Return the values of a calibration file and the page that results from them."""
    problems = Problems()
    automaton = automaton_of(document, project, scalars)
    program = program_of(automaton)
    owned = NameFilter(program.name if own_only else "")
    page_file: PageFile = read_page(file, problems, form, owned)
    found: ImportedValues = import_values(page_file, automaton, program, problems, owned)
    page = _build_page(document, project, {**scalars, **found.values})
    values = {name: format_inline(node) for name, node in found.values.items()}
    return ImportedPage(
        page,
        values,
        found.remarks,
        _changed_constants(found.solved, page),
        tuple(problems.reported),
    )


def _changed_constants(
    before: Mapping[str, float], page: CalibrationPage
) -> tuple[SolvedChange, ...]:
    """Return the solved numbers of a page that differ from those before."""
    return tuple(
        SolvedChange(page_name(page.program, constant), before[constant.name], constant.value)
        for constant in page.solved
        if constant.name in before and constant.value != before[constant.name]
    )


def _build_page(
    document: Document, project: Project, values: Mapping[str, YamlNode]
) -> CalibrationPage:
    """Return a page whose solved numbers fit the rounded parameter values of the page exactly.

    A parameter with more digits than its number type is first rounded to that type.
    """
    automaton = automaton_of(document, project, values)
    program = program_of(automaton)
    solved_for = {name for c in page_constants(program) for name in c.depends_on}
    rounded = {
        name: _stored_value(automaton, program, name)
        for name in sorted(solved_for)
        if automaton.parameters[name].type == "real"
        and not has_exact_literal(automaton.parameters[name], program.number_type)
    }
    if rounded:
        automaton = automaton_of(document, project, {**values, **rounded})
        program = program_of(automaton)
    return CalibrationPage(automaton, program)


def _stored_value(automaton: Automaton, program: Program, name: str) -> ScalarNode:
    """Return the value of a parameter as its number type stores it."""
    value = next(c.value for c in program.constants if c.name == f"calibration.{name}")
    text = format_value_in_unit(automaton.parameters[name], value, program.number_type)
    return ScalarNode(text, Span(Source(f"page of {program.name}", (text,)), 1, 1, len(text)))
