"""Pass output: print a spec after each pass, what a pass changes, and compare two specs."""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from typing import Any, Literal, get_args

from codegen.passes.pass_list import C_PASSES
from language.ir.printer import format_program
from language.ir.program import Program
from language.loading.load import automaton_of, command_line_value, lower_automaton, program_of
from language.loading.system_reader import read_system
from language.lowering.program_parameters import parameter_kinds
from language.model.printer import format_model
from language.overlays.calibration import read_calibration
from language.overlays.expand_document import (
    Project,
    add_calibrations,
    expand_document,
    read_document,
)
from language.passes.pass_list import LANGUAGE_PASSES
from language.passes.program_pass import ProgramPass, run_each
from language.programs.solved_numbers_report import format_solved_numbers
from language.text.arguments import PathText, to_choice, to_project, to_text
from language.text.diagnostic import Problems, SpecError
from language.text.document import Document, ScalarNode
from language.text.node_edit import format_inline
from language.text.provenance import (
    ProvenanceEntry,
    diff_specs,
    format_diff,
    format_spec,
    provenance_entries,
)
from modewright.api.documents import Values, literals_of
from modewright.api.ir_check import LOWERED
from modewright.runtime.json_format import format_entry

PassName = Literal[
    "document",
    "model",
    "lowered",
    "program",
    "numbers",
    "parameters",
    "inputs",
    "common-subexpressions",
    "unused-parameters",
    "step",
    "unread-results",
    "range-checks",
    "fast-path",
    "inlining",
]
"""Stages whose text is printed, then the passes of the language, then those of the C generator."""
PROGRAM_PASSES: Mapping[str, ProgramPass] = {
    step.name: step for step in (*LANGUAGE_PASSES, *C_PASSES)
}
"""The passes from Program to Program in their order, by name."""


def explain_spec(
    spec: PathText, stage: PassName, values: Values, root: PathText | None = None
) -> str:
    """Return the text of a spec at a stage, or what a pass changes.

    The stages are `document`, `model`, `lowered` (the Program before all passes), `program` (the
    Program of engine and generator) and `numbers` (solved numbers). A key of PROGRAM_PASSES gives
    the difference of the Program before and after this pass. `values` are parameter values;
    `document` ignores them. A calibration has the same text for all stages but `document`: one line
    for each value. Raises SpecError, and ValueError for another stage.
    """
    stage = to_choice(stage, get_args(PassName), "stage")
    if stage in PROGRAM_PASSES and (program := _lowered(spec, values, root)):
        return _format_pass(program, stage)
    return _stage_text(spec, stage, values, root)


def program_after(
    spec: PathText, stop_after: str, values: Values, root: PathText | None = None
) -> str:
    """Return the text of the Program of an automaton after a pass and all passes before it.

    `stop_after` is a key of PROGRAM_PASSES, or `lowered` for no pass. A calibration has one line
    for each value. Raises SpecError, and ValueError for another pass.
    """
    return _stage_text(
        spec, to_choice(stop_after, (LOWERED, *PROGRAM_PASSES), "stop_after"), values, root
    )


def _lowered(spec: PathText, values: Values, root: PathText | None) -> Program | None:
    """Return the Program of an automaton before all passes; None for a calibration."""
    project = to_project(root)
    document = read_document(project.path_of(to_text(spec, "spec")))
    if document.kind == "calibration":
        return None
    return lower_automaton(automaton_of(document, project, _scalars_of(values)))


def _format_pass(program: Program, name: str) -> str:
    """Return the summary of a pass and the difference of a Program before and after it."""
    passes = PROGRAM_PASSES.values()
    result = next(one for one in run_each(program, passes) if one.step.name == name)
    before, after = (_pass_lines(one) for one in (result.before, result.after))
    lines = list(difflib.unified_diff(before, after, "before", "after", lineterm=""))
    title = f"pass {name}: {result.step.summary}"
    return "".join(f"{line}\n" for line in (title, *(lines or ["it changes nothing here"])))


def _pass_lines(program: Program) -> list[str]:
    """Return the lines of a Program, with the marks of blocks that are not inlined."""
    lines = format_program(program).splitlines()
    marks = {f"block {name}": f" ({mark})" for name, mark in program.inlining.items()}
    return [line + marks.get(line, "") for line in lines]


def _scalars_of(values: Values) -> dict[str, ScalarNode]:
    """Return parameter values as scalars."""
    return {name: command_line_value(text) for name, text in literals_of(values).items()}


