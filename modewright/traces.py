"""Traces: requirements of a project's specs, their C and their tests, brought together."""

from __future__ import annotations

import csv
import dataclasses
import io
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from codegen.source import c_files
from expectation.expected import Test
from expectation.key_trace import KeyTraces, keys_traced
from expectation.trace import Trace, traced
from language.document import Document, Scalar, read_text
from language.instance import with_instances
from language.load import automaton_of, program_of
from language.model import Automaton
from language.problem import Problems
from language.project import Project, expanded, read_document
from language.system import read_system
from language.tree import at, entries
from modewright.tests import load_tests, run_test, tests_of

HEADINGS = ("name", "id", "requirement")
"""What a first row begins with that names the columns, in any case of its letters."""


def trace(
    specs: Sequence[str],
    listed: Path | None = None,
    root: Path | None = None,
    *,
    run: bool = False,
) -> Trace:
    """Return which requirements specs, their C and the tests of the project name.

    A spec is an automaton, or a system: then that and the automata of its instances. `listed` is
    a CSV of requirements with their texts; `run` runs the tests. Raises SpecError, ToolMissing.
    """
    project = Project(root or Path())
    documents = _documents(specs, project)
    made = [_whole(document, project) for document in documents]
    names = {name for document in documents for name in (document.name, *_of(document, project))}
    tests = [test for test in load_tests(tests_of(root), root) if names & _used(test, project)]
    verdicts = [_verdicts(test) if run else {} for test in tests]
    code = _code(documents, project)
    return traced(made, code, zip(tests, verdicts, strict=True), requirements(listed))


@dataclass(frozen=True)
class TracedKeys:
    """Which keys show in which lines of C; `specs` and `code` are the texts by file."""

    found: KeyTraces
    specs: dict[str, str]
    code: dict[str, str]


def trace_keys(specs: Sequence[str], root: Path | None = None) -> TracedKeys:
    """Return which lines of C come from which keys of specs: of automata, and all in systems.

    Raises SpecError.
    """
    project = Project(root or Path())
    documents = _documents(specs, project)
    named = {read_document(project.path_of(spec)).name for spec in specs}
    made = [_whole(document, project) for document in documents]
    systems = {document.name for document in made if document.kind == "system"}
    meant = documents if named & systems else [d for d in documents if d.name in named]
    code = _code(meant, project)
    found = keys_traced(made, code)
    files = dict.fromkeys(key.place.source.name for key in found.keys)
    every = {name: text for files in code.values() for name, text in files.items()}
    shown = {name: text for name, text in every.items() if not name.startswith("ha_math")}
    return TracedKeys(found, {name: read_text(Path(name))[1] for name in files}, shown)


def requirements(path: Path | None) -> dict[str, str]:
    """Return the requirements of a CSV: names in its first column, texts in the second.

    Its first row may name the columns. Raises SpecError.
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


def _documents(specs: Sequence[str], project: Project) -> list[Document]:
    """Return the documents of specs, of the instances of systems, and of models, each once."""
    found: dict[str, Document] = {}
    for spec in specs:
        document = read_document(project.path_of(spec))
        found[document.name] = document
        automata: list[Automaton] = []
        match expanded(document, project).kind:
            case "system":
                instances = read_system(document, project).instances.values()
                automata = [instance.automaton for instance in instances]
            case "automaton":
                automata = [automaton_of(document, project)]
        models = [automaton.model for automaton in automata if automaton.model]
        for automaton in (*automata, *models):
            inner = read_document(Path(automaton.span.source.name))
            found.setdefault(inner.name, inner)
    return list(found.values())


def _whole(document: Document, project: Project) -> Document:
    """Return a document with what it extends, and with the instances of an automaton laid."""
    made = expanded(document, project)
    if made.kind != "automaton":
        return made
    return dataclasses.replace(made, root=with_instances(made.root, project, Problems()))


def _code(documents: Sequence[Document], project: Project) -> dict[str, dict[str, str]]:
    """Return the C files of those documents that are automata."""
    return {
        document.name: c_files(program_of(automaton_of(document, project)))
        for document in documents
        if expanded(document, project).kind == "automaton"
    }


def _of(document: Document, project: Project) -> Iterator[str]:
    """Yield the names of what an automaton has instances of."""
    made = expanded(document, project)
    if made.kind == "automaton":
        for entry in entries(made.root.get("instances")):
            of = at(made.root, ("instances", entry.key, "of"))
            assert isinstance(of, Scalar)
            yield read_document(project.path_of(of.text, of.span)).name


def _used(test: Test, project: Project) -> set[str]:
    """Return the names of a test's system, and of all that is in it."""
    found = {test.system.name}
    for instance in test.system.instances.values():
        document = read_document(Path(instance.automaton.span.source.name))
        found.update((instance.automaton.name, document.name, *_of(document, project)))
    return found


def _verdicts(test: Test) -> dict[str, bool]:
    """Return the verdict of each expectation, on engine and C."""
    run = run_test(test)
    fine = not run.difference and run.stopped is None
    return {outcome.name: outcome.passed and fine for outcome in run.outcomes}
