"""Show code: what tools say of generated C, for people and for machines."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from rich.console import Console
from rich.table import Table

from codegen.mcdc import Covered, Decision
from codegen.proofs.proof import Proof
from lockstep.fuzzing import Fuzzed


def print_proofs(console: Console, proofs: Sequence[Proof]) -> None:
    """Print what tools say of generated C, and each thing that they found."""
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


def proof_json(proof: Proof) -> dict[str, Any]:
    """Return what a machine wants of a check of generated C."""
    return {**vars(proof), "findings": list(proof.findings), "holds": proof.holds}


def print_fuzzed(console: Console, found: Fuzzed) -> None:
    """Print what came of fuzzing: what was tried, and each thing that was found."""
    console.print(
        f"{found.program}: {found.distinct} different sequences of {found.runs}, "
        f"{found.ticks} ticks, {found.transitions} transitions, {found.edges} edges of the C",
        soft_wrap=True,
        highlight=False,
    )
    console.print(f"modes: {', '.join(found.modes)}", soft_wrap=True, highlight=False)
    for finding in found.findings:
        console.print(f"sanitizers: {finding}", soft_wrap=True, highlight=False, markup=False)
    told = f"; first: {found.first}" if found.first else ""
    text = f"{found.differing} sequences differ from the engine{told}"
    console.print(text, soft_wrap=True, highlight=False, markup=False)


def fuzzed_json(found: Fuzzed) -> dict[str, Any]:
    """Return what a machine wants of fuzzing."""
    first = vars(found.first) if found.first else None
    lists = {"modes": list(found.modes), "findings": list(found.findings)}
    return {**vars(found), **lists, "first": first, "clean": found.is_clean}


def print_mcdc(console: Console, found: Covered) -> None:
    """Print what was shown of generated C, and each decision of which something was not."""
    for decision in found.missed:
        text = f"{found.file}:{decision.line}: {_marks(decision)} {decision.text}"
        console.print(text, soft_wrap=True, highlight=False, markup=False)
    text = (
        f"{found.file}: of {found.conditions} conditions {found.shown} are shown to matter (MC/DC) "
        f"by {found.sequences} sequences, {found.steps} steps; "
        f"{found.conditions - found.shown - found.open} are proven infeasible, {found.open} open"
    )
    console.print(text, soft_wrap=True, highlight=False)


def _marks(decision: Decision) -> str:
    """Return a mark for each condition: `+` if it was shown, `T` or `F` if it is always true or
    false, else `-`.
    """
    never = {None: "-", True: "F", False: "T"}
    pairs = zip(decision.shown, decision.never, strict=True)
    return "".join("+" if shown else never[outcome] for shown, outcome in pairs)


def mcdc_json(found: Covered) -> dict[str, Any]:
    """Return what a machine wants of MC/DC."""
    decisions = [
        {**vars(each), "shown": list(each.shown), "never": list(each.never)}
        for each in found.decisions
    ]
    counts = {"conditions": found.conditions, "shown": found.shown, "open": found.open}
    return {**vars(found), **counts, "decisions": decisions}