def _stage_text(spec: PathText, stage: str, values: Values, root: PathText | None) -> str:
    """Return the text of a spec at a stage, or of its Program after a pass."""
    project, scalars = to_project(root), _scalars_of(values)
    document = read_document(project.path_of(to_text(spec, "spec")))
    if stage == "document":
        return format_spec(_expand_document(document, project).root)
    if document.kind == "calibration":
        return _calibration_text(document, project)
    automaton = automaton_of(document, project, scalars)
    if stage == "model":
        return format_model(automaton)
    if stage == "numbers":
        return format_solved_numbers(program_of(automaton))
    if stage == "program":
        return format_program(program_of(automaton))
    program = lower_automaton(automaton)
    if stage != LOWERED:
        results = run_each(program, PROGRAM_PASSES.values())
        program = next(one.after for one in results if one.step.name == stage)
    return "".join(f"{line}\n" for line in _pass_lines(program))


def _calibration_text(document: Document, project: Project) -> str:
    """Return one line for each value of a calibration.

    A line contains the value, `fixed` or `tunable`, the standard deviation, origin and date.
    """
    problems = Problems()
    calibration = read_calibration(document, problems)
    problems.raise_if_errors()
    base = read_document(project.path_of(calibration.of.text, calibration.of.span))
    base = add_calibrations(base, [document.source.name], document.name)
    if expand_document(base, project).kind == "system":
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
                lines.append(f"{owner}{own} = {format_inline(value.value)}  # {', '.join(texts)}")
    return "".join(f"{line}\n" for line in lines)


def compare_specs(
    spec: PathText,
    other: PathText,
    stage: PassName,
    values: Values,
    root: PathText | None = None,
) -> str:
    """Return the difference of two specs after a pass as text; empty if they are equal.

    For `document` the differences are by key; else they are a unified diff of both results of
    stages with `values`, of a pass the Programs after it. Raises SpecError.
    """
    names = to_text(spec, "spec"), to_text(other, "other")
    if stage == "document":
        project = to_project(root)
        old, new = (_load_expanded(name, project).root for name in names)
        return format_diff(diff_specs(old, new))
    stage = to_choice(stage, get_args(PassName), "stage")
    before, after = (_stage_text(name, stage, values, root).splitlines() for name in names)
    found = difflib.unified_diff(before, after, *names, lineterm="")
    return "".join(f"{line}\n" for line in found)


def spec_json(spec: PathText, root: PathText | None = None) -> dict[str, Any]:
    """Return the values of an expanded spec with their places, as a dict for JSON.

    The keys are `format`, `kind`, `name` and `values`: one value for each scalar, list and empty
    mapping, with `path`, `value`, `place`, `layer` (the overlay that gave it) and `changes` (places
    and overlays that replaced earlier values). Raises SpecError.
    """
    document = _load_expanded(to_text(spec, "spec"), to_project(root))
    found = [_row_json(row) for row in provenance_entries(document.root)]
    head = {"kind": document.kind, "name": document.name}
    return {**format_entry("spec"), **head, "values": found}


def spec_differences_json(
    spec: PathText, other: PathText, root: PathText | None = None
) -> dict[str, Any]:
    """Return the differences of two expanded specs as a dict for JSON.

    The keys are `format` and `differences`; each difference has `path`, `old` and `new`, which are
    values as in `spec_json`, or None where a spec lacks the path. Raises SpecError.
    """
    project, names = to_project(root), (to_text(spec, "spec"), to_text(other, "other"))
    old, new = (_load_expanded(name, project).root for name in names)
    found = [
        {
            "path": difference.path,
            "old": _row_json(difference.old) if difference.old else None,
            "new": _row_json(difference.new) if difference.new else None,
        }
        for difference in diff_specs(old, new)
    ]
    return {**format_entry("spec-differences"), "differences": found}


def _load_expanded(spec: str, project: Project) -> Document:
    """Return the expanded document of a spec. Raises SpecError."""
    return _expand_document(read_document(project.path_of(spec)), project)


def _expand_document(document: Document, project: Project) -> Document:
    """Return an expanded document. Raises SpecError with all problems."""
    problems = Problems()
    result = expand_document(document, project, problems)
    if problems.has_errors:
        raise SpecError(problems.reported)
    return result


def _row_json(row: ProvenanceEntry) -> dict[str, Any]:
    """Return a value with place, overlay and changes as a dict for JSON."""
    return {
        "path": row.path,
        "value": row.value,
        "place": row.origin.place,
        "layer": row.origin.layer,
        "changes": [{"place": o.place, "layer": o.layer} for o in row.changes],
    }
