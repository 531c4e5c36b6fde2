"""Checks of an effect on its own: errors that do not depend on the place of application."""

from __future__ import annotations

import re
from collections.abc import Collection

from language.expressions.syntax_tree import FunctionCall, SyntaxTree, children
from language.expressions.units import NO_UNIT, UNKNOWN_UNIT
from language.overlays.effect_scale import QUANTITY_KEYS, remove_scale
from language.readers.base_reader import Reader
from language.readers.parameter_reader import ParameterReader
from language.text.diagnostic import Problems, Span, suggest_name
from language.text.document import Entry, MappingNode, ScalarNode, YamlNode
from language.text.node_edit import format_inline, mapping_entries, put_node, scalars_of
from language.typecheck.function_calls import FUNCTION_NAMES, argument_count_error

HOLE_PATTERN = re.compile(r"\$[A-Za-z]\w*")
"""A hole in a key or expression of an effect."""
KEY_HOLE_SECTIONS = ("terms", "equations", "redirect", "move")
"""Sections whose keys may be holes."""
UNIT_SECTIONS = ("parameters", "states", "discrete")
"""Sections of declarations whose unit may be a hole."""


def check_holes(tree: MappingNode, holes: Collection[str], problems: Problems) -> None:
    """Report holes in keys and units that are not in `holes` (texts with `$`).

    Examined are the keys of `terms`, `equations`, `redirect` and `move` (KEY_HOLE_SECTIONS), and
    the `unit` of parameters, states and discrete variables (UNIT_SECTIONS). Holes in expressions
    are not.
    """
    texts = [
        (entry.key, entry.span)
        for section in KEY_HOLE_SECTIONS
        for entry in mapping_entries(tree.get(section))
    ]
    for section in UNIT_SECTIONS:
        for entry in mapping_entries(tree.get(section)):
            unit = entry.node.get("unit") if isinstance(entry.node, MappingNode) else None
            if isinstance(unit, ScalarNode):
                texts.append((unit.text, unit.span))
    for text, span in texts:
        for match in HOLE_PATTERN.finditer(text):
            hole = match.group()
            if hole not in holes:
                report_unknown_hole(hole, span.subspan(match.start(), len(hole)), holes, problems)


def report_unknown_hole(hole: str, span: Span, holes: Collection[str], problems: Problems) -> None:
    """Report a hole (with `$`) that no place of the effect has.

    The hint is the most similar hole of `holes`, or `has: [<hole>]` which declares it.
    """
    label = f"`{hole}` is not a hole of the places where this effect fits"
    hint = suggest_name(hole, holes) or f"`has: [{hole[1:]}]` declares it"
    problems.error("effect", span, label, hint)


def check_functions(tree: SyntaxTree, problems: Problems) -> None:
    """Report unknown functions and wrong numbers of arguments in an expression, at any depth.

    Known are FUNCTION_NAMES. The types of arguments are not checked.
    """
    if isinstance(tree, FunctionCall):
        if tree.function not in FUNCTION_NAMES:
            hint = (
                suggest_name(tree.function, FUNCTION_NAMES)
                or f"there are `{' '.join(FUNCTION_NAMES)}`"
            )
            span = tree.span.subspan(0, len(tree.function))
            problems.error("name", span, f"`{tree.function}` is not a function", hint)
        elif label := argument_count_error(tree):
            problems.error("arguments", tree.span, label)
    for part in children(tree):
        check_functions(part, problems)


def check_parameters(tree: MappingNode, problems: Problems) -> None:
    """Report wrong or inconsistent values, ranges and starts of the parameters of an effect.

    The problems are those of `ParameterReader`. A unit with a hole is left out before; a parameter
    is skipped if it has a lookup table with holes, or quantities with units beside such a unit.
    """
    known = tree.get("parameters")
    if isinstance(known, MappingNode):
        checkable = {entry.key: _remove_hole_unit(remove_scale(entry, problems)) for entry in known}
        tree = put_node(
            tree,
            ("parameters",),
            MappingNode({k: e for k, e in checkable.items() if e}, known.span),
        )
    ParameterReader(problems, tree).read_parameters()


def _remove_hole_unit(entry: Entry) -> Entry | None:
    """Return a parameter without its unit if the unit contains a hole.

    Returns None if the parameter cannot be checked before the place is known: it has a lookup table
    with holes, or quantities with units beside a unit that is a hole.
    """
    table = entry.node
    if not isinstance(table, MappingNode) or not HOLE_PATTERN.search(format_inline(table)):
        return entry
    if "table" in table.entries:
        return None
    if not (isinstance(unit := table.get("unit"), ScalarNode) and HOLE_PATTERN.search(unit.text)):
        return entry
    if any(_has_unit(table.get(key)) for key in QUANTITY_KEYS):
        return None
    entries_without_unit = {key: part for key, part in table.entries.items() if key != "unit"}
    return Entry(entry.key, entry.span, MappingNode(entries_without_unit, table.span))


def _has_unit(node: YamlNode | None) -> bool:
    """Tell whether one of the literals at a node has a unit."""
    reader = Reader(Problems())
    own = [reader.read_quantity(item, "value", item.span, None)[1] for item in scalars_of(node)]
    return any(unit not in (NO_UNIT, UNKNOWN_UNIT) for unit in own)
