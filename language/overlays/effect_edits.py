"""Edits that an effect makes in a tree: redirected reads, rewritten equations, moved summands."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from language.expressions.text_rewrite import (
    join_summands,
    names_in_text,
    split_balance,
    split_summands,
    substitute_reads,
)
from language.overlays.name_types import formula_entries
from language.readers.element_reader import outputs_as_mapping
from language.text.diagnostic import Span
from language.text.document import Entry, MappingNode, ScalarNode, YamlNode
from language.text.expression_paths import AUTOMATON_SITES, KeyPath, map_formulas
from language.text.node_edit import find_node, mapping_entries, put_node

MODE_CONTAINERS = frozenset({"modes", "regions", "templates", "transition_table"})
"""Sections at the root that contain modes or transitions of modes."""

PathPredicate = Callable[[KeyPath], bool]
"""Tells whether an edit applies to the expression at a key path."""


@dataclasses.dataclass(frozen=True)
class Redirection:
    """A replacement of names in the expressions at `paths`, except at `exceptions`.

    `replacements` gives the new name for each old one. `span` is the place of the redirection in
    the effect.
    """

    paths: tuple[str, ...]
    exceptions: tuple[str, ...]
    replacements: Mapping[str, str]
    span: Span


def redirect_reads(
    tree: MappingNode, redirection: Redirection
) -> tuple[MappingNode, frozenset[str]]:
    """Return a tree with the reads at some paths redirected, and the old names that were found.

    A path is a key path like `flow.w` with all expressions below it: from the root, and inside each
    mode, region, template and transition table. `everywhere` stands for all expressions and
    outputs, `outputs` for outputs. A path of an equation also covers the equations that only this
    equation reads, directly or indirectly. `exceptions` are key paths of the same form, `outputs`
    or `outputs.<name>`; what they match is never redirected, and neither are `der(x)`, `in(x)`,
    parameters and start values.
    """
    redirected_names: set[str] = set()
    applies_to = _path_predicate(tree, redirection)

    def change(path: KeyPath, scalar: ScalarNode) -> ScalarNode:
        """Return the scalar with its reads redirected if the redirection applies to its path."""
        if not applies_to(path):
            return scalar
        text, hits = substitute_reads(scalar.text, redirection.replacements)
        redirected_names.update(hits)
        return rewrite_scalar(scalar, text, redirection.span) if hits else scalar

    tree = map_formulas(tree, AUTOMATON_SITES, change)
    outputs = tree.get("outputs")
    if outputs is not None and {"outputs", "everywhere"} & set(redirection.paths):
        table, hits = _redirect_outputs(outputs_as_mapping(outputs), redirection)
        redirected_names.update(hits)
        if hits:
            span = tree.entries["outputs"].span
            tree = MappingNode(
                {**tree.entries, "outputs": Entry("outputs", span, table)}, tree.span
            )
    return tree, frozenset(redirected_names)


def rewrite_scalar(scalar: ScalarNode, text: str, span: Span) -> ScalarNode:
    """Return a scalar with another text; `span` (the overlay) is appended to its changes."""
    return dataclasses.replace(scalar, text=text, changes=(*scalar.changes, span))


def rewrite_equation(tree: MappingNode, name: str, formula: ScalarNode) -> MappingNode:
    """Return a tree with the formula of an equation replaced wherever it is given.

    This is at the root, in modes, in regions and in templates. The name `base` in `formula` stands
    for the old formula of that place. A tree without the equation is returned unchanged.
    """

    def change(path: KeyPath, scalar: ScalarNode) -> ScalarNode:
        """Return the new formula if the path is that of the equation."""
        if not _matches_key(path, f"equations.{name}"):
            return scalar
        text, _ = substitute_reads(formula.text, {"base": scalar.text})
        return rewrite_scalar(scalar, text, formula.span)

    return map_formulas(tree, AUTOMATON_SITES, change)


def has_formula_at(tree: MappingNode, key: str) -> bool:
    """Tell whether there is an expression at or below a key path such as `flow.w_w`.

    The key path is one from the root or one inside a mode, region, template or transition table. It
    is always true for `everywhere` and `outputs`. Parameters and start values do not count.
    """
    if key in ("everywhere", "outputs"):
        return True
    matches = []

    def look(path: KeyPath, scalar: ScalarNode) -> ScalarNode:
        """Record whether the path matches; return the scalar unchanged."""
        matches.append(_matches_key(path, key))
        return scalar

    map_formulas(tree, AUTOMATON_SITES, look)
    return any(matches)


def _path_predicate(tree: MappingNode, redirection: Redirection) -> PathPredicate:
    """Return the predicate of the paths to which a redirection applies."""
    is_everywhere = "everywhere" in redirection.paths
    keys = [name for path in redirection.paths for name in _equation_keys(tree, path)]

    def applies(path: KeyPath) -> bool:
        """Return whether the paths cover an expression and the exceptions do not."""
        is_covered = is_everywhere or any(_matches_key(path, key) for key in keys)
        return is_covered and not any(_matches_key(path, key) for key in redirection.exceptions)

    return applies


def _matches_key(path: KeyPath, key: str) -> bool:
    """Tell whether a path is a key path or below it; `flow.w` also matches in each mode."""
    key_path = tuple(key.split("."))
    length = len(key_path)
    starts = range(len(path) - length + 1) if path[0] in MODE_CONTAINERS else (0,)
    return any(path[start : start + length] == key_path for start in starts)


def _equation_keys(tree: MappingNode, key: str) -> list[str]:
    """Return the key path of an equation and of the equations that only it reads.

    Equations that only those read are included in turn. Another key path is returned alone.
    """
    section, _, name = key.partition(".")
    if section != "equations":
        return [key]
    readers: dict[str, set[str]] = {}
    equations = {equation for equation, _ in formula_entries(tree, "equations")}

    def look(path: KeyPath, scalar: ScalarNode) -> ScalarNode:
        """Record the readers of each name; return the scalar unchanged."""
        reader = path[-1] if path[-2:-1] == ("equations",) else ".".join(path)
        if path[0] not in ("elements", "places"):
            for read in names_in_text(scalar.text):
                readers.setdefault(read, set()).add(reader)
        return scalar

    map_formulas(tree, AUTOMATON_SITES, look)
    inside = {name}
    while True:
        more = {e for e in equations - inside if readers.get(e) and readers[e] <= inside}
        if not more:
            return [f"equations.{equation}" for equation in sorted(inside)]
        inside |= more


def _redirect_outputs(
    outputs: MappingNode, redirection: Redirection
) -> tuple[MappingNode, set[str]]:
    """Return the outputs with their variables replaced, and the old names that were found.

    Outputs among the exceptions of the redirection are not replaced.
    """
    entries, hits = {}, set()
    for entry in outputs:
        node = entry.node
        is_free = not any(_matches_key(("outputs", entry.key), k) for k in redirection.exceptions)
        if is_free and isinstance(node, ScalarNode) and node.text in redirection.replacements:
            hits.add(node.text)
            node = rewrite_scalar(node, redirection.replacements[node.text], redirection.span)
        entries[entry.key] = Entry(entry.key, entry.span, node)
    return MappingNode(entries, outputs.span), hits


@dataclass(frozen=True)
class MovedSummands:
    """Summands that were removed from a balance, and the tree without them.

    `summands` are pairs of sign and text, `terms` are named terms, and `source` is the place of the
    balance.
    """

    tree: MappingNode
    summands: list[tuple[str, str]]
    terms: dict[str, YamlNode]
    source: Span


def remove_summands(
    tree: MappingNode, state: str, names: set[str], span: Span
) -> MovedSummands | None:
    """Remove the top-level summands that read one of `names` from the balance of a state.

    Terms of the balance at the root count as summands. If nothing reads a name, both lists of the
    result are empty and the tree is unchanged. `span` is recorded as the change of the balance.
    Returns None if the root has no balance of the state, because then it is not the same in every
    mode.
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
    remaining_terms = {}
    terms = find_node(tree, ("terms", state))
    for entry in mapping_entries(terms):
        if isinstance(entry.node, ScalarNode) and names & set(names_in_text(entry.node.text)):
            moved[entry.key] = entry.node
        else:
            remaining_terms[entry.key] = entry
    if moved and terms:
        tree = put_node(tree, ("terms", state), MappingNode(remaining_terms, terms.span))
    return MovedSummands(tree, removed, moved, balance.span)


def insert_summands(body: MappingNode, state: str, moved: MovedSummands) -> MappingNode:
    """Return the body of an effect with moved summands and terms in the balance of a state.

    Summands are appended with their signs to the right side of `flow.<state>`, and left out if the
    body has no such balance. Terms are added to `terms.<state>` under their own names.
    """
    balance = find_node(body, ("flow", state))
    if isinstance(balance, ScalarNode) and moved.summands:
        left, right = split_balance(balance.text)
        text = f"{left} = {join_summands([*split_summands(right), *moved.summands])}"
        body = put_node(body, ("flow", state), rewrite_scalar(balance, text, moved.source))
    for name, node in moved.terms.items():
        body = put_node(body, ("terms", state, name), node)
    return body
