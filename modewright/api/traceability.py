"""Traceability: relate requirements and keys of specs to C code and tests."""

from __future__ import annotations

import csv
import dataclasses
import io
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from codegen.emit.c_module import emit_c_files
from expectation.expectations import Test
from expectation.key_trace import KeyTraces, build_key_traces
from expectation.requirement_trace import RequirementTrace, trace_requirements
from language.loading.instance_expansion import expand_instances
from language.loading.load import automaton_of, program_of
from language.loading.system_reader import read_system
from language.model.automaton import Automaton
from language.overlays.expand_document import Project, expand_document, read_document
from language.text.arguments import (
    PathText,
    PathTexts,
    optional,
    to_path,
    to_project,
    to_some_texts,
)
from language.text.diagnostic import Problems
from language.text.document import Document, ScalarNode, read_text
from language.text.node_edit import find_node, mapping_entries
from modewright.api.spec_tests import find_tests, load_tests, run_test

SHARED_FILES = ("ha_math", "ha_page")
"""Begins of the names of C files that all automata share."""
HEADINGS = ("name", "id", "requirement")
"""First cells, in lower case, that mark a row as headings."""


def trace(
    specs: PathTexts,
    listed: PathText | None = None,
    root: PathText | None = None,
    *,
    run: bool = False,
) -> RequirementTrace:
    """Return the requirements that specs, their C and the tests of the project name.

    A system includes the automata of its instances and their models. Only tests that run one of
    these specs count; for specs of the distribution its tests count, too. `listed` is
    a CSV file of requirements with texts, which come first and are included if nothing names them.
    With `run` the tests are run on engine and C; else they have no verdicts. Raises
    SpecError, MissingToolError, and ValueError without a spec.
    """
    project, requirements = to_project(root), optional(to_path, listed, "listed")
    documents = _load_documents(to_some_texts(specs, "specs"), project)
    expanded_documents = [_expand_with_instances(document, project) for document in documents]
    names = {
        name
        for document in documents
        for name in (document.name, *_instance_types(document, project))
    }
    files = find_tests(root, [Path(document.source.name) for document in documents])
    tests = [test for test in load_tests(files, root) if names & _tested_names(test, project)]
    verdicts = [_run_expectations(test) if run else {} for test in tests]
    code = _generate_code(documents, project)
    return trace_requirements(
        expanded_documents, code, zip(tests, verdicts, strict=True), read_requirements(requirements)
    )


@dataclass(frozen=True)
class KeyTraceReport:
    """The relation of keys and lines of C; `specs` and `code` are the texts by file."""

    traces: KeyTraces
    specs: dict[str, str]
    code: dict[str, str]


def trace_keys(specs: PathTexts, root: PathText | None = None) -> KeyTraceReport:
    """Return the lines of C that come from each key of the specs.

    A system includes the automata of its instances and their models; an automaton alone only its
    own C. The texts of SHARED_FILES are left out of `code`. Raises SpecError, and ValueError
    without a spec.
    """
    project, references = to_project(root), to_some_texts(specs, "specs")
    documents = _load_documents(references, project)
    named = {read_document(project.path_of(reference)).name for reference in references}
    expanded_documents = [_expand_with_instances(document, project) for document in documents]
    systems = {document.name for document in expanded_documents if document.kind == "system"}
    selected = documents if named & systems else [d for d in documents if d.name in named]
    code = _generate_code(selected, project)
    found = build_key_traces(expanded_documents, code)
    files = dict.fromkeys(key.place.source.name for key in found.keys)
    every = {name: text for files in code.values() for name, text in files.items()}
    shown = {name: text for name, text in every.items() if not name.startswith(SHARED_FILES)}
    return KeyTraceReport(found, {name: read_text(Path(name))[1] for name in files}, shown)


def read_requirements(path: Path | None) -> dict[str, str]:
    """Return the requirements of a CSV file as texts by name.

    The name is in the first column, the text in the second (empty if there is none); rows without
    name are skipped. A first row is skipped if its first cell is one of HEADINGS in any case. None
    as path gives an empty dict. Raises SpecError if the file cannot be read.
    """
    if path is None:
        return {}
    rows = list(csv.reader(io.StringIO(read_text(path)[1])))
    if rows and rows[0] and rows[0][0].strip().lower() in HEADINGS:
        rows = rows[1:]
    return {
        row[0].strip(): row[1].strip() if len(row) > 1 else ""
        for row in rows
        if row and row[0].strip()
    }


def _load_documents(specs: Sequence[str], project: Project) -> list[Document]:
    """Return the documents of specs, of instances of systems and of models, each once."""
    documents: dict[str, Document] = {}
    for spec in specs:
        document = read_document(project.path_of(spec))
        documents[document.name] = document
        automata: list[Automaton] = []
        match expand_document(document, project).kind:
            case "system":
                instances = read_system(document, project).instances.values()
                automata = [instance.automaton for instance in instances]
            case "automaton":
                automata = [automaton_of(document, project)]
        models = [automaton.model for automaton in automata if automaton.model]
        for automaton in (*automata, *models):
            inner = read_document(Path(automaton.span.source.name))
            documents.setdefault(inner.name, inner)
    return list(documents.values())


def _expand_with_instances(document: Document, project: Project) -> Document:
    """Return an expanded document; instances of an automaton are included as regions."""
    made = expand_document(document, project)
    if made.kind != "automaton":
        return made
    return dataclasses.replace(made, root=expand_instances(made.root, project, Problems()))


def _generate_code(documents: Sequence[Document], project: Project) -> dict[str, dict[str, str]]:
    """Return the C files of each document that is an automaton, by name."""
    return {
        document.name: emit_c_files(program_of(automaton_of(document, project)))
        for document in documents
        if expand_document(document, project).kind == "automaton"
    }


def _instance_types(document: Document, project: Project) -> Iterator[str]:
    """Yield the names of the automata of which an automaton has instances."""
    made = expand_document(document, project)
    if made.kind == "automaton":
        for entry in mapping_entries(made.root.get("instances")):
            of = find_node(made.root, ("instances", entry.key, "of"))
            assert isinstance(of, ScalarNode)
            yield read_document(project.path_of(of.text, of.span)).name


def _tested_names(test: Test, project: Project) -> set[str]:
    """Return the names of a test's system and of all automata in it."""
    found = {test.system.name}
    for instance in test.system.instances.values():
        document = read_document(Path(instance.automaton.span.source.name))
        found.update((instance.automaton.name, document.name, *_instance_types(document, project)))
    return found


def _run_expectations(test: Test) -> dict[str, bool]:
    """Return whether each expectation of a test passes on engine and C, by name."""
    run = run_test(test)
    fine = not run.difference and run.stopped is None
    return {outcome.name: outcome.passed and fine for outcome in run.outcomes}
