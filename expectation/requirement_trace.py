"""Requirement trace: relate requirements to specs, lines of C and tests."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from expectation.expectations import Test
from language.text.document import Document, MappingNode
from language.text.node_edit import mapping_entries
from language.text.requirement import find_requirements

CITATION = re.compile(
    r"(?:\b([A-Za-z]\w*) )?\b((?:modes|regions|tables|parameters|inputs|states|discrete|equations"
    r"|flow|terms)\.[\w.]+)"
)
"""The form in which C cites a key path: `estimator modes.gap.transitions.drive`."""
CodeLine = tuple[str, int]
"""A file name and a line number."""


@dataclass(frozen=True)
class Implementation:
    """A place in a spec that names a requirement, and the lines of C that come from it."""

    spec: str
    path: str
    place: str
    code: tuple[CodeLine, ...]


@dataclass(frozen=True)
class Verification:
    """A test, or one of its expectations, that names a requirement.

    `passed` is None if the test was not run.
    """

    test: str
    expectation: str
    place: str
    passed: bool | None = None


@dataclass(frozen=True)
class TracedRequirement:
    """A requirement with its implementations and verifications.

    `text` is from a list of requirements.
    """

    name: str
    text: str = ""
    implementations: tuple[Implementation, ...] = ()
    verifications: tuple[Verification, ...] = ()

    @property
    def state(self) -> str:
        """The state: `unimplemented`, `untested` (implementations only) or `traced`.

        A requirement without implementations is `unimplemented`, also if a test names it. Results
        of tests do not matter.
        """
        if not self.implementations:
            return "unimplemented"
        return "traced" if self.verifications else "untested"


@dataclass(frozen=True)
class RequirementTrace:
    """All requirements: first those of the list in its order, then others in order of
    occurrence.
    """

    requirements: tuple[TracedRequirement, ...] = field(default_factory=tuple)

    def with_state(self, state: str) -> list[str]:
        """Return the names of the requirements in a state, in their order."""
        return [each.name for each in self.requirements if each.state == state]


def trace_requirements(
    documents: Sequence[Document],
    code: Mapping[str, Mapping[str, str]],
    tests: Iterable[tuple[Test, Mapping[str, bool]]],
    requirement_texts: Mapping[str, str],
) -> RequirementTrace:
    """Return the trace of requirements over specs (templates not expanded), C and tests.

    `code` is C text by automaton and file name. Each test comes with the results of its
    expectations by name, empty if it was not run; a test that names a requirement itself has passed
    if all of them have. `requirement_texts` are the texts of known requirements, which come first,
    also if nothing names them. A requirement of a whole spec has line 1 of each C file.
    """
    cited = citations(code)
    implementations: dict[str, list[Implementation]] = {}
    verifications: dict[str, list[Verification]] = {}
    for document in documents:
        for named in find_requirements(document.root):
            lines = tuple(_citing_lines(document, named.path, code, cited))
            implementation = Implementation(
                document.name, named.path, _format_location(named.span), lines
            )
            implementations.setdefault(named.requirement, []).append(implementation)
    for test, passed in tests:
        for requirement, verification in _verifications_of(test, passed):
            verifications.setdefault(requirement, []).append(verification)
    names = dict.fromkeys([*requirement_texts, *implementations, *verifications])
    return RequirementTrace(
        tuple(
            TracedRequirement(
                name,
                requirement_texts.get(name, ""),
                tuple(implementations.get(name, ())),
                tuple(verifications.get(name, ())),
            )
            for name in names
        )
    )


def citations(code: Mapping[str, Mapping[str, str]]) -> dict[tuple[str, str], list[CodeLine]]:
    """Return the lines of C by the cited automaton and key path (CITATION).

    Lines are (file, number from 1), in file order; a line that cites twice is listed twice. A
    citation without a name refers to the automaton of the file.
    """
    found: dict[tuple[str, str], list[CodeLine]] = {}
    for owner, files in code.items():
        for file, text in files.items():
            for number, line in enumerate(text.splitlines(), start=1):
                for name, path in CITATION.findall(line):
                    found.setdefault((name or owner, path.rstrip(".")), []).append((file, number))
    return found


def _citing_lines(
    document: Document,
    path: str,
    code: Mapping[str, Mapping[str, str]],
    cited: Mapping[tuple[str, str], Sequence[CodeLine]],
) -> Iterator[CodeLine]:
    """Yield the lines that cite a path or a key below it, sorted.

    An empty path stands for the whole spec and yields line 1 of each C file.
    """
    if not path:
        yield from ((file, 1) for file in code.get(document.name, {}) if file.endswith(".c"))
        return
    found: dict[CodeLine, None] = {}
    for cited_path in _cited_paths(document, path):
        for (name, key), lines in cited.items():
            if name == document.name and (key == cited_path or key.startswith(f"{cited_path}.")):
                found.update(dict.fromkeys(lines))
    yield from sorted(found)


def _cited_paths(document: Document, path: str) -> list[str]:
    """Return the paths that C cites for a path.

    A path in a template gives one path for each mode that uses the template.
    """
    head, _, rest = path.partition(".")
    if head != "templates":
        return [path]
    template, _, inner = rest.partition(".")
    return [
        f"{mode}.{inner}" if inner else mode
        for mode, table in _iterate_modes(document.root, ())
        if table.text_of("like") == template
    ]


def _iterate_modes(table: MappingNode, path: tuple[str, ...]) -> Iterator[tuple[str, MappingNode]]:
    """Yield key path and node of each mode, including those in regions and in other modes."""
    for key in ("modes", "regions"):
        for entry in mapping_entries(table.get(key)):
            if isinstance(entry.node, MappingNode):
                here = (*path, key, entry.key)
                if key == "modes":
                    yield ".".join(here), entry.node
                yield from _iterate_modes(entry.node, here)


def _verifications_of(test: Test, passed: Mapping[str, bool]) -> Iterator[tuple[str, Verification]]:
    """Yield requirement and verification for a test and for each of its expectations."""
    every = all(passed.values()) if passed else None
    for requirement in test.requirements:
        yield requirement, Verification(test.name, "", _format_location(test.span), every)
    for each in test.expectations:
        for requirement in each.requirements:
            verdict = passed.get(each.name)
            yield (
                requirement,
                Verification(test.name, each.name, _format_location(each.span), verdict),
            )


def _format_location(span: object) -> str:
    """Return file and line of a span, without the column."""
    return str(span).rpartition(":")[0]
