"""Moving: summands that leave the balance of one state for that of another."""

from __future__ import annotations

from dataclasses import dataclass

from language.document import MappingNode, ScalarNode, YamlNode
from language.problem import Span
from language.redirect import rewrite_scalar
from language.rewrite import join_summands, names_in_text, split_balance, split_summands
from language.tree import entries, find_node, put_node


@dataclass(frozen=True)
class MovedSummands:
    """A tree without the summands that left, and these with their signs; terms by name."""

    tree: MappingNode
    summands: list[tuple[str, str]]
    terms: dict[str, YamlNode]
    source: Span


def remove_summands(
    tree: MappingNode, state: str, names: set[str], span: Span
) -> MovedSummands | None:
    """Take the top-level summands that name some variables out of the balance of a state.

    Its terms count as summands. None where the balance is not the same in every mode.
    """
    balance = find_node(tree, ("flow", state))
    if not isinstance(balance, ScalarNode):
        return None
    left, right = split_balance(balance.text)
    parts = split_summands(right)
    removed = [part for part in parts if names & set(names_in_text(part[1]))]
    remaining = [part for part in parts if part not in removed]
    if removed:
        text = f"{left} = {join_summands(remaining)}"
        tree = put_node(tree, ("flow", state), rewrite_scalar(balance, text, span))
    moved: dict[str, YamlNode] = {}
    kept = {}
    terms = find_node(tree, ("terms", state))
    for entry in entries(terms):
        if isinstance(entry.node, ScalarNode) and names & set(names_in_text(entry.node.text)):
            moved[entry.key] = entry.node
        else:
            kept[entry.key] = entry
    if moved and terms:
        tree = put_node(tree, ("terms", state), MappingNode(kept, terms.span))
    return MovedSummands(tree, removed, moved, balance.span)


def insert_summands(body: MappingNode, state: str, moved: MovedSummands) -> MappingNode:
    """Return an effect's body with the summands that moved in the balance of its state."""
    balance = find_node(body, ("flow", state))
    if isinstance(balance, ScalarNode) and moved.summands:
        left, right = split_balance(balance.text)
        text = f"{left} = {join_summands([*split_summands(right), *moved.summands])}"
        body = put_node(body, ("flow", state), rewrite_scalar(balance, text, moved.source))
    for name, node in moved.terms.items():
        body = put_node(body, ("terms", state, name), node)
    return body
