"""Code verification: print proofs, fuzzing and MC/DC of generated C."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from rich.console import Console
from rich.table import Table

from codegen.coverage.mcdc import Decision, McdcCoverage
from codegen.toolchain.tool_verdict import ToolVerdict
from lockstep.fuzzing import FuzzReport
from modewright.runtime.json_format import format_entry


def print_proofs(console: Console, proofs: Sequence[ToolVerdict]) -> None:
    """Print a table with a row for each check, then each finding in a line `check: finding`.

    A row has the check, its tool, `about` and the number of findings, or `nothing` without any. A
    check that does not apply (`is_asked` is false) has `not asked` instead of the number; findings
    of it are listed all the same.
    """
    table = Table(box=None, pad_edge=False)
    for title in ("check", "tool", "of", "found"):
        table.add_column(title, overflow="fold")
    for proof in proofs:
        count = str(len(proof.findings)) if proof.findings else "nothing"
        count = count if proof.is_asked else "not asked"
        table.add_row(proof.check, proof.tool, proof.about, count)
    console.print(table)
    for proof in proofs:
        for finding in proof.findings:
            console.print(f"{proof.check}: {finding}", soft_wrap=True, highlight=False)


def proof_json(proof: ToolVerdict) -> dict[str, Any]:
    """Return the fields of a verdict, with `holds`, as a dict for JSON."""
    return {**vars(proof), "findings": list(proof.findings), "holds": proof.holds}


def print_fuzzing(console: Console, result: FuzzReport) -> None:
    """Print the counts of a fuzzing run, the modes, the findings and the first difference."""
    console.print(
        f"{result.program}: {result.distinct} different sequences of {result.runs}, "
        f"{result.ticks} ticks, {result.transitions} transitions, {result.edges} edges of the C",
        soft_wrap=True,
        highlight=False,
    )
    console.print(f"modes: {', '.join(result.modes)}", soft_wrap=True, highlight=False)
    for finding in result.findings:
        console.print(f"sanitizers: {finding}", soft_wrap=True, highlight=False, markup=False)
    first = f"; first: {result.first}" if result.first else ""
    text = f"{result.differing} sequences differ from the engine{first}"
    console.print(text, soft_wrap=True, highlight=False, markup=False)


def fuzzing_json(result: FuzzReport) -> dict[str, Any]:
    """Return the fields of a fuzzing report, with `clean`, as a dict for JSON.

    `first` is the first difference, or None.
    """
    first = vars(result.first) if result.first else None
    lists = {"modes": list(result.modes), "findings": list(result.findings)}
    values = {**vars(result), **lists, "first": first, "clean": result.is_clean}
    return {**format_entry("fuzzing"), **values}


def print_mcdc(console: Console, coverage: McdcCoverage) -> None:
    """Print a line for each decision that is not fully covered, and a line with the counts.

    A decision has a mark for each condition: `+` shown to matter, `T` or `F` proven to be always
    true or false, `-` open.
    """
    for decision in coverage.uncovered:
        text = f"{coverage.file}:{decision.line}: {_marks(decision)} {decision.text}"
        console.print(text, soft_wrap=True, highlight=False, markup=False)
    text = (
        f"{coverage.file}: of {coverage.conditions} conditions {coverage.shown} "
        f"are shown to matter (MC/DC) by {coverage.sequences} sequences, {coverage.steps} steps; "
        f"{coverage.conditions - coverage.shown - coverage.open} are proven infeasible, "
        f"{coverage.open} open"
    )
    console.print(text, soft_wrap=True, highlight=False)


def _marks(decision: Decision) -> str:
    """Return a mark for each condition: `+` covered, `T` or `F` always true or false, else `-`."""
    never = {None: "-", True: "F", False: "T"}
    pairs = zip(decision.shown, decision.never, strict=True)
    return "".join("+" if shown else never[outcome] for shown, outcome in pairs)


def mcdc_json(coverage: McdcCoverage) -> dict[str, Any]:
    """Return the fields of an MC/DC coverage as a dict for JSON, with all decisions.

    It also has the counts `conditions`, `shown` and `open`.
    """
    decisions = [
        {**vars(each), "shown": list(each.shown), "never": list(each.never)}
        for each in coverage.decisions
    ]
    counts = {"conditions": coverage.conditions, "shown": coverage.shown, "open": coverage.open}
    return {**format_entry("mcdc"), **vars(coverage), **counts, "decisions": decisions}
