"""Trace: which requirement is named where - in specs, in the lines of their C, in tests."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from expectation.expected import Test
from language.document import Document, Scalar, Table
from language.requirement import requirements_in
from language.tree import entries

CITED = re.compile(
    r"(?:\b([A-Za-z]\w*) )?\b((?:modes|regions|tables|parameters|inputs|states|discrete|equations"
    r"|flow|terms)\.[\w.]+)"
)
"""How C cites the key path of what it does: `estimator modes.gap.transitions.drive`."""
Line = tuple[str, int]
"""A file and a line of it."""


@dataclass(frozen=True)
class Claim:
    """A place of a spec that names a requirement, and the lines of C that come from it."""

    spec: str
    path: str
    place: str
    code: tuple[Line, ...]


@dataclass(frozen=True)
class Proof:
    """A test, or one of its expectations, that names a requirement.

    `passed` is None where the test was not run.
    """

    test: str
    expectation: str
    place: str
    passed: bool | None = None


@dataclass(frozen=True)
class Traced:
    """A requirement with all that names it; `text` is what a list says of it."""

    name: str
    text: str = ""
    claims: tuple[Claim, ...] = ()
    proofs: tuple[Proof, ...] = ()

    @property
    def state(self) -> str:
        """What is missing, if anything is."""
        if not self.claims:
            return "unimplemented"
        return "traced" if self.proofs else "untested"


@dataclass(frozen=True)
class Trace:
    """All requirements, in the order of a list, then in that in which they were found."""

    requirements: tuple[Traced, ...] = field(default_factory=tuple)

    def of_state(self, state: str) -> list[str]:
        """Return the requirements that are traced, untested or unimplemented."""
        return [each.name for each in self.requirements if each.state == state]


def traced(
    documents: Sequence[Document],
    code: Mapping[str, Mapping[str, str]],
    tests: Iterable[tuple[Test, Mapping[str, bool]]],
    listed: Mapping[str, str],
) -> Trace:
    """Return the trace of specs, with templates as they are written.

    `code` is their C by automaton and file; a test has the verdict of each expectation where it was
    run; `listed` are requirements with what they say.
    """
    cited = citations(code)
    claims: dict[str, list[Claim]] = {}
    proofs: dict[str, list[Proof]] = {}
    for document in documents:
        for named in requirements_in(document.root):
            lines = tuple(_lines(document, named.path, code, cited))
            claim = Claim(document.name, named.path, _place(named.span), lines)
            claims.setdefault(named.requirement, []).append(claim)
    for test, passed in tests:
        for requirement, proof in _proofs(test, passed):
            proofs.setdefault(requirement, []).append(proof)
    names = dict.fromkeys([*listed, *claims, *proofs])
    return Trace(
        tuple(
            Traced(name, listed.get(name, ""), tuple(claims.get(name, ())),
                   tuple(proofs.get(name, ())))
            for name in names
        )
    )  # fmt: skip


def citations(code: Mapping[str, Mapping[str, str]]) -> dict[tuple[str, str], list[Line]]:
    """Return the lines of C by the automaton and the key path that they cite."""
    found: dict[tuple[str, str], list[Line]] = {}
    for owner, files in code.items():
        for file, text in files.items():
            for number, line in enumerate(text.splitlines(), start=1):
                for name, path in CITED.findall(line):
                    found.setdefault((name or owner, path.rstrip(".")), []).append((file, number))
    return found


def _lines(
    document: Document,
    path: str,
    code: Mapping[str, Mapping[str, str]],
    cited: Mapping[tuple[str, str], Sequence[Line]],
) -> Iterator[Line]:
    """Yield the lines that cite a path or something in it; of a whole file, its first lines."""
    if not path:
        yield from ((file, 1) for file in code.get(document.name, {}) if file.endswith(".c"))
        return
    found: dict[Line, None] = {}
    for wanted in _written(document, path):
        for (name, key), lines in cited.items():
            if name == document.name and (key == wanted or key.startswith(f"{wanted}.")):
                found.update(dict.fromkeys(lines))
    yield from sorted(found)


def _written(document: Document, path: str) -> list[str]:
    """Return the paths that C cites for one: a template's stand in the modes that are like it."""
    head, _, rest = path.partition(".")
    if head != "templates":
        return [path]
    template, _, inner = rest.partition(".")
    return [
        f"{mode}.{inner}" if inner else mode
        for mode, table in _modes(document.root, ())
        if _text(table, "like") == template
    ]


def _modes(table: Table, path: tuple[str, ...]) -> Iterator[tuple[str, Table]]:
    """Yield each mode with its key path: those of regions, and those inside modes, too."""
    for key in ("modes", "regions"):
        for entry in entries(table.get(key)):
            if isinstance(entry.node, Table):
                here = (*path, key, entry.key)
                if key == "modes":
                    yield ".".join(here), entry.node
                yield from _modes(entry.node, here)


def _proofs(test: Test, passed: Mapping[str, bool]) -> Iterator[tuple[str, Proof]]:
    every = all(passed.values()) if passed else None
    for requirement in test.requirements:
        yield requirement, Proof(test.name, "", _place(test.span), every)
    for each in test.expectations:
        for requirement in each.requirements:
            verdict = passed.get(each.name)
            yield requirement, Proof(test.name, each.name, _place(each.span), verdict)


def _place(span: object) -> str:
    return str(span).rpartition(":")[0]


def _text(table: Table, key: str) -> str:
    node = table.get(key)
    return node.text if isinstance(node, Scalar) else ""
