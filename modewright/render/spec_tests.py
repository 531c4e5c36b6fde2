"""Test output: print the results of tests, also as JSON and JUnit XML."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any
from xml.etree import ElementTree

from expectation.evaluate_expectations import Outcome
from expectation.expectations import Expectation
from language.expressions.units import Dimension
from language.text.sanitise import escape_invisible
from modewright.api.spec_tests import TestRun
from modewright.render.pluralisation import pluralise

XML_DECLARATION = "<?xml version='1.0' encoding='utf-8'?>"
SECONDS_DECIMALS = 3
"""Decimals of the duration of a test."""


def spec_test_lines(run: TestRun) -> Iterator[str]:
    """Yield the lines of a test: one if it passed, else also its failures.

    A failed expectation has its place, message, and the modes and values at that time; a difference
    to C and a stop have one line each. Latched faults are warnings and are printed for passed
    tests, too.
    """
    word = "passed" if run.passed else "FAILED"
    also = f" and C, {run.backend.partition(':')[0]}" if run.backend else ""
    count = pluralise(len(run.outcomes), "expectation")
    yield f"{word}  {run.test.name}: {count}, engine{also} ({run.seconds:.2f} s)"
    for expectation, outcome in zip(run.test.expectations, run.outcomes, strict=True):
        if not outcome.passed:
            yield f"  {expectation.span}: {outcome.name}: {failure_text(expectation, outcome)}"
            yield from (f"      {line}" for line in _failure_details(run, outcome))
    for label in (run.difference, run.stopped and f"the run stopped: {run.stopped}"):
        if label:
            yield f"  {run.test.span}: {label}"
    for fault in run.faults:
        yield f"  warning: a fault bit is set: {fault}"


def failure_text(expectation: Expectation, outcome: Outcome) -> str:
    """Return the failure of an expectation in one line: its text in backticks, then the message.

    The text is left out if it is empty.
    """
    subject = f"`{escape_invisible(expectation.text)}` " if expectation.text else ""
    return f"{subject}{outcome.message}"


def spec_tests_summary(runs: Sequence[TestRun]) -> str:
    """Return `n tests, m failed`."""
    failed = sum(not run.passed for run in runs)
    return f"{pluralise(len(runs), 'test')}, {failed} failed"


def spec_test_json(run: TestRun) -> dict[str, Any]:
    """Return the result of a test with all expectations as a dict for JSON; values in SI.

    Times are in s, the duration with SECONDS_DECIMALS. `beside` names what ran beside the engine.
    """
    return {
        "name": run.test.name,
        "file": run.test.span.source.name,
        "line": run.test.span.line,
        "requirements": list(run.test.requirements),
        "passed": run.passed,
        "seconds": round(run.seconds, SECONDS_DECIMALS),
        "beside": run.backend,
        "difference": run.difference,
        "stopped": run.stopped,
        "faults": list(run.faults),
        "expectations": [
            _outcome_json(*pair) for pair in zip(run.test.expectations, run.outcomes, strict=True)
        ],
    }


def junit_xml(runs: Sequence[TestRun]) -> bytes:
    """Return the tests as JUnit XML with a suite for each test and a case for each expectation.

    A difference to C and a stop are additional failed cases `lock_step` and `run`. The duration of
    a test is divided equally among its expectations.
    """
    root = ElementTree.Element("testsuites", _counts(runs))
    for run in runs:
        suite = ElementTree.SubElement(root, "testsuite", {"name": run.test.name, **_counts([run])})
        file, share = run.test.span.source.name, run.seconds / max(1, len(run.outcomes))
        for expectation, outcome in zip(run.test.expectations, run.outcomes, strict=True):
            case = _add_case(suite, run, outcome.name, share, (file, expectation.span.line))
            if not outcome.passed:
                _add_failure(
                    case, failure_text(expectation, outcome), _failure_details(run, outcome)
                )
        for name, text in (("lock_step", run.difference), ("run", run.stopped)):
            if text:
                _add_failure(_add_case(suite, run, name, 0.0, (file, run.test.span.line)), text, [])
    ElementTree.indent(root)
    text = ElementTree.tostring(root, "unicode")
    return f"{XML_DECLARATION}\n{text}\n".encode()


def _failure_details(run: TestRun, outcome: Outcome) -> list[str]:
    """Return the modes and values at the time of a failure."""
    units = {name: unit for name, unit in _units(run).items()}
    lines = []
    if outcome.modes:
        modes = ", ".join(f"{name} in {mode}" for name, mode in outcome.modes.items())
        lines.append(f"at {outcome.time:.9g} s: {modes}" if outcome.time is not None else modes)
    for name, value in outcome.values.items():
        unit = units.get(name, "1")
        lines.append(f"{name} = {value:.9g}" + ("" if unit == "1" else f" {unit}"))
    return lines


def _units(run: TestRun) -> Mapping[str, str]:
    """Return the units of the signals of a test."""
    return {
        name: str(kind)
        for expectation in run.test.expectations
        for condition in expectation.conditions
        for name, kind in condition.signals.items()
        if isinstance(kind, Dimension)
    }


def _outcome_json(expectation: Expectation, outcome: Outcome) -> dict[str, Any]:
    """Return the outcome of an expectation as a dict for JSON."""
    return {
        "name": outcome.name,
        "kind": expectation.kind,
        "line": expectation.span.line,
        "column": expectation.span.column,
        "expected": expectation.text,
        "requirements": list(expectation.requirements),
        "passed": outcome.passed,
        "message": outcome.message,
        "time": outcome.time,
        "modes": dict(outcome.modes),
        "values": dict(outcome.values),
    }


def _counts(runs: Sequence[TestRun]) -> dict[str, str]:
    """Return the JUnit counts of tests; a difference or a stop is an additional failed case."""
    extra = sum(bool(run.difference) + (run.stopped is not None) for run in runs)
    failed = sum(not outcome.passed for run in runs for outcome in run.outcomes)
    cases = sum(len(run.outcomes) for run in runs)
    seconds = sum(run.seconds for run in runs)
    return {
        "tests": str(cases + extra),
        "failures": str(failed + extra),
        "time": f"{seconds:.{SECONDS_DECIMALS}f}",
    }


def _add_case(
    suite: ElementTree.Element, run: TestRun, name: str, seconds: float, place: tuple[str, int]
) -> ElementTree.Element:
    """Add a test case to a suite."""
    file, line = place
    return ElementTree.SubElement(
        suite, "testcase",
        {"classname": run.test.name, "name": name, "file": file, "line": str(line),
         "time": f"{seconds:.{SECONDS_DECIMALS}f}"},
    )  # fmt: skip


def _add_failure(case: ElementTree.Element, message: str, lines: Sequence[str]) -> None:
    """Add a failure with details to a test case."""
    failed = ElementTree.SubElement(case, "failure", {"message": escape_invisible(message)})
    failed.text = "\n".join(map(escape_invisible, lines)) or None
