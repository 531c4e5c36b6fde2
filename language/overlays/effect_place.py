"""Effect place: the place of an automaton's tree at which an effect is applied, and its holes."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass

from language.expressions.text_rewrite import split_balance
from language.expressions.units import RADIAN, SECOND, Dimension, are_compatible, parse_unit
from language.overlays.effect_reader import ELEMENT_PARTS, Effect, PlacePattern
from language.overlays.name_types import (
    TreeTypes,
    format_rate_unit,
    format_si_unit,
    formula_entries,
)
from language.readers.element_reader import outputs_as_mapping
from language.text.diagnostic import suggest_name
from language.text.document import MappingNode, ScalarNode
from language.text.node_edit import mapping_entries, scalars_of

SPEEDS = parse_unit("rad/s").dimension, parse_unit("m/s").dimension
"""Dimensions of a speed whose integral is a path."""

Hole = str | tuple[str, ...]
"""The text that fills a hole, or several texts."""


@dataclass(frozen=True)
class EffectPlace:
    """A place that an effect fits, with the values of its holes.

    `balance_state` is the state of the balance that the place belongs to, or None.
    """

    name: str
    holes: Mapping[str, Hole]
    balance_state: str | None = None


@dataclass(frozen=True)
class PlaceMismatch:
    """The reason why an effect does not fit a place, and a hint."""

    reason: str
    help: str = ""


def find_effect_place(tree: MappingNode, effect: Effect, name: str) -> EffectPlace | PlaceMismatch:
    """Return the place of a name that an effect fits, or the reasons why there is none.

    The patterns of the effect are tried in their order, and the first match with all holes of `has`
    counts. The kind of place (balance, input, output, element), the unit and the kind of an element
    must fit. A mismatch has the reasons and the different hints of all patterns, joined by "; ".
    """
    known = TreeTypes(tree)
    misfits = []
    for pattern in effect.place_patterns:
        place = PLACE_FINDERS[pattern.kind](tree, known, pattern, name)
        if isinstance(place, EffectPlace):
            lacking = [key for key in pattern.has if not place.holes.get(key)]
            if not lacking:
                return place
            place = _missing_hole(pattern, name, lacking[0])
        misfits.append(place)
    hints = dict.fromkeys(misfit.help for misfit in misfits if misfit.help)
    return PlaceMismatch("; ".join(misfit.reason for misfit in misfits), "; ".join(hints))


def _missing_hole(pattern: PlacePattern, name: str, key: str) -> PlaceMismatch:
    """Return the mismatch of a place that lacks a hole that the pattern requires."""
    if pattern.kind == "element":
        return PlaceMismatch(f"element `{name}` has no `{key}`", f"add `elements.{name}.{key}`")
    label = f"the {pattern.kind} of `{name}` declares no `{key}`"
    return PlaceMismatch(label, f"add `places: {{{name}: {{{key}: ...}}}}`")


def _find_balance(
    tree: MappingNode, known: TreeTypes, pattern: PlacePattern, name: str
) -> EffectPlace | PlaceMismatch:
    """Return the balance of the state `name` as a place, or a mismatch.

    The holes are the state, its unit, the unit of the balance (`force`), and units that follow from
    both. `inertia` is the coefficient of the derivative if it is the same in all modes.
    """
    balances = list(formula_entries(tree, "flow"))
    scalars = [scalar for state, scalar in balances if state == name]
    if not scalars:
        return PlaceMismatch(
            f"there is no balance of `{name}`", suggest_name(name, {s for s, _ in balances})
        )
    kind = known.type_of_name(name)
    if not isinstance(kind, Dimension):
        return PlaceMismatch(f"the unit of `{name}` is not known")
    if pattern.of == "rate" and kind.powers[2] != -1:
        return PlaceMismatch(f"`{name}` is in `{kind}`: it is no speed")
    force = known.balance_dimension(name, scalars[0])
    if pattern.unit and (force is None or not are_compatible(force, pattern.unit)):
        return PlaceMismatch(f"the balance of `{name}` is in `{force}`, not in `{pattern.unit}`")
    holes: dict[str, Hole] = {"x": name, "unit": format_si_unit(kind)}
    if force is not None:
        holes["force"] = format_si_unit(force)
        inertia = _multiply_dimensions(_multiply_dimensions(force, kind, -1), SECOND)
        holes["inertia_unit"] = format_si_unit(Dimension(inertia.powers))
        holes["damping_unit"] = format_si_unit(_multiply_dimensions(force, kind, -1))
        holes["drag_unit"] = format_si_unit(
            _multiply_dimensions(_multiply_dimensions(force, kind, -1), kind, -1)
        )
        factors = {_balance_coefficient(scalar.text, name) for scalar in scalars}
        if len(factors) == 1:
            holes["inertia"] = factors.pop()
    return EffectPlace(name, {**holes, **_declared_holes(tree, known, name)}, name)


def _find_input(
    tree: MappingNode, known: TreeTypes, pattern: PlacePattern, name: str
) -> EffectPlace | PlaceMismatch:
    """Return the input `name` as a place with the hole `u`, or a mismatch."""
    table = tree.get("inputs")
    names = table.entries if isinstance(table, MappingNode) else {}
    if name not in names:
        return PlaceMismatch(f"there is no input `{name}`", suggest_name(name, names))
    return _signal_place(tree, known, pattern, name, "u", name)


def _find_output(
    tree: MappingNode, known: TreeTypes, pattern: PlacePattern, name: str
) -> EffectPlace | PlaceMismatch:
    """Return the output `name` as a place with the hole `y`, the variable that it reads.

    The hole `start` is this variable too if a state may start with it, else 0. A speed has the
    units of its path. Returns a mismatch if there is no such output.
    """
    node = tree.get("outputs")
    outputs = outputs_as_mapping(node) if node else MappingNode({}, tree.span)
    source = outputs.get(name)
    if not isinstance(source, ScalarNode):
        return PlaceMismatch(f"there is no output `{name}`", suggest_name(name, outputs.entries))
    place = _signal_place(tree, known, pattern, name, "y", source.text)
    if isinstance(place, PlaceMismatch):
        return place
    tables = [table for section in ("states", "inputs") if (table := tree.get(section))]
    is_known = any(isinstance(one, MappingNode) and source.text in one.entries for one in tables)
    start = source.text if is_known else "0"
    speed = known.type_of_name(source.text)
    is_speed = isinstance(speed, Dimension) and any(are_compatible(speed, one) for one in SPEEDS)
    if "path" in pattern.has and not is_speed:
        return PlaceMismatch(f"`{name}` is in `{speed}`: it is no speed")
    path = _path_units(speed) if isinstance(speed, Dimension) and is_speed else {}
    return dataclasses.replace(place, holes={**path, **place.holes, "start": start})


def _signal_place(
    tree: MappingNode, known: TreeTypes, pattern: PlacePattern, name: str, hole: str, read_name: str
) -> EffectPlace | PlaceMismatch:
    """Return an input or output as a place with its unit and the unit of its rate.

    `read_name` is the variable that fills `hole`. Returns a mismatch if it is no quantity or has
    the wrong unit.
    """
    kind = known.type_of_name(read_name)
    if not isinstance(kind, Dimension):
        return PlaceMismatch(f"`{name}` is no quantity")
    if pattern.unit and not are_compatible(kind, pattern.unit):
        return PlaceMismatch(f"`{name}` is in `{kind}`, not in `{pattern.unit}`")
    units = {
        "unit": format_si_unit(kind),
        "unit_rate": format_rate_unit(kind, _multiply_dimensions(kind, SECOND, -1)),
    }
    return EffectPlace(name, {hole: read_name, **units, **_declared_holes(tree, known, name)})


def _find_element(
    tree: MappingNode, known: TreeTypes, pattern: PlacePattern, name: str
) -> EffectPlace | PlaceMismatch:
    """Return the element `name` as a place whose holes are its keys, or a mismatch."""
    table = tree.get("elements")
    elements = table.entries if isinstance(table, MappingNode) else {}
    element = elements[name].node if name in elements else None
    if not isinstance(element, MappingNode):
        return PlaceMismatch(f"there is no element `{name}`", suggest_name(name, elements))
    kind = element.get("kind")
    if not isinstance(kind, ScalarNode) or kind.text != pattern.of:
        shown = kind.text if isinstance(kind, ScalarNode) else "?"
        return PlaceMismatch(f"element `{name}` is {shown}, not {pattern.of}")
    holes: dict[str, Hole] = {}
    kinds: dict[str, Dimension] = {}
    for part in ELEMENT_PARTS:
        node = element.get(part)
        if isinstance(node, ScalarNode):
            holes[part] = node.text
            dimension = known.type_of_formula(node)
            if isinstance(dimension, Dimension):
                kinds[part] = dimension
    if "angle_rate" in pattern.has and holes.get("angle_rate") == holes.get("rate"):
        label = f"the `angle_rate` of element `{name}` is the rate of its own twist"
        return PlaceMismatch(label, "name the speed whose integral is the position of the element")
    if "far" in element.entries or pattern.of == "inertia":
        holes["far"] = tuple(item.text for item in scalars_of(element.get("far")))
    measured = "torque" if pattern.of == "elastic" else "inertia"
    unit = kinds.get(measured)
    if pattern.unit and (unit is None or not are_compatible(unit, pattern.unit)):
        return PlaceMismatch(f"the {measured} of `{name}` is in `{unit}`, not in `{pattern.unit}`")
    holes.update(_element_units(pattern.of, kinds))
    holes.update(_gap_holes(tree, holes))
    speed = holes.get("speed")
    return EffectPlace(name, holes, speed if isinstance(speed, str) else None)


def _element_units(of: str, kinds: Mapping[str, Dimension]) -> dict[str, Hole]:
    """Return the units of the parts of an element, and of angle, force, stiffness and damping.

    Angle and force follow from twist and torque, for an inertia from speed and inertia: angle =
    speed * s, force = inertia * speed / s. Without them the units that depend on them are left out.
    """
    units = dict(kinds)
    angle, force = kinds.get("twist"), kinds.get("torque")
    if of == "inertia" and {"speed", "inertia"} <= set(kinds):
        angle = _multiply_dimensions(kinds["speed"], SECOND)
        force = _multiply_dimensions(
            _multiply_dimensions(kinds["inertia"], kinds["speed"]), SECOND, -1
        )
        force = Dimension(force.powers, kinds["inertia"].angle or 0)
    holes: dict[str, Hole] = {}
    if angle is not None and force is not None:
        units["angle"], units["force"] = angle, force
        units.setdefault("stiffness", _multiply_dimensions(force, angle, -1))
        units.setdefault(
            "damping", _multiply_dimensions(_multiply_dimensions(force, angle, -1), SECOND)
        )
    if "angle_rate" in kinds:
        holes.update(_path_units(kinds["angle_rate"]))
    for part, dimension in units.items():
        holes[part if part in ("angle", "force") else f"{part}_unit"] = format_si_unit(dimension)
    unit = units.get("force" if of == "elastic" else "speed")
    return {**holes, "unit": format_si_unit(unit)} if unit else holes


def _gap_holes(tree: MappingNode, holes: Mapping[str, Hole]) -> dict[str, Hole]:
    """Return the deflection of the spring without the gap, and the rate of the gap.

    Without a gap they are the twist and `0`. The rate is left out unless one balance `der(gap) =
    rate` gives it.
    """
    twist, gap = holes.get("twist"), holes.get("gap")
    if twist is None or gap is None:
        return {"stretch": twist, "gap_rate": "0"} if twist else {}
    gap_holes: dict[str, Hole] = {"stretch": f"{twist} - {gap}"}
    balances = {scalar.text for state, scalar in formula_entries(tree, "flow") if state == gap}
    if len(balances) == 1:
        left, right = split_balance(balances.pop())
        if left == f"der({gap})":
            gap_holes["gap_rate"] = right
    return gap_holes


def _declared_holes(tree: MappingNode, known: TreeTypes, name: str) -> dict[str, Hole]:
    """Return the keys that `places` declares for a balance, input or output, with their texts and
    the units of a path.
    """
    places = tree.get("places")
    table = places.get(name) if isinstance(places, MappingNode) else None
    texts = {
        one.key: one.node for one in mapping_entries(table) if isinstance(one.node, ScalarNode)
    }
    speed = known.type_of_formula(texts["angle_rate"]) if "angle_rate" in texts else None
    units = _path_units(speed) if isinstance(speed, Dimension) else {}
    return {**{key: node.text for key, node in texts.items()}, **units}


def _path_units(speed: Dimension) -> dict[str, Hole]:
    """Return the units of a speed, of what it travels (`path`), of an angle over it (`order`)."""
    path = _multiply_dimensions(speed, SECOND)
    order = _multiply_dimensions(RADIAN, path, -1)
    dimensions = {"angle_rate_unit": speed, "path": path, "order": order}
    return {name: format_si_unit(one) for name, one in dimensions.items()}


def _balance_coefficient(balance: str, state: str) -> str:
    """Return the coefficient of the derivative in a balance as text; `1` without one."""
    left, _ = split_balance(balance)
    factor = left.replace(f"der({state})", "").strip().strip("*").strip()
    return factor or "1"


def _multiply_dimensions(a: Dimension, b: Dimension, sign: int = 1) -> Dimension:
    """Return a * b**sign with the power of the angle, which other products leave undefined."""
    powers = tuple(x + sign * y for x, y in zip(a.powers, b.powers, strict=True))
    return Dimension(powers, (a.angle or 0) + sign * (b.angle or 0))


PLACE_FINDERS = {
    "balance": _find_balance,
    "input": _find_input,
    "output": _find_output,
    "element": _find_element,
}
"""The function that finds a place, by kind of pattern."""
