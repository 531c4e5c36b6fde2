"""Show trace: requirements with specs, C and tests, as a table, CSV, HTML and plain data."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Sequence
from html import escape
from typing import Any

from expectation.trace import Claim, Line, Proof, Trace, Traced
from modewright.console import counted

HEADS = ("requirement", "state", "spec", "place", "C", "test", "test place", "verdict")
MOST_LINES = 6
"""Lines of C that are shown to a person for one place of a spec; CSV and JSON have all."""
STATES = {"traced": "#1d7a33", "untested": "#9a6700", "unimplemented": "#b3261e"}
VERDICTS = {None: "not run", True: "passed", False: "failed"}
STYLE = """body{font:14px/1.45 system-ui,sans-serif;margin:2rem;color:#222}
table{border-collapse:collapse;width:100%}
th,td{text-align:left;vertical-align:top;padding:.35rem .6rem;border-bottom:1px solid #ddd}
code{font-size:12px}.n{color:#666}
@media(prefers-color-scheme:dark){body{background:#161616;color:#ddd}td,th{border-color:#444}}"""


def lines_of(trace: Trace) -> Iterator[str]:
    """Yield the lines that tell of a trace."""
    for each in trace.requirements:
        yield f"{each.name}: {each.state}" + (f" - {each.text}" if each.text else "")
        for claim in each.claims:
            yield f"  {claim.place}: {_subject(claim)}{_code(claim.code)}"
        for proof in each.proofs:
            yield f"  {proof.place}: {_test(proof)}, {VERDICTS[proof.passed]}"
    yield summary(trace)


def summary(trace: Trace) -> str:
    """Return how many requirements there are, and which are not traced."""
    text = counted(len(trace.requirements), "requirement")
    for state in ("untested", "unimplemented"):
        names = trace.of_state(state)
        text += f"; {len(names)} {state}" + (f": {', '.join(names)}" if names else "")
    return text


def trace_json(trace: Trace) -> dict[str, Any]:
    """Return a trace as plain data."""
    return {
        "requirements": [_requirement_json(each) for each in trace.requirements],
        "untested": trace.of_state("untested"),
        "unimplemented": trace.of_state("unimplemented"),
    }


def trace_csv(trace: Trace) -> str:
    """Return a trace as CSV: a row for each place of a spec with each test that names the same."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(HEADS)
    for each in trace.requirements:
        for claim in each.claims or (None,):
            for proof in each.proofs or (None,):
                spec = (_subject(claim), claim.place, _lines(claim.code)) if claim else ("",) * 3
                test = ("",) * 3
                if proof:
                    test = (_test(proof), proof.place, VERDICTS[proof.passed])
                writer.writerow([each.name, each.state, *spec, *test])
    return text.getvalue()


def trace_html(trace: Trace, title: str) -> str:
    """Return a trace as a page of its own."""
    rows = "\n".join(map(_row, trace.requirements))
    heads = "".join(f"<th>{head}</th>" for head in ("requirement", "state", "spec and C", "tests"))
    name = escape(title)
    return f"""<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>Trace of {name}</title>
<style>{STYLE}</style></head><body>
<h1>Trace of {name}</h1>
<p>{escape(summary(trace))}</p>
<table><thead><tr>{heads}</tr></thead><tbody>
{rows}
</tbody></table></body></html>
"""


def _row(each: Traced) -> str:
    claims = "".join(
        f"<div><code>{escape(_subject(c))}</code> <span class=n>{escape(c.place)}</span>"
        f"<br><span class=n>{escape(_code(c.code).strip())}</span></div>"
        for c in each.claims
    )
    proofs = "".join(
        f"<div>{escape(_test(p))}: {VERDICTS[p.passed]}"
        f" <span class=n>{escape(p.place)}</span></div>"
        for p in each.proofs
    )
    text = f"<div class=n>{escape(each.text)}</div>" if each.text else ""
    state = f'<span style="color:{STATES[each.state]}">{each.state}</span>'
    cells = (f"<b>{escape(each.name)}</b>{text}", state, claims, proofs)
    return f"<tr>{''.join(f'<td>{cell}</td>' for cell in cells)}</tr>"


def _requirement_json(each: Traced) -> dict[str, Any]:
    return {
        "name": each.name,
        "text": each.text,
        "state": each.state,
        "specs": [
            {
                "spec": claim.spec,
                "path": claim.path,
                "place": claim.place,
                "c": [{"file": file, "line": line} for file, line in claim.code],
            }
            for claim in each.claims
        ],
        "tests": [
            {
                "test": proof.test,
                "expectation": proof.expectation,
                "place": proof.place,
                "verdict": VERDICTS[proof.passed],
            }
            for proof in each.proofs
        ],
    }


def _subject(claim: Claim) -> str:
    return f"{claim.spec} {claim.path}".strip()


def _test(proof: Proof) -> str:
    return f"{proof.test}.{proof.expectation}" if proof.expectation else proof.test


def _code(lines: Sequence[Line]) -> str:
    if not lines:
        return ", no line of C"
    more = f" and {len(lines) - MOST_LINES} more" if len(lines) > MOST_LINES else ""
    return f", C: {_lines(lines[:MOST_LINES])}{more}"


def _lines(lines: Sequence[Line]) -> str:
    """Return lines as `estimator.c:12,15 estimator.h:4`."""
    files: dict[str, list[str]] = {}
    for file, line in lines:
        files.setdefault(file, []).append(str(line))
    return " ".join(f"{file}:{','.join(numbers)}" for file, numbers in files.items())
