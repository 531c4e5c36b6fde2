"""Laying: an effect laid at a place of an automaton's tree (docs/language.md)."""

from __future__ import annotations

import re
from collections.abc import Iterator

from language.document import Entry, Items, Node, Scalar, Table
from language.effect import ADDED, Laying, own_names
from language.known import entries_of
from language.moving import put_in, taken_out
from language.names import NAME, check_name
from language.overlay import lay
from language.passage import EFFECT, Path, changed
from language.place import Hole, Misfit, Place, place_of
from language.problem import Problems, Source, Span, nearest
from language.redirect import Part, exists, rebuilt, redirected, rewritten
from language.rewrite import renamed
from language.tree import at, entries, items_of, put, resourced
from language.values import with_value

HOLE = re.compile(r"\$([A-Za-z]\w*)")
VARIABLES = ("parameters", "states", "discrete", "equations")
WRITES = ("equations", "update", "entry", "exit", "reset", "flow", "terms")
"""Sections of a mode or transition whose keys are names of variables."""


def lay_effect(tree: Table, laying: Laying, problems: Problems) -> Table:
    """Return the tree with an effect laid over it. Raises SpecError.

    In this order: redirections (the effect's own lines are not among what they reach), what
    builds on a `base`, what moves, what is added.
    """
    place = place_of(tree, laying.effect, laying.place)
    if isinstance(place, Misfit):
        _refuse(laying, place, problems)
    problems.stop_if_any()
    assert isinstance(place, Place)
    return _Layer(laying, place, tree, problems).laid()


def _refuse(laying: Laying, misfit: Misfit, problems: Problems) -> None:
    label = f"`{laying.effect.name}` cannot be laid here: {misfit.why}"
    problems.error("effect", laying.place_span, label, misfit.help)


