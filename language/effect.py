"""Effect: a named piece of physics with holes, read from its file."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

from language.check_effect import check_functions, check_holes, check_parameters, report_hole
from language.document import Document, Entry, Node, Scalar, Table, require_kind
from language.names import check_name
from language.parse import parse_balance, parse_expression
from language.passage import EFFECT, Path, changed
from language.problem import Problems, Span, nearest
from language.reader import Reader
from language.syntax import Name, Tree, names
from language.units import Dimension

FindEffect = Callable[[str, Span], Document]
"""From an effect's name (asked for at a place) to its document."""

TEXT_KEYS = ("signature", "confused_with", "separated_by", "references")
ADDED = ("parameters", "states", "equations", "flow", "terms", "discrete", "elements", "regions")
EFFECT_KEYS = ("language", "effect", "at", "reads", *ADDED, "redirect", "move", *TEXT_KEYS)
FIT_KEYS = {
    "balance": ("of", "unit", "has"),
    "input": ("unit", "has"),
    "output": ("unit", "has"),
    "element": ("kind", "unit", "has"),
}
ELEMENT_PARTS = (
    *("twist", "rate", "torque", "stiffness", "damping", "gap", "angle_rate"),
    *("speed", "inertia"),
)
HOLES = {
    "balance": ("x", "unit", "force", "inertia", "inertia_unit", "damping_unit", "drag_unit"),
    "input": ("u", "unit", "unit_rate"),
    "output": ("y", "unit", "unit_rate"),
    "element": (
        *("unit", "force", "angle", "far", "stretch", "gap_rate", *ELEMENT_PARTS),
        *(f"{part}_unit" for part in ELEMENT_PARTS),
    ),
}
"""Holes of each kind of place; those that a place declares in `places` are named in `has`."""


@dataclass(frozen=True)
class Fit:
    """One kind of place where an effect fits."""

    kind: str
    of: str
    unit: Dimension | None
    has: tuple[str, ...]
    span: Span


@dataclass(frozen=True)
class Effect:
    """A parametrised overlay: where it fits, what it does, and texts for a report."""

    name: str
    about: str
    fits: tuple[Fit, ...]
    body: Table
    signature: str
    confused_with: tuple[str, ...]
    separated_by: tuple[str, ...]
    references: tuple[str, ...]
    span: Span


@dataclass(frozen=True)
class Laying:
    """An effect with the place where it is asked for: one entry of `effects`."""

    effect: Effect
    place: str
    ending: str
    rename: Mapping[str, Entry]
    values: Mapping[str, Entry]
    span: Span

    @property
    def place_span(self) -> Span:
        """Where the place is written, behind the `@`."""
        return self.span.inside(len(self.effect.name) + 1, len(self.place))

    @property
    def title(self) -> str:
        """The name of the layer."""
        return f"effect {self.effect.name}@{self.place}"


def read_effect(document: Document, problems: Problems) -> Effect:
    """Read an effect; what is wrong with it on its own is reported. Raises SpecError."""
    require_kind(document, "effect", problems)
    return _EffectReader(problems).read(document)


def read_laying(entry: Entry, find: FindEffect, problems: Problems) -> Laying:
    """Read one entry of `effects`: `name@place: {values: ..., as: ..., rename: ...}`."""
    reader = Reader(problems)
    name, sign, place = entry.key.partition("@")
    if not (name and sign and place):
        label = f"`{entry.key}` does not say where the effect is laid"
        problems.error("effect", entry.span, label, "`coulomb_friction@w_em`: effect, place")
        problems.stop_if_any()
    table = reader.table(entry.node, f"effects.{entry.key}", ("values", "as", "rename"))
    ending = reader.text(table.get("as"), "as", entry.span) if "as" in table.entries else place
    values = _scalars(reader, table.get("values"), f"effects.{entry.key}.values")
    rename = _scalars(reader, table.get("rename"), f"effects.{entry.key}.rename")
    effect = read_effect(find(name, entry.span.inside(0, len(name))), problems)
    problems.stop_if_any()
    return Laying(effect, place, ending, rename, values, entry.span)


def own_names(body: Table) -> dict[str, Span]:
    """Return the names that an effect adds and expressions may read."""
    found: dict[str, Span] = {}
    for section in ("parameters", "states", "discrete", "equations"):
        for entry in _entries(body.get(section)):
            if not entry.key.startswith("$"):
                found.setdefault(entry.key, entry.span)
    for entry in _region_equations(body.get("regions")):
        found.setdefault(entry.key, entry.span)
    return found


def foreign_names(body: Table) -> list[str]:
    """Return the names that expressions of an effect read, neither holes nor its own."""
    own, found = own_names(body), dict[str, None]()

    def look(path: Path, scalar: Scalar) -> Scalar:
        for name in (name for part in _parsed(path, scalar, Problems()) for name in names(part)):
            if not (name.path.startswith("$") or name.path in own or name.path == "base"):
                found.setdefault(name.path)
        return scalar

    changed(body, EFFECT, look)
    return list(found)


def _region_equations(node: Node | None) -> Iterator[Entry]:
    for owner in _entries(node):
        if isinstance(owner.node, Table):
            yield from _entries(owner.node.get("equations"))
            yield from _region_equations(owner.node.get("modes"))


