"""Spec tests: run the tests of a project on the engine and on compiled C."""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from engine.results.trajectory import Trajectory
from engine.simulation.simulate import simulate
from expectation.evaluate_expectations import Outcome, evaluate_test
from expectation.expectation_reader import read_test
from expectation.expectations import Test
from language.text.arguments import (
    PathText,
    PathTexts,
    optional,
    to_project,
    to_some_texts,
    to_text,
    to_texts,
)
from language.text.diagnostic import Problem, Problems, Source, Span, SpecError
from language.text.project_files import HEAD_PATTERN, is_shipped
from modewright.api.spec_check import spec_files
from modewright.runtime.back_end_choice import run_in_c


@dataclass(frozen=True)
class TestRun:
    """The result of a test: the outcomes on the engine, and the first difference to C.

    `backend` names what ran beside the engine, or is empty. A `difference` fails the test.
    """

    __test__ = False  # for pytest

    test: Test
    outcomes: tuple[Outcome, ...]
    backend: str
    difference: str
    stopped: str | None
    faults: tuple[str, ...]
    seconds: float

    @property
    def passed(self) -> bool:
        """Whether all expectations are met, the run did not stop early, and C gave the same run."""
        all_passed = all(outcome.passed for outcome in self.outcomes)
        return all_passed and not self.difference and self.stopped is None


def find_tests(root: PathText | None = None, specs: Iterable[Path] = ()) -> list[str]:
    """Return the paths of all YAML files below `spec/` that contain a test, sorted by path.

    If one of the files `specs` belongs to the distribution, the tests of the distribution follow,
    except those whose name a document of the project has. A file contains a test if it has a line
    `test: name` without indentation in its first 64 KiB; it is not parsed.
    """
    project = to_project(root)
    found = [path for path in spec_files(project.root) if _is_test(path)]
    if any(is_shipped(path) for path in specs):
        named = sorted(path for paths in project.index.values() for path in paths)
        found += [path for path in named if is_shipped(path) and _is_test(path)]
    return list(dict.fromkeys(str(path) for path in found))


def load_test(reference: PathText, root: PathText | None = None) -> Test:
    """Return a test by name or path. Raises SpecError with all its problems."""
    project = to_project(root)
    return read_test(project.read(project.path_of(to_text(reference, "reference"))), project)


def load_tests(references: PathTexts, root: PathText | None = None) -> list[Test]:
    """Return tests by name or path in the given order.

    Raises SpecError with the problems of all of them after all were read.
    """
    problems, tests = Problems(), []
    for reference in to_texts(references, "references"):
        with problems.collect_errors():
            tests.append(load_test(reference, root))
    problems.raise_if_errors()
    return tests


def run_tests(
    references: PathTexts | None = None, root: PathText | None = None, *, compiled: bool = True
) -> Iterator[TestRun]:
    """Yield the result of each test; for None as references, of all tests of the project.

    All tests are read before the first one runs. `compiled` also runs them in C. Raises SpecError,
    also if the project has no test, ValueError for an empty list, and MissingToolError without a
    compiler; a failed test is a result.
    """
    named = optional(to_some_texts, references, "references") or find_tests(root)
    if not named:
        place = Span(Source("spec"), 1, 1)
        raise SpecError(
            [Problem("missing", place, "there is no test below spec/", "see docs/testing.md")]
        )
    for test in load_tests(named, root):
        yield run_test(test, compiled=compiled)


def run_test(test: Test, *, compiled: bool = True) -> TestRun:
    """Return the result of a test on the engine and, if `compiled`, in C.

    The difference to C is the first one among outcomes, stop, events and signals (exact values).
    Raises MissingToolError and BuildError.
    """
    start = time.perf_counter()
    trajectory = simulate(test.system, test.scenario)
    outcomes = evaluate_test(test, trajectory)
    means, difference = "", ""
    if compiled:
        other, means = run_in_c(test.system, test.scenario)
        difference = _outcome_difference(
            outcomes, evaluate_test(test, other)
        ) or _trajectory_difference(trajectory, other)
    seconds = time.perf_counter() - start
    return TestRun(
        test, outcomes, means, difference, trajectory.stopped, trajectory.faults, seconds
    )


def _outcome_difference(ours: Sequence[Outcome], theirs: Sequence[Outcome]) -> str:
    """Return a text about the first expectation that differs in C; empty if none does."""
    for mine, other in zip(ours, theirs, strict=True):
        if mine.passed != other.passed:
            word = "passed" if other.passed else f"failed: {other.message}"
            return f"`{mine.name}` {word} in C, and not on the engine"
    return ""


def _trajectory_difference(ours: Trajectory, theirs: Trajectory) -> str:
    """Return a text about the first end, event or signal that differs in C; empty if none does."""
    if ours.stopped != theirs.stopped:
        return f"C ended with {theirs.stopped or 'no stop'}, the engine with {ours.stopped}"
    for mine, other in zip(ours.events, theirs.events, strict=False):
        if mine != other:
            place = f"at {other.time:.9g} s, on the engine at {mine.time:.9g} s"
            return f"`{other.instance}.{other.transition}` in C {place} `{mine.transition}`"
    if len(ours.events) != len(theirs.events):
        return f"C had {len(theirs.events)} events, the engine {len(ours.events)}"
    for name, values in ours.signals.items():
        other_values = theirs.signals[name]
        if not np.array_equal(values, other_values, equal_nan=True):
            row = int(np.argmax(values != other_values))
            return f"`{name}` at {ours.times[row]:.9g} s is {other_values[row]} in C, {values[row]}"
    return ""


def _is_test(path: Path) -> bool:
    """Return whether a file contains a test, from its first 64 KiB; a device contains none."""
    if not path.is_file():
        return False
    text = path.read_text("utf-8", errors="replace")[:65536]
    return any(match.group(1) == "test" for match in HEAD_PATTERN.finditer(text))
