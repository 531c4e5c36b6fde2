"""Application of an effect at a place of an automaton's tree (docs/language.md).

An effect is a partial tree with holes such as `$x`. This module fills the holes with the values of
the place, gives the names of the effect a suffix, redirects reads, moves summands, and merges the
result into the tree.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from language.expressions.name_rules import NAME_PATTERN, check_name
from language.expressions.text_rewrite import rename_names
from language.overlays.effect_edits import (
    Redirection,
    has_formula_at,
    insert_summands,
    redirect_reads,
    remove_summands,
    rewrite_equation,
    rewrite_scalar,
)
from language.overlays.effect_place import EffectPlace, Hole, PlaceMismatch, find_effect_place
from language.overlays.effect_reader import ADDED_SECTIONS, EffectApplication, added_names
from language.overlays.effect_scale import scale_parameters
from language.overlays.name_types import formula_entries
from language.overlays.parameter_override import set_parameter_value
from language.text.diagnostic import Problems, Source, Span, suggest_name
from language.text.document import Entry, MappingNode, ScalarNode, SequenceNode, YamlNode
from language.text.expression_paths import EFFECT_SITES, KeyPath, map_formulas
from language.text.node_edit import find_node, mapping_entries, put_node, replace_source, scalars_of
from language.text.overlay import apply_overlay

HOLE_PATTERN = re.compile(r"\$([A-Za-z]\w*)")
"""A hole in a key or expression of an effect; group 1 is its name."""
VARIABLE_SECTIONS = ("parameters", "states", "discrete", "equations")
"""Sections of an effect whose keys are names of variables that it adds."""
ASSIGNING_SECTIONS = ("equations", "update", "entry", "exit", "reset", "flow", "terms")
"""Sections of a mode or transition whose keys are names of variables."""


def apply_effect(
    tree: MappingNode, application: EffectApplication, problems: Problems
) -> MappingNode:
    """Return the tree with an effect applied at its place. Raises SpecError with all problems.

    Holes are filled with the values of the place. Names that the effect adds get the suffix
    `_<suffix>` of the application, or their name under `rename`.

    The order is: redirections, equations that use `base`, moved summands, additions with the
    parameter values of the application. Redirections therefore do not reach the formulas that the
    effect adds.

    Errors are a place that the effect does not fit, a hole without a value, names that are taken,
    unknown names under `rename` or `values`, and edits without a hit.
    """
    place = find_effect_place(tree, application.effect, application.place)
    if isinstance(place, PlaceMismatch):
        _report_mismatch(application, place, problems)
    problems.raise_if_errors()
    assert isinstance(place, EffectPlace)
    return _EffectApplier(application, place, tree, problems).apply()


def _report_mismatch(
    application: EffectApplication, mismatch: PlaceMismatch, problems: Problems
) -> None:
    """Report at the place of an application why the effect cannot be applied."""
    label = f"`{application.effect.name}` cannot be applied here: {mismatch.reason}"
    problems.error("effect", application.place_span, label, mismatch.help)


class _EffectApplier:
    """The application of one effect at one place of a tree."""

    def __init__(
        self,
        application: EffectApplication,
        place: EffectPlace,
        tree: MappingNode,
        problems: Problems,
    ) -> None:
        """Choose the names that the effect gets in the tree.

        Raises SpecError for a wrong name or hole.
        """
        self.application = application
        self.place = place
        self.tree = tree
        self.problems = problems
        source = application.effect.span.source
        overlay = Source(source.name, source.lines, application.overlay_name, application.span)
        body = replace_source(application.effect.body, overlay)
        assert isinstance(body, MappingNode)
        self.body = scale_parameters(body, application.scales, application.values)
        self.private_names = self._choose_private_names()
        self._check_holes()
        problems.raise_if_errors()

    def apply(self) -> MappingNode:
        """Return the tree with the effect applied. Raises SpecError."""
        body = self._fill_holes(self.body)
        tree = self._apply_redirects(self.tree, body)
        tree = self._rewrite_equations(tree, body)
        body = self._select_additions(body)
        tree, body = self._move_summands(tree, body)
        self.problems.raise_if_errors()
        return apply_overlay(tree, self._set_values(body), self.problems)

    def _select_additions(self, body: MappingNode) -> MappingNode:
        """Return the sections that the effect adds to the tree.

        Rewritten equations of the tree are not among them.
        """
        added = {key: entry for key, entry in body.entries.items() if key in ADDED_SECTIONS}
        body = MappingNode(added, body.span)
        table = body.get("equations")
        if isinstance(table, MappingNode):
            own = set(self.private_names.values())
            new = {key: entry for key, entry in table.entries.items() if key in own}
            body = put_node(body, ("equations",), MappingNode(new, table.span))
        return body

    def _choose_private_names(self) -> dict[str, str]:
        """Return the name in the tree of each name that the effect adds.

        It is the name with the suffix of the application, or the name under `rename`. Names that
        are taken or not valid are reported, also those of elements and regions.
        """
        own = {name: f"{name}_{self.application.suffix}" for name in added_names(self.body)}
        for name, entry in self.application.rename.items():
            if name in own and isinstance(entry.node, ScalarNode):
                own[name] = entry.node.text
            else:
                label = f"`{self.application.effect.name}` has no name `{name}`"
                self.problems.error("effect", entry.span, label, suggest_name(name, own))
        taken = set(_used_names(self.tree))
        for name, final in own.items():
            renamed_to = self.application.rename.get(name)
            span = renamed_to.node.span if renamed_to else None
            self._check_private_name(name, final, final in taken, span or self.application.span)
            taken.add(final)
        for section in ("elements", "regions"):
            node = self.tree.get(section)
            present = node.entries if isinstance(node, MappingNode) else {}
            for entry in mapping_entries(self.body.get(section)):
                final = self._with_suffix(entry.key)
                self._check_private_name(entry.key, final, final in present, self.application.span)
        return own

    def _check_private_name(self, name: str, private_name: str, is_taken: bool, span: Span) -> None:
        """Report a name of the effect that is too long, taken or not valid in the tree."""
        if not NAME_PATTERN.fullmatch(private_name):
            length = f"{len(private_name)} characters"
            label = f"`{name}` of the effect would be called `{private_name}`: {length}"
            self.problems.error("effect", span, label, "`as: ...` gives a shorter ending")
        elif is_taken:
            label = f"`{name}` of the effect would be called `{private_name}`, which is taken"
            self.problems.error("effect", span, label, "`as: ...` gives another ending")
        else:
            check_name(private_name, span, self.problems)

    def _with_suffix(self, name: str) -> str:
        """Return a name with the suffix of the application."""
        return f"{name}_{self.application.suffix}"

    def _check_holes(self) -> None:
        """Report the first hole of the body for which the place has no value."""
        name = self.place.name
        for hole in _holes_in(self.body):
            if hole not in self.place.holes:
                if self.application.effect.place_patterns[0].kind == "element":
                    misfit = PlaceMismatch(
                        f"element `{name}` has no `{hole}`", f"add `elements.{name}.{hole}`"
                    )
                else:
                    hint = f"add `places: {{{name}: {{{hole}: ...}}}}`"
                    misfit = PlaceMismatch(f"`{name}` declares no `{hole}`", hint)
                _report_mismatch(self.application, misfit, self.problems)
                return

    def _fill_holes(self, body: MappingNode) -> MappingNode:
        """Return the body with its holes filled and its own names replaced by those in the tree."""
        new = {**self.private_names}
        new.update(
            {f"${hole}": self._first_value(value) for hole, value in self.place.holes.items()}
        )

        def change(path: KeyPath, scalar: ScalarNode) -> ScalarNode:
            """Return an expression with the new names; exceptions of redirections stay."""
            if path[:2] == ("redirect", "except"):
                return scalar
            text = rename_names(scalar.text, new)
            return (
                rewrite_scalar(scalar, text, self.application.span)
                if text != scalar.text
                else scalar
            )

        return self._fill_keys(map_formulas(body, EFFECT_SITES, change), ())

    def _first_value(self, value: Hole) -> str:
        """Return the value of a hole; of a list its first item, or `0` if the list is empty."""
        return value if isinstance(value, str) else (value[0] if value else "0")

    def _fill_keys(self, table: MappingNode, path: KeyPath) -> MappingNode:
        """Return a mapping with holes in keys and texts filled, and keys renamed."""
        filled = {}
        for entry in table:
            node = entry.node
            if isinstance(node, MappingNode):
                node = self._fill_keys(node, (*path, entry.key))
            elif isinstance(node, ScalarNode) and "$" in node.text:
                node = rewrite_scalar(node, self._fill_text(node.text), self.application.span)
            for key in self._fill_key(entry.key, path):
                filled[key] = Entry(key, entry.span, node)
        return MappingNode(filled, table.span)

    def _fill_key(self, key: str, path: KeyPath) -> tuple[str, ...]:
        """Return the keys that replace a key: several if its hole is a list, else one.

        `path` is the path of the mapping that contains the key.
        """
        if "$" in key:
            match = HOLE_PATTERN.search(key)
            value = self.place.holes[match.group(1)] if match else ""
            values = (value,) if isinstance(value, str) else value
            return tuple(HOLE_PATTERN.sub(text, key, count=1) for text in values)
        if path in (("elements",), ("regions",)) or (path[:1] == ("terms",) and len(path) == 2):
            return (self._with_suffix(key),)
        names = len(path) == 1 and path[0] in (*VARIABLE_SECTIONS, "flow", "terms")
        inside = path[:1] == ("regions",) and path[-1] in ASSIGNING_SECTIONS
        return (self.private_names.get(key, key) if names or inside else key,)

    def _fill_text(self, text: str) -> str:
        """Return a text with its holes filled."""
        return HOLE_PATTERN.sub(
            lambda match: self._first_value(self.place.holes[match.group(1)]), text
        )

    def _apply_redirects(self, tree: MappingNode, body: MappingNode) -> MappingNode:
        """Return the tree with all entries of `redirect` applied; `body` is the filled body."""
        node, raw = body.get("redirect"), self.body.get("redirect")
        if not isinstance(node, MappingNode) or not isinstance(raw, MappingNode):
            return tree
        excepted = tuple(
            path
            for item in scalars_of(raw.get("except"))
            for path in self._fill_key(item.text, ("redirect",))
        )
        for entry in raw:
            if entry.key == "except" or not isinstance(entry.node, MappingNode):
                continue
            paths = self._fill_key(entry.key, ("redirect",))
            filled = node.get(paths[0]) if paths else None
            if isinstance(filled, MappingNode):
                tree = self._apply_redirect(tree, entry, paths, excepted, filled)
        return tree

    def _apply_redirect(
        self,
        tree: MappingNode,
        entry: Entry,
        paths: tuple[str, ...],
        excepted: KeyPath,
        pairs: MappingNode,
    ) -> MappingNode:
        """Return the tree with one entry of `redirect` applied at its key paths.

        A path without an expression, a source that is no name, and a redirection without any hit
        are reported. If the path comes from a list of places, it may have no hit.
        """
        for path in paths:
            if not has_formula_at(tree, path):
                _report_mismatch(
                    self.application, PlaceMismatch(f"there is no `{path}`"), self.problems
                )
                return tree
        new = {pair.key: pair.node.text for pair in pairs if isinstance(pair.node, ScalarNode)}
        for old in new:
            if not NAME_PATTERN.fullmatch(old):
                help = "give it a name: a derived parameter or an equation"
                misfit = PlaceMismatch(f"`{old}` would be redirected, and only a name can be", help)
                _report_mismatch(self.application, misfit, self.problems)
                return tree
        tree, hits = redirect_reads(tree, Redirection(paths, excepted, new, entry.span))
        is_list = any(
            not isinstance(self.place.holes[h], str) for h in HOLE_PATTERN.findall(entry.key)
        )
        if not hits and not is_list:
            olds = " or ".join(f"`{old}`" for old in new)
            readers = "nothing" if paths[0] == "everywhere" else f"nothing in `{paths[0]}`"
            _report_mismatch(
                self.application, PlaceMismatch(f"{readers} reads {olds}"), self.problems
            )
        return tree

    def _rewrite_equations(self, tree: MappingNode, body: MappingNode) -> MappingNode:
        """Return the tree with the equations rewritten that the effect names by a hole.

        A key such as `$torque` names an equation of the tree, and `base` in its formula stands for
        the old one. Unknown equations are reported.
        """
        for entry in mapping_entries(self.body.get("equations")):
            if not entry.key.startswith("$"):
                continue
            (name,) = self._fill_key(entry.key, ("equations",))
            node = find_node(body, ("equations", name))
            if name not in {equation for equation, _ in formula_entries(tree, "equations")}:
                _report_mismatch(
                    self.application, PlaceMismatch(f"there is no equation `{name}`"), self.problems
                )
            elif isinstance(node, ScalarNode):
                tree = rewrite_equation(tree, name, node)
        return tree

    def _move_summands(
        self, tree: MappingNode, body: MappingNode
    ) -> tuple[MappingNode, MappingNode]:
        """Return tree and body with the summands under `move` moved to balances of the body.

        The summands of the place's balance that read a given name go to the balance of a state of
        the effect. Problems are reported if the target is no such state, if the balance differs
        between modes, or if no summand reads the name.
        """
        source = self.place.balance_state
        for entry in mapping_entries(self.body.get("move")):
            target = entry.node.text if isinstance(entry.node, ScalarNode) else ""
            if target not in self.private_names or source is None:
                label = "what moves goes to the balance of a state of the effect"
                self.problems.error("effect", entry.span, label)
                continue
            names = set(self._fill_key(entry.key, ("move",)))
            moved = remove_summands(tree, source, names, entry.span)
            if moved is None:
                why = f"the balance of `{source}` is not the same in every mode"
                _report_mismatch(self.application, PlaceMismatch(why), self.problems)
            elif names and not moved.summands and not moved.terms:
                shown = ", ".join(f"`{name}`" for name in sorted(names))
                why = f"no summand of the balance of `{source}` names {shown}"
                _report_mismatch(self.application, PlaceMismatch(why), self.problems)
            else:
                tree, body = moved.tree, insert_summands(body, self.private_names[target], moved)
        return tree, body

    def _set_values(self, body: MappingNode) -> MappingNode:
        """Return the body with the parameter values of the application. Raises SpecError."""
        raw = self.body.get("parameters")
        own = raw.entries if isinstance(raw, MappingNode) else {}
        for name, entry in self.application.values.items():
            table = find_node(body, ("parameters", self.private_names.get(name, name)))
            if name not in own or not isinstance(table, MappingNode):
                label = f"`{self.application.effect.name}` has no parameter `{name}`"
                self.problems.error("effect", entry.span, label, suggest_name(name, own))
            elif "derived" in table.entries:
                label = f"`{name}` is derived: set the parameters that it reads"
                self.problems.error("values", entry.span, label)
            elif isinstance(entry.node, ScalarNode):
                overridden = set_parameter_value(table, entry.node)
                body = put_node(body, ("parameters", self.private_names[name]), overridden)
        self.problems.raise_if_errors()
        return body


def _used_names(tree: MappingNode) -> Iterator[str]:
    """Yield the names of parameters, inputs, states, discrete variables, regions and equations."""
    for section in ("parameters", "inputs", "states", "discrete", "regions"):
        for entry in mapping_entries(tree.get(section)):
            yield entry.key
    for name, _ in formula_entries(tree, "equations"):
        yield name


def _holes_in(body: MappingNode) -> list[str]:
    """Return the names of the holes in the body of an effect, each once."""
    holes: dict[str, None] = {}

    def look(node: YamlNode | None) -> None:
        """Collect the holes of a node."""
        match node:
            case ScalarNode():
                holes.update(dict.fromkeys(HOLE_PATTERN.findall(node.text)))
            case SequenceNode():
                for part in node.nodes:
                    look(part)
            case MappingNode():
                for entry in node:
                    holes.update(dict.fromkeys(HOLE_PATTERN.findall(entry.key)))
                    if entry.key not in ("about", "req"):
                        look(entry.node)

    for section in (*ADDED_SECTIONS, "redirect", "move"):
        look(body.get(section))
    return list(holes)
