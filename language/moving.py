"""Moving: summands that leave the balance of one state for that of another."""

from __future__ import annotations

from dataclasses import dataclass

from language.document import Node, Scalar, Table
from language.problem import Span
from language.redirect import rewritten
from language.rewrite import joined, reads, sides, summands
from language.tree import at, entries, put


@dataclass(frozen=True)
class Moved:
    """A tree without the summands that left, and these with their signs; terms by name."""

    tree: Table
    summands: list[tuple[str, str]]
    terms: dict[str, Node]
    source: Span


def taken_out(tree: Table, state: str, names: set[str], span: Span) -> Moved | None:
    """Take the top-level summands that name some variables out of the balance of a state.

    Its terms count as summands. None where the balance is not the same in every mode.
    """
    balance = at(tree, ("flow", state))
    if not isinstance(balance, Scalar):
        return None
    left, right = sides(balance.text)
    parts = summands(right)
    gone = [part for part in parts if names & set(reads(part[1]))]
    stay = [part for part in parts if part not in gone]
    if gone:
        text = f"{left} = {joined(stay)}"
        tree = put(tree, ("flow", state), rewritten(balance, text, span))
    moved: dict[str, Node] = {}
    kept = {}
    terms = at(tree, ("terms", state))
    for entry in entries(terms):
        if isinstance(entry.node, Scalar) and names & set(reads(entry.node.text)):
            moved[entry.key] = entry.node
        else:
            kept[entry.key] = entry
    if moved and terms:
        tree = put(tree, ("terms", state), Table(kept, terms.span))
    return Moved(tree, gone, moved, balance.span)


def put_in(body: Table, state: str, moved: Moved) -> Table:
    """Return an effect's body with the summands that moved in the balance of its state."""
    balance = at(body, ("flow", state))
    if isinstance(balance, Scalar) and moved.summands:
        left, right = sides(balance.text)
        text = f"{left} = {joined([*summands(right), *moved.summands])}"
        body = put(body, ("flow", state), rewritten(balance, text, moved.source))
    for name, node in moved.terms.items():
        body = put(body, ("terms", state, name), node)
    return body