class _Layer:
    """One effect at one place: its body with holes filled, then what it does to the tree."""

    def __init__(self, laying: Laying, place: Place, tree: Table, problems: Problems) -> None:
        self.laying = laying
        self.place = place
        self.tree = tree
        self.problems = problems
        source = laying.effect.span.source
        layer = Source(source.name, source.lines, laying.title, laying.span)
        body = resourced(laying.effect.body, layer)
        assert isinstance(body, Table)
        self.body = body
        self.private = self._private_names()
        self._check_holes()
        problems.stop_if_any()

    def laid(self) -> Table:
        body = self._filled(self.body)
        tree = self._redirected(self.tree, body)
        tree = self._based(tree, body)
        body = self._additions(body)
        tree, body = self._moved(tree, body)
        self.problems.stop_if_any()
        return lay(tree, self._with_values(body), self.problems)

    def _additions(self, body: Table) -> Table:
        """Return what is new: not the equations that the effect builds on."""
        added = {key: entry for key, entry in body.entries.items() if key in ADDED}
        body = Table(added, body.span)
        table = body.get("equations")
        if isinstance(table, Table):
            own = set(self.private.values())
            kept = {key: entry for key, entry in table.entries.items() if key in own}
            body = put(body, ("equations",), Table(kept, table.span))
        return body

    # Names.

    def _private_names(self) -> dict[str, str]:
        own = {name: f"{name}_{self.laying.ending}" for name in own_names(self.body)}
        for name, entry in self.laying.rename.items():
            if name in own and isinstance(entry.node, Scalar):
                own[name] = entry.node.text
            else:
                label = f"`{self.laying.effect.name}` has no name `{name}`"
                self.problems.error("effect", entry.span, label, nearest(name, own))
        taken = set(_taken(self.tree))
        for name, final in own.items():
            renamed_to = self.laying.rename.get(name)
            span = renamed_to.node.span if renamed_to else None
            self._check_final(name, final, final in taken, span or self.laying.span)
            taken.add(final)
        for section in ("elements", "regions"):
            node = self.tree.get(section)
            present = node.entries if isinstance(node, Table) else {}
            for entry in entries(self.body.get(section)):
                final = self._ended(entry.key)
                self._check_final(entry.key, final, final in present, self.laying.span)
        return own

    def _check_final(self, name: str, final: str, is_taken: bool, span: Span) -> None:
        if not NAME.fullmatch(final):
            label = f"`{name}` of the effect would be called `{final}`: {len(final)} characters"
            self.problems.error("effect", span, label, "`as: ...` gives a shorter ending")
        elif is_taken:
            label = f"`{name}` of the effect would be called `{final}`, which is taken"
            self.problems.error("effect", span, label, "`as: ...` gives another ending")
        else:
            check_name(final, span, self.problems)

    def _ended(self, name: str) -> str:
        return f"{name}_{self.laying.ending}"

    def _check_holes(self) -> None:
        name = self.place.name
        for hole in _holes_in(self.body):
            if hole not in self.place.holes:
                if self.laying.effect.fits[0].kind == "element":
                    misfit = Misfit(
                        f"element `{name}` has no `{hole}`", f"`elements.{name}.{hole}` would do"
                    )
                else:
                    hint = f"`places: {{{name}: {{{hole}: ...}}}}` would do"
                    misfit = Misfit(f"`{name}` declares no `{hole}`", hint)
                _refuse(self.laying, misfit, self.problems)
                return

    # Filling.

    def _filled(self, body: Table) -> Table:
        """Return the body with its holes filled and its own names made private."""
        new = {**self.private}
        new.update({f"${hole}": self._one(value) for hole, value in self.place.holes.items()})

        def change(path: Path, scalar: Scalar) -> Scalar:
            if path[:2] == ("redirect", "except"):
                return scalar
            text = renamed(scalar.text, new)
            return rewritten(scalar, text, self.laying.span) if text != scalar.text else scalar

        return self._keys(changed(body, EFFECT, change), ())

    def _one(self, value: Hole) -> str:
        return value if isinstance(value, str) else (value[0] if value else "0")

    def _keys(self, table: Table, path: Path) -> Table:
        made = {}
        for entry in table:
            node = entry.node
            if isinstance(node, Table):
                node = self._keys(node, (*path, entry.key))
            elif isinstance(node, Scalar) and "$" in node.text:
                node = rewritten(node, self._text(node.text), self.laying.span)
            for key in self._key(entry.key, path):
                made[key] = Entry(key, entry.span, node)
        return Table(made, table.span)

    def _key(self, key: str, path: Path) -> tuple[str, ...]:
        if "$" in key:
            found = HOLE.search(key)
            value = self.place.holes[found.group(1)] if found else ""
            values = (value,) if isinstance(value, str) else value
            return tuple(HOLE.sub(one, key, count=1) for one in values)
        if path in (("elements",), ("regions",)) or (path[:1] == ("terms",) and len(path) == 2):
            return (self._ended(key),)
        names = len(path) == 1 and path[0] in (*VARIABLES, "flow", "terms")
        inside = path[:1] == ("regions",) and path[-1] in WRITES
        return (self.private.get(key, key) if names or inside else key,)

    def _text(self, text: str) -> str:
        return HOLE.sub(lambda match: self._one(self.place.holes[match.group(1)]), text)

    # What an effect does.

    def _redirected(self, tree: Table, body: Table) -> Table:
        node, raw = body.get("redirect"), self.body.get("redirect")
        if not isinstance(node, Table) or not isinstance(raw, Table):
            return tree
        excepted = tuple(self._text(item.text) for item in items_of(raw.get("except")))
        for entry in raw:
            if entry.key == "except" or not isinstance(entry.node, Table):
                continue
            paths = self._key(entry.key, ("redirect",))
            filled = node.get(paths[0]) if paths else None
            if isinstance(filled, Table):
                tree = self._part(tree, entry, paths, excepted, filled)
        return tree

    def _part(
        self, tree: Table, entry: Entry, paths: tuple[str, ...], excepted: Path, pairs: Table
    ) -> Table:
        for path in paths:
            if not exists(tree, path):
                _refuse(self.laying, Misfit(f"there is no `{path}`"), self.problems)
                return tree
        new = {pair.key: pair.node.text for pair in pairs if isinstance(pair.node, Scalar)}
        for old in new:
            if not NAME.fullmatch(old):
                help = "give it a name: a derived parameter or an equation"
                misfit = Misfit(f"`{old}` would be redirected, and only a name can be", help)
                _refuse(self.laying, misfit, self.problems)
                return tree
        tree, found = redirected(tree, Part(paths, excepted, new, entry.span))
        is_list = any(not isinstance(self.place.holes[h], str) for h in HOLE.findall(entry.key))
        if not found and not is_list:
            olds = " or ".join(f"`{old}`" for old in new)
            where = "nothing" if paths[0] == "everywhere" else f"nothing in `{paths[0]}`"
            _refuse(self.laying, Misfit(f"{where} reads {olds}"), self.problems)
        return tree

    def _based(self, tree: Table, body: Table) -> Table:
        """Rewrite equations of the tree that the effect builds on."""
        for entry in entries(self.body.get("equations")):
            if not entry.key.startswith("$"):
                continue
            (name,) = self._key(entry.key, ("equations",))
            node = at(body, ("equations", name))
            if name not in {equation for equation, _ in entries_of(tree, "equations")}:
                _refuse(self.laying, Misfit(f"there is no equation `{name}`"), self.problems)
            elif isinstance(node, Scalar):
                tree = rebuilt(tree, name, node)
        return tree

    def _moved(self, tree: Table, body: Table) -> tuple[Table, Table]:
        source = self.place.balanced
        for entry in entries(self.body.get("move")):
            target = entry.node.text if isinstance(entry.node, Scalar) else ""
            if target not in self.private or source is None:
                label = "what moves goes to the balance of a state of the effect"
                self.problems.error("effect", entry.span, label)
                continue
            names = set(self._key(entry.key, ("move",)))
            moved = taken_out(tree, source, names, entry.span)
            if moved is None:
                why = f"the balance of `{source}` is not the same in every mode"
                _refuse(self.laying, Misfit(why), self.problems)
            elif names and not moved.summands and not moved.terms:
                shown = ", ".join(f"`{name}`" for name in sorted(names))
                why = f"no summand of the balance of `{source}` names {shown}"
                _refuse(self.laying, Misfit(why), self.problems)
            else:
                tree, body = moved.tree, put_in(body, self.private[target], moved)
        return tree, body

    def _with_values(self, body: Table) -> Table:
        raw = self.body.get("parameters")
        own = raw.entries if isinstance(raw, Table) else {}
        for name, entry in self.laying.values.items():
            table = at(body, ("parameters", self.private.get(name, name)))
            if name not in own or not isinstance(table, Table):
                label = f"`{self.laying.effect.name}` has no parameter `{name}`"
                self.problems.error("effect", entry.span, label, nearest(name, own))
            elif "derived" in table.entries:
                label = f"`{name}` is derived: set what it follows from"
                self.problems.error("values", entry.span, label)
            elif isinstance(entry.node, Scalar):
                made = with_value(table, entry.node)
                body = put(body, ("parameters", self.private[name]), made)
        self.problems.stop_if_any()
        return body


def _taken(tree: Table) -> Iterator[str]:
    """Yield the names of variables, and those of regions, which can be read as them."""
    for section in ("parameters", "inputs", "states", "discrete", "regions"):
        for entry in entries(tree.get(section)):
            yield entry.key
    for name, _ in entries_of(tree, "equations"):
        yield name


def _holes_in(body: Table) -> list[str]:
    found: dict[str, None] = {}

    def look(node: Node | None) -> None:
        match node:
            case Scalar():
                found.update(dict.fromkeys(HOLE.findall(node.text)))
            case Items():
                for part in node.nodes:
                    look(part)
            case Table():
                for entry in node:
                    found.update(dict.fromkeys(HOLE.findall(entry.key)))
                    if entry.key not in ("about", "req"):
                        look(entry.node)

    for section in (*ADDED, "redirect", "move"):
        look(body.get(section))
    return list(found)
