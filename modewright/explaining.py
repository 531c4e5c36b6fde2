"""Explaining: a spec after each pass as text, and the difference of two."""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal

from language.calibration import read_calibration
from language.document import Document
from language.hoist import PASSES
from language.load import automaton_of, command_line_value, lowered, program_of
from language.model_text import model_text
from language.numbers_text import numbers_text
from language.parameter import parameter_kinds
from language.printing import program_text
from language.problem import Problems, SpecError
from language.project import Project, expanded, read_document, with_calibrations
from language.provenance import Row, difference_text, differences, rows, spec_text
from language.system import read_system
from language.tree import one_line

Pass = Literal["document", "model", "lowered", "parameters", "inputs", "program", "numbers"]
Values = Mapping[str, str]


def explained(spec: str, stage: Pass, values: Values, root: Path | None = None) -> str:
    """Return a spec after a pass, as text. Raises SpecError."""
    project = Project(root or Path())
    document = read_document(project.path_of(spec))
    if stage == "document":
        return spec_text(_expanded(document, project).root)
    if document.kind == "calibration":
        return _calibration_text(document, project)
    given = {name: command_line_value(text) for name, text in values.items()}
    automaton = automaton_of(document, project, given)
    if stage == "model":
        return model_text(automaton)
    if stage == "numbers":
        return numbers_text(program_of(automaton))
    program = lowered(automaton)
    for name, run in PASSES.items():
        if stage == "lowered":
            break
        program = run(program)
        if stage == name:
            break
    return program_text(program)


def _calibration_text(document: Document, project: Project) -> str:
    """Return the values of a calibration: SI, compiled in (fixed) or not (tunable), and origin."""
    problems = Problems()
    calibration = read_calibration(document, problems)
    problems.stop_if_any()
    base = read_document(project.path_of(calibration.of.text, calibration.of.span))
    base = with_calibrations(base, [document.source.name], document.name)
    if expanded(base, project).kind == "system":
        instances = read_system(base, project).instances.values()
        automata = {f"{instance.name}.": instance.automaton for instance in instances}
    else:
        automata = {"": automaton_of(base, project)}
    lines = []
    for owner, automaton in automata.items():
        kinds = parameter_kinds(automaton)
        for name, value in calibration.values.items():
            own = name.removeprefix(owner)
            parameter = automaton.parameters.get(own)
            if parameter and ("." not in name or name.startswith(owner)):
                texts = [kinds[own], *([f"std {value.std}"] if value.std else [])]
                texts += [text for text in (value.origin, value.date) if text]
                lines.append(f"{owner}{own} = {one_line(value.value)}  # {', '.join(texts)}")
    return "".join(f"{line}\n" for line in lines)


def compared(spec: str, other: str, stage: Pass, values: Values, root: Path | None = None) -> str:
    """Return what differs between two specs after a pass, as text. Raises SpecError."""
    if stage == "document":
        project = Project(root or Path())
        old, new = (_named(name, project).root for name in (spec, other))
        return difference_text(differences(old, new))
    before, after = (explained(name, stage, values, root).splitlines() for name in (spec, other))
    found = difflib.unified_diff(before, after, spec, other, lineterm="")
    return "".join(f"{line}\n" for line in found)


def explained_json(spec: str, root: Path | None = None) -> dict[str, Any]:
    """Return the values of an expanded spec with their places, as plain data. Raises SpecError."""
    document = _named(spec, Project(root or Path()))
    found = [_row_json(row) for row in rows(document.root)]
    return {"kind": document.kind, "name": document.name, "values": found}


def compared_json(spec: str, other: str, root: Path | None = None) -> dict[str, Any]:
    """Return what differs between two expanded specs, as plain data. Raises SpecError."""
    project = Project(root or Path())
    old, new = (_named(name, project).root for name in (spec, other))
    found = [
        {
            "path": difference.path,
            "old": _row_json(difference.old) if difference.old else None,
            "new": _row_json(difference.new) if difference.new else None,
        }
        for difference in differences(old, new)
    ]
    return {"differences": found}


def _named(spec: str, project: Project) -> Document:
    return _expanded(read_document(project.path_of(spec)), project)


def _expanded(document: Document, project: Project) -> Document:
    problems = Problems()
    made = expanded(document, project, problems)
    if problems.has_errors:
        raise SpecError(problems.found)
    return made


def _row_json(row: Row) -> dict[str, Any]:
    return {
        "path": row.path,
        "value": row.value,
        "place": row.origin.place,
        "layer": row.origin.layer,
        "changes": [{"place": o.place, "layer": o.layer} for o in row.changes],
    }
