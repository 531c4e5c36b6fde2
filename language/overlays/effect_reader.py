"""Effect reader: a named piece of physics with holes, and its application in a variant."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from fractions import Fraction

from language.expressions.name_rules import check_name
from language.expressions.parser import parse_balance, parse_expression
from language.expressions.syntax_tree import Name, SyntaxTree, names
from language.expressions.units import Dimension
from language.overlays.check_effect import (
    check_functions,
    check_holes,
    check_parameters,
    report_unknown_hole,
)
from language.readers.base_reader import Reader
from language.text.diagnostic import Problems, Span, suggest_name
from language.text.document import Document, Entry, MappingNode, ScalarNode, YamlNode, require_kind
from language.text.expression_paths import EFFECT_SITES, KeyPath, map_formulas
from language.text.node_edit import mapping_entries

EffectLookup = Callable[[str, Span], Document]
"""Returns the document of the effect of a name; the span is where the name is written."""

DESCRIPTION_KEYS = ("family", "signature", "confused_with", "separated_by", "needs", "references")
"""Keys of an effect with texts for reports."""
ADDED_SECTIONS = (
    "parameters",
    "states",
    "equations",
    "flow",
    "terms",
    "discrete",
    "elements",
    "regions",
)
"""Sections of an effect that add entries to the tree."""
EFFECT_KEYS = (
    "language",
    "effect",
    "at",
    "reads",
    *ADDED_SECTIONS,
    "redirect",
    "move",
    *DESCRIPTION_KEYS,
)
PLACE_PATTERN_KEYS = {
    "balance": ("of", "unit", "has"),
    "input": ("unit", "has"),
    "output": ("unit", "has"),
    "element": ("kind", "unit", "has"),
}
"""Keys of `at` by kind of place."""
ELEMENT_PARTS = (
    *("twist", "rate", "torque", "stiffness", "damping", "gap", "angle_rate"),
    *("speed", "inertia"),
)
"""Keys of an element that become holes."""
PATH_HOLES = ("angle_rate_unit", "path", "order")
"""Units of the speed `angle_rate`, of what it travels, and of an angle over that."""
HOLES_BY_PLACE_KIND = {
    "balance": (
        *("x", "unit", "force", "inertia", "inertia_unit", "damping_unit", "drag_unit"),
        *PATH_HOLES,
    ),
    "input": ("u", "unit", "unit_rate", *PATH_HOLES),
    "output": ("y", "start", "unit", "unit_rate", *PATH_HOLES),
    "element": (
        *("path", "order", "unit", "force", "angle", "far", "stretch", "gap_rate", *ELEMENT_PARTS),
        *(f"{part}_unit" for part in ELEMENT_PARTS),
    ),
}
"""Holes of each kind of place; further ones, declared in `places`, are named in `has`."""


@dataclass(frozen=True)
class PlacePattern:
    """A kind of place that an effect fits, with the unit and the holes that the place needs.

    `of` is `rate` for a balance of a speed, the kind of an element, or empty.
    """

    kind: str
    of: str
    unit: Dimension | None
    has: tuple[str, ...]
    span: Span


@dataclass(frozen=True)
class Effect:
    """A parametrised overlay: the places that it fits, its body, and texts for reports.

    Effects with the same `family` are forms of one phenomenon, and a diagnosis need not distinguish
    them; it is the name of the effect if the file has none.
    """

    name: str
    about: str
    place_patterns: tuple[PlacePattern, ...]
    body: MappingNode
    signature: str
    confused_with: tuple[str, ...]
    separated_by: tuple[str, ...]
    needs: tuple[str, ...]
    references: tuple[str, ...]
    span: Span
    family: str = ""


@dataclass(frozen=True)
class EffectApplication:
    """An entry of `effects`: an effect with a place, a suffix, new names and values.

    `scales` are the magnitudes of the place [SI] from recordings, see `effect_scale`.
    """

    effect: Effect
    place: str
    suffix: str
    rename: Mapping[str, Entry]
    values: Mapping[str, Entry]
    span: Span
    scales: Mapping[str, Fraction] = field(default_factory=dict)

    @property
    def place_span(self) -> Span:
        """The span of the place in the key, after the `@`."""
        return self.span.subspan(len(self.effect.name) + 1, len(self.place))

    @property
    def overlay_name(self) -> str:
        """The name of the overlay in messages, like `effect coulomb_friction@w_em`."""
        return f"effect {self.effect.name}@{self.place}"


def read_effect(document: Document, problems: Problems) -> Effect:
    """Return the effect of a document; errors of the effect itself are reported.

    These are unknown keys, places, holes, functions and names, and errors of its parameters.
    Missing texts are "", missing lists are empty. Raises SpecError only for a document of another
    kind.
    """
    require_kind(document, "effect", problems)
    return _EffectReader(problems).read(document)


def read_effect_application(
    entry: Entry, lookup: EffectLookup, problems: Problems
) -> EffectApplication:
    """Return the application of an entry `name@place: {values: ..., as: ..., rename: ...}`.

    The suffix is `as`, by default the place. `lookup` gives the document of the effect. Raises
    SpecError with all problems: a key without name or place, an entry of `values` or `rename` that
    is no scalar, errors of the effect. Whether the place exists is not checked.
    """
    reader = Reader(problems)
    name, sign, place = entry.key.partition("@")
    if not (name and sign and place):
        label = f"`{entry.key}` does not say at which place the effect is applied"
        problems.error("effect", entry.span, label, "`coulomb_friction@w_em`: effect, place")
        problems.raise_if_errors()
    table = reader.read_mapping(entry.node, f"effects.{entry.key}", ("values", "as", "rename"))
    ending = (
        reader.read_string(table.get("as"), "as", entry.span) if "as" in table.entries else place
    )
    values = _read_scalar_entries(reader, table.get("values"), f"effects.{entry.key}.values")
    rename = _read_scalar_entries(reader, table.get("rename"), f"effects.{entry.key}.rename")
    effect = read_effect(lookup(name, entry.span.subspan(0, len(name))), problems)
    problems.raise_if_errors()
    return EffectApplication(effect, place, ending, rename, values, entry.span)


def added_names(body: MappingNode) -> dict[str, Span]:
    """Return the names that an effect or automaton adds and that expressions may read.

    These are the keys of `parameters`, `states`, `discrete` and `equations` at the root, and of
    `equations` in regions and their modes; `modes` at the root are not searched. Keys with a hole
    are left out. The result gives the place of each name, the first if there are several.
    """
    spans: dict[str, Span] = {}
    for section in ("parameters", "states", "discrete", "equations"):
        for entry in mapping_entries(body.get(section)):
            if not entry.key.startswith("$"):
                spans.setdefault(entry.key, entry.span)
    for entry in _region_equations(body.get("regions")):
        spans.setdefault(entry.key, entry.span)
    return spans


def external_names(body: MappingNode) -> list[str]:
    """Return the names that expressions of an effect read and that are neither holes nor its own.

    They are in the order of their first use, each once; `base` and functions are left out. Own
    names are those of `added_names`. Expressions that do not parse are skipped.
    """
    own, found = added_names(body), dict[str, None]()

    def look(path: KeyPath, scalar: ScalarNode) -> ScalarNode:
        """Collect the external names of an expression."""
        for name in (
            name for part in _parse_formula(path, scalar, Problems()) for name in names(part)
        ):
            if not (name.path.startswith("$") or name.path in own or name.path == "base"):
                found.setdefault(name.path)
        return scalar

    map_formulas(body, EFFECT_SITES, look)
    return list(found)


def _region_equations(node: YamlNode | None) -> Iterator[Entry]:
    """Yield the equations of regions and modes, at any depth."""
    for owner in mapping_entries(node):
        if isinstance(owner.node, MappingNode):
            yield from mapping_entries(owner.node.get("equations"))
            yield from _region_equations(owner.node.get("modes"))


def _read_scalar_entries(reader: Reader, node: YamlNode | None, what: str) -> dict[str, Entry]:
    """Return the entries of a mapping by key; entries that are no scalars are reported."""
    scalars = {}
    for entry in reader.read_mapping(node, what):
        if reader.read_scalar(entry.node, entry.key, entry.span):
            scalars[entry.key] = entry
    return scalars


class _EffectReader(Reader):
    """Reads the sections of an effect."""

    def read(self, document: Document) -> Effect:
        """Return the effect of a document; problems are reported."""
        tree = self.read_mapping(document.root, f"effect {document.name}", EFFECT_KEYS)
        check_name(document.name, document.name_span, self.problems)
        fits = self._read_place_patterns(tree.get("at"), document.name_span)
        self._check_sections(tree)
        check_parameters(tree, self.problems)
        self._check_names(tree, fits)
        about = tree.get("about")
        signature = tree.get("signature")
        return Effect(
            name=document.name,
            about=about.text if isinstance(about, ScalarNode) else "",
            place_patterns=fits,
            body=tree,
            signature=signature.text if isinstance(signature, ScalarNode) else "",
            confused_with=self._read_texts(tree, "confused_with"),
            separated_by=self._read_texts(tree, "separated_by"),
            needs=self._read_texts(tree, "needs"),
            references=self._read_texts(tree, "references"),
            span=document.name_span,
            family=tree.text_of("family") or document.name,
        )

    def _read_texts(self, tree: MappingNode, key: str) -> tuple[str, ...]:
        """Return the texts of a list."""
        return tuple(item.text for item in self.read_list(tree.get(key), key))

    def _read_place_patterns(self, node: YamlNode | None, span: Span) -> tuple[PlacePattern, ...]:
        """Return the patterns of `at` in the order of the file; an empty `at` is reported."""
        table = self.read_mapping(node, "at", PLACE_PATTERN_KEYS)
        if not table.entries:
            self.problems.error("missing", span, "an effect names the places that it fits in `at`")
        return tuple(
            self._read_place_pattern(entry) for entry in table if entry.key in PLACE_PATTERN_KEYS
        )

    def _read_place_pattern(self, entry: Entry) -> PlacePattern:
        """Return one pattern of `at`; an element pattern without a kind is reported."""
        what = f"at.{entry.key}"
        table = self.read_mapping(entry.node, what, PLACE_PATTERN_KEYS[entry.key])
        of = self.read_choice(table.get("of"), "of", ("rate",), "")
        of = self.read_choice(table.get("kind"), "kind", ("elastic", "inertia"), of)
        if entry.key == "element" and not of:
            self.problems.error("missing", entry.span, f"`{what}.kind` is missing")
        unit = self.read_unit(table.get("unit")).dimension if "unit" in table.entries else None
        has = tuple(item.text for item in self.read_list(table.get("has"), "has"))
        return PlacePattern(entry.key, of, unit, has, entry.span)

    def _check_sections(self, tree: MappingNode) -> None:
        """Report keys that are no valid names, and balances of unknown states.

        An effect may have balances of its own states only.
        """
        for section in ("parameters", "states", "discrete", "elements", "regions", "flow"):
            for entry in self.read_mapping(tree.get(section), section):
                check_name(entry.key, entry.span, self.problems)
        for entry in self.read_mapping(tree.get("equations"), "equations"):
            if not entry.key.startswith("$"):
                check_name(entry.key, entry.span, self.problems)
        for entry in self.read_mapping(tree.get("terms"), "terms"):
            for _ in self.named_entries(entry.node, f"terms.{entry.key}"):
                pass
        for entry in self.read_mapping(tree.get("flow"), "flow"):
            if entry.key not in {e.key for e in self.read_mapping(tree.get("states"), "states")}:
                label = f"`{entry.key}` is not a state of the effect"
                hint = "a summand of another balance is one of its `terms`"
                self.problems.error("effect", entry.span, label, hint)
        self.read_mapping(tree.get("redirect"), "redirect")
        self.read_mapping(tree.get("move"), "move")

    def _check_names(self, tree: MappingNode, fits: tuple[PlacePattern, ...]) -> None:
        """Report unknown names and functions in the expressions of an effect.

        Known names are holes, names that the effect adds, and those in `reads`.
        """
        own = added_names(tree)
        reads = {item.text: item for item in self.read_list(tree.get("reads"), "reads")}
        for name, item in reads.items():
            check_name(name, item.span, self.problems)
            if name in own:
                label = f"`{name}` is a name of the effect: `reads` lists names of the model"
                self.problems.error("effect", item.span, label)
        known = {f"${hole}" for fit in fits for hole in (*HOLES_BY_PLACE_KIND[fit.kind], *fit.has)}
        check_holes(tree, known, self.problems)

        def check(path: KeyPath, scalar: ScalarNode) -> ScalarNode:
            """Check one expression; `base` is allowed in the rewrite of an equation."""
            if path[:2] == ("redirect", "except"):
                return scalar
            allowed = {*known, *own, *reads}
            if path[0] == "equations" and path[-1].startswith("$"):
                allowed.add("base")
            for part in _parse_formula(path, scalar, self.problems):
                check_functions(part, self.problems)
                for name in names(part):
                    self._check_name_is_known(name, allowed)
            return scalar

        map_formulas(tree, EFFECT_SITES, check)

    def _check_name_is_known(self, name: Name, allowed: set[str]) -> None:
        """Report a name that is not allowed; dotted names are not checked."""
        if name.path in allowed or "." in name.path:
            return
        if name.path.startswith("$"):
            report_unknown_hole(name.path, name.span, allowed, self.problems)
            return
        label = f"`{name.path}` is neither a hole nor a name of this effect"
        hint = suggest_name(name.path, allowed)
        if not hint and name.path != "base":
            hint = f"`reads: [{name.path}]` declares it as a name of the model"
        self.problems.error("effect", name.span, label, hint)


def _parse_formula(path: KeyPath, scalar: ScalarNode, problems: Problems) -> tuple[SyntaxTree, ...]:
    """Return the parsed expression of a scalar, or both sides of a balance.

    Returns an empty tuple after a reported problem.
    """
    with problems.collect_errors():
        if path[0] != "redirect" and "flow" in (path[0], *path[-2:-1]):
            return parse_balance(scalar)
        return (parse_expression(scalar),)
    return ()
