"""Requirement trace: show requirements with specs, C and tests as text, CSV, HTML and JSON."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Sequence
from html import escape
from typing import Any

from expectation.requirement_trace import (
    CodeLine,
    Implementation,
    RequirementTrace,
    TracedRequirement,
    Verification,
)
from language.text.sanitise import escape_formula
from modewright.render.pluralisation import pluralise
from modewright.runtime.json_format import format_entry

HEADINGS = ("requirement", "state", "spec", "place", "C", "test", "test place", "verdict")
"""The headings of the CSV file."""
MAX_LINES = 6
"""Largest number of lines of C that are printed for a place; CSV and JSON have all."""
STATE_COLOURS = {"traced": "#1d7a33", "untested": "#9a6700", "unimplemented": "#b3261e"}
"""Colours of states."""
VERDICT_TEXTS = {None: "not run", True: "passed", False: "failed"}
"""Texts of test results."""
STYLE = """body{font:14px/1.45 system-ui,sans-serif;margin:2rem;color:#222}
table{border-collapse:collapse;width:100%}
th,td{text-align:left;vertical-align:top;padding:.35rem .6rem;border-bottom:1px solid #ddd}
code{font-size:12px}.n{color:#666}
@media(prefers-color-scheme:dark){body{background:#161616;color:#ddd}td,th{border-color:#444}}"""


def trace_lines(trace: RequirementTrace) -> Iterator[str]:
    """Yield a line for each requirement with its state and text, and the summary as the last line.

    Below each requirement are its places, with at most MAX_LINES lines of C each, and its tests
    with their results.
    """
    for each in trace.requirements:
        yield f"{each.name}: {each.state}" + (f" - {each.text}" if each.text else "")
        for claim in each.implementations:
            yield f"  {claim.place}: {_subject(claim)}{_code_text(claim.code)}"
        for proof in each.verifications:
            yield f"  {proof.place}: {_test_name(proof)}, {VERDICT_TEXTS[proof.passed]}"
    yield trace_summary(trace)


def trace_summary(trace: RequirementTrace) -> str:
    """Return the number of requirements, and of those in each state other than `traced` with names.

    The line is like `3 requirements; 1 untested: R2; 0 unimplemented`.
    """
    text = pluralise(len(trace.requirements), "requirement")
    for state in ("untested", "unimplemented"):
        names = trace.with_state(state)
        text += f"; {len(names)} {state}" + (f": {', '.join(names)}" if names else "")
    return text


def trace_json(trace: RequirementTrace) -> dict[str, Any]:
    """Return a trace as a dict for JSON.

    The keys are requirements (with specs, lines of C and tests), untested and unimplemented
    (names).
    """
    return {
        **format_entry("trace"),
        "requirements": [_requirement_json(each) for each in trace.requirements],
        "untested": trace.with_state("untested"),
        "unimplemented": trace.with_state("unimplemented"),
    }


def trace_csv(trace: RequirementTrace) -> str:
    """Return a trace as CSV with the columns HEADINGS and a row for each pair of place and test.

    A requirement without places or without tests has empty cells there, but at least one row. No
    cell is a formula of a spreadsheet (`escape_formula`).
    """
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(HEADINGS)
    for each in trace.requirements:
        for claim in each.implementations or (None,):
            for proof in each.verifications or (None,):
                spec = (
                    (_subject(claim), claim.place, _format_lines(claim.code))
                    if claim
                    else ("",) * 3
                )
                test = ("",) * 3
                if proof:
                    test = (_test_name(proof), proof.place, VERDICT_TEXTS[proof.passed])
                writer.writerow(map(escape_formula, (each.name, each.state, *spec, *test)))
    return text.getvalue()


def trace_html(trace: RequirementTrace, title: str) -> str:
    """Return a trace as a self-contained HTML page with a row for each requirement.

    `title` follows `Trace of` in the heading.
    """
    rows = "\n".join(map(_html_row, trace.requirements))
    heads = "".join(f"<th>{head}</th>" for head in ("requirement", "state", "spec and C", "tests"))
    name = escape(title)
    return f"""<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>Trace of {name}</title>
<style>{STYLE}</style></head><body>
<h1>Trace of {name}</h1>
<p>{escape(trace_summary(trace))}</p>
<table><thead><tr>{heads}</tr></thead><tbody>
{rows}
</tbody></table></body></html>
"""


def _html_row(requirement: TracedRequirement) -> str:
    """Return the table row of a requirement."""
    claims = "".join(
        f"<div><code>{escape(_subject(c))}</code> <span class=n>{escape(c.place)}</span>"
        f"<br><span class=n>{escape(_code_text(c.code).strip())}</span></div>"
        for c in requirement.implementations
    )
    proofs = "".join(
        f"<div>{escape(_test_name(p))}: {VERDICT_TEXTS[p.passed]}"
        f" <span class=n>{escape(p.place)}</span></div>"
        for p in requirement.verifications
    )
    text = f"<div class=n>{escape(requirement.text)}</div>" if requirement.text else ""
    state = f'<span style="color:{STATE_COLOURS[requirement.state]}">{requirement.state}</span>'
    cells = (f"<b>{escape(requirement.name)}</b>{text}", state, claims, proofs)
    return f"<tr>{''.join(f'<td>{cell}</td>' for cell in cells)}</tr>"


def _requirement_json(requirement: TracedRequirement) -> dict[str, Any]:
    """Return a requirement as a dict for JSON."""
    return {
        "name": requirement.name,
        "text": requirement.text,
        "state": requirement.state,
        "specs": [
            {
                "spec": claim.spec,
                "path": claim.path,
                "place": claim.place,
                "c": [{"file": file, "line": line} for file, line in claim.code],
            }
            for claim in requirement.implementations
        ],
        "tests": [
            {
                "test": proof.test,
                "expectation": proof.expectation,
                "place": proof.place,
                "verdict": VERDICT_TEXTS[proof.passed],
            }
            for proof in requirement.verifications
        ],
    }


def _subject(claim: Implementation) -> str:
    """Return spec and path of a place."""
    return f"{claim.spec} {claim.path}".strip()


def _test_name(proof: Verification) -> str:
    """Return the name of a test, or of one of its expectations."""
    return f"{proof.test}.{proof.expectation}" if proof.expectation else proof.test


def _code_text(lines: Sequence[CodeLine]) -> str:
    """Return the lines of C of a place, at most MAX_LINES."""
    if not lines:
        return ", no line of C"
    more = f" and {len(lines) - MAX_LINES} more" if len(lines) > MAX_LINES else ""
    return f", C: {_format_lines(lines[:MAX_LINES])}{more}"


def _format_lines(lines: Sequence[CodeLine]) -> str:
    """Return lines as `estimator.c:12,15 estimator.h:4`."""
    files: dict[str, list[str]] = {}
    for file, line in lines:
        files.setdefault(file, []).append(str(line))
    return " ".join(f"{file}:{','.join(numbers)}" for file, numbers in files.items())