def _entries(node: Node | None) -> Iterator[Entry]:
    if isinstance(node, Table):
        yield from node


def _scalars(reader: Reader, node: Node | None, what: str) -> dict[str, Entry]:
    found = {}
    for entry in reader.table(node, what):
        if reader.scalar(entry.node, entry.key, entry.span):
            found[entry.key] = entry
    return found


class _EffectReader(Reader):
    """The sections of an effect, one method each."""

    def read(self, document: Document) -> Effect:
        tree = self.table(document.root, f"effect {document.name}", EFFECT_KEYS)
        check_name(document.name, document.name_span, self.problems)
        fits = self._fits(tree.get("at"), document.name_span)
        self._sections(tree)
        check_parameters(tree, self.problems)
        self._names(tree, fits)
        about = tree.get("about")
        signature = tree.get("signature")
        return Effect(
            name=document.name,
            about=about.text if isinstance(about, Scalar) else "",
            fits=fits,
            body=tree,
            signature=signature.text if isinstance(signature, Scalar) else "",
            confused_with=self._texts(tree, "confused_with"),
            separated_by=self._texts(tree, "separated_by"),
            references=self._texts(tree, "references"),
            span=document.name_span,
        )

    def _texts(self, tree: Table, key: str) -> tuple[str, ...]:
        return tuple(item.text for item in self.items(tree.get(key), key))

    def _fits(self, node: Node | None, span: Span) -> tuple[Fit, ...]:
        table = self.table(node, "at", FIT_KEYS)
        if not table.entries:
            self.problems.error("missing", span, "an effect says `at` what place it fits")
        return tuple(self._fit(entry) for entry in table if entry.key in FIT_KEYS)

    def _fit(self, entry: Entry) -> Fit:
        what = f"at.{entry.key}"
        table = self.table(entry.node, what, FIT_KEYS[entry.key])
        of = self.choice(table.get("of"), "of", ("rate",), "")
        of = self.choice(table.get("kind"), "kind", ("elastic", "inertia"), of)
        if entry.key == "element" and not of:
            self.problems.error("missing", entry.span, f"`{what}.kind` is missing")
        unit = self.unit(table.get("unit")).dimension if "unit" in table.entries else None
        has = tuple(item.text for item in self.items(table.get("has"), "has"))
        return Fit(entry.key, of, unit, has, entry.span)

    def _sections(self, tree: Table) -> None:
        """Names are names, and only what is named is changed."""
        for section in ("parameters", "states", "discrete", "elements", "regions", "flow"):
            for entry in self.table(tree.get(section), section):
                check_name(entry.key, entry.span, self.problems)
        for entry in self.table(tree.get("equations"), "equations"):
            if not entry.key.startswith("$"):
                check_name(entry.key, entry.span, self.problems)
        for entry in self.table(tree.get("terms"), "terms"):
            for _ in self.named(entry.node, f"terms.{entry.key}"):
                pass
        for entry in self.table(tree.get("flow"), "flow"):
            if entry.key not in {e.key for e in self.table(tree.get("states"), "states")}:
                label = f"`{entry.key}` is not a state of the effect"
                hint = "a summand of another balance is one of its `terms`"
                self.problems.error("effect", entry.span, label, hint)
        self.table(tree.get("redirect"), "redirect")
        self.table(tree.get("move"), "move")

    def _names(self, tree: Table, fits: tuple[Fit, ...]) -> None:
        """Expressions read what the effect brings, holes, and what it `reads` of a model."""
        own = own_names(tree)
        reads = {item.text: item for item in self.items(tree.get("reads"), "reads")}
        for name, item in reads.items():
            check_name(name, item.span, self.problems)
            if name in own:
                label = f"`{name}` is the effect's own: it is not read of the model"
                self.problems.error("effect", item.span, label)
        known = {f"${hole}" for fit in fits for hole in (*HOLES[fit.kind], *fit.has)}
        check_holes(tree, known, self.problems)

        def check(path: Path, scalar: Scalar) -> Scalar:
            if path[:2] == ("redirect", "except"):
                return scalar
            allowed = {*known, *own, *reads}
            if path[0] == "equations" and path[1].startswith("$"):
                allowed.add("base")
            for part in _parsed(path, scalar, self.problems):
                check_functions(part, self.problems)
                for name in names(part):
                    self._known(name, allowed)
            return scalar

        changed(tree, EFFECT, check)

    def _known(self, name: Name, allowed: set[str]) -> None:
        if name.path in allowed or "." in name.path:
            return
        if name.path.startswith("$"):
            report_hole(name.path, name.span, allowed, self.problems)
            return
        label = f"`{name.path}` is neither a hole nor a name of this effect"
        hint = nearest(name.path, allowed)
        if not hint and name.path != "base":
            hint = f"or `reads: [{name.path}]` says that it is one of the model"
        self.problems.error("effect", name.span, label, hint)


def _parsed(path: Path, scalar: Scalar, problems: Problems) -> tuple[Tree, ...]:
    with problems.collecting():
        if path[0] == "flow" or path[-2:-1] == ("flow",):
            return parse_balance(scalar)
        return (parse_expression(scalar),)
    return ()
