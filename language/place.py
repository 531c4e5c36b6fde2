"""Place: where in an automaton's tree an effect is laid, and what its holes are there."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from language.document import Scalar, Table
from language.effect import ELEMENT_PARTS, Effect, Fit
from language.element import outputs_as_mapping
from language.known import Known, entries_of, unit_text
from language.problem import nearest
from language.rewrite import sides
from language.tree import items_of
from language.units import SECOND, Dimension, fits

Hole = str | tuple[str, ...]


@dataclass(frozen=True)
class Place:
    """A place that an effect fits: `balanced` is the state whose balance it belongs to."""

    name: str
    holes: Mapping[str, Hole]
    balanced: str | None = None


@dataclass(frozen=True)
class Misfit:
    """Why an effect cannot be laid at a place, and what would help."""

    why: str
    help: str = ""


def place_of(tree: Table, effect: Effect, name: str) -> Place | Misfit:
    """Return the place of that name where the effect fits, or why there is none."""
    known = Known(tree)
    misfits = []
    for fit in effect.fits:
        found = FINDERS[fit.kind](tree, known, fit, name)
        if isinstance(found, Place):
            lacking = [key for key in fit.has if key not in found.holes]
            if not lacking:
                return found
            found = _lacking(fit, name, lacking[0])
        misfits.append(found)
    hints = dict.fromkeys(misfit.help for misfit in misfits if misfit.help)
    return Misfit("; ".join(misfit.why for misfit in misfits), "; ".join(hints))


def _lacking(fit: Fit, name: str, key: str) -> Misfit:
    if fit.kind == "element":
        return Misfit(f"element `{name}` has no `{key}`", f"`elements.{name}.{key}` would do")
    label = f"the {fit.kind} of `{name}` declares no `{key}`"
    return Misfit(label, f"`places: {{{name}: {{{key}: ...}}}}` would do")


def _balance(tree: Table, known: Known, fit: Fit, name: str) -> Place | Misfit:
    balances = list(entries_of(tree, "flow"))
    found = [scalar for state, scalar in balances if state == name]
    if not found:
        return Misfit(f"there is no balance of `{name}`", nearest(name, {s for s, _ in balances}))
    kind = known.kind(name)
    if not isinstance(kind, Dimension):
        return Misfit(f"the unit of `{name}` is not known")
    if fit.of == "rate" and kind.powers[2] != -1:
        return Misfit(f"`{name}` is in `{kind}`: it is no speed")
    force = known.force(name, found[0])
    if fit.unit and (force is None or not fits(force, fit.unit)):
        return Misfit(f"the balance of `{name}` is in `{force}`, not in `{fit.unit}`")
    holes: dict[str, Hole] = {"x": name, "unit": unit_text(kind)}
    if force is not None:
        holes["force"] = unit_text(force)
        inertia = _times(_times(force, kind, -1), SECOND)
        holes["inertia_unit"] = unit_text(Dimension(inertia.powers))
        holes["damping_unit"] = unit_text(_times(force, kind, -1))
        holes["drag_unit"] = unit_text(_times(_times(force, kind, -1), kind, -1))
        factors = {_coefficient(scalar.text, name) for scalar in found}
        if len(factors) == 1:
            holes["inertia"] = factors.pop()
    return Place(name, {**holes, **_declared(tree, name)}, name)


def _input(tree: Table, known: Known, fit: Fit, name: str) -> Place | Misfit:
    table = tree.get("inputs")
    names = table.entries if isinstance(table, Table) else {}
    if name not in names:
        return Misfit(f"there is no input `{name}`", nearest(name, names))
    return _signal(tree, known, fit, name, "u", name)


def _output(tree: Table, known: Known, fit: Fit, name: str) -> Place | Misfit:
    node = tree.get("outputs")
    outputs = outputs_as_mapping(node) if node else Table({}, tree.span)
    source = outputs.get(name)
    if not isinstance(source, Scalar):
        return Misfit(f"there is no output `{name}`", nearest(name, outputs.entries))
    return _signal(tree, known, fit, name, "y", source.text)


def _signal(tree: Table, known: Known, fit: Fit, name: str, hole: str, read: str) -> Place | Misfit:
    kind = known.kind(read)
    if not isinstance(kind, Dimension):
        return Misfit(f"`{name}` is no quantity")
    if fit.unit and not fits(kind, fit.unit):
        return Misfit(f"`{name}` is in `{kind}`, not in `{fit.unit}`")
    units = {"unit": unit_text(kind), "unit_rate": unit_text(_times(kind, SECOND, -1))}
    return Place(name, {hole: read, **units, **_declared(tree, name)})


def _element(tree: Table, known: Known, fit: Fit, name: str) -> Place | Misfit:
    table = tree.get("elements")
    elements = table.entries if isinstance(table, Table) else {}
    element = elements[name].node if name in elements else None
    if not isinstance(element, Table):
        return Misfit(f"there is no element `{name}`", nearest(name, elements))
    kind = element.get("kind")
    if not isinstance(kind, Scalar) or kind.text != fit.of:
        shown = kind.text if isinstance(kind, Scalar) else "?"
        return Misfit(f"element `{name}` is {shown}, not {fit.of}")
    holes: dict[str, Hole] = {}
    kinds: dict[str, Dimension] = {}
    for part in ELEMENT_PARTS:
        node = element.get(part)
        if isinstance(node, Scalar):
            holes[part] = node.text
            dimension = known.of(node)
            if isinstance(dimension, Dimension):
                kinds[part] = dimension
    if "far" in element.entries:
        holes["far"] = tuple(item.text for item in items_of(element.get("far")))
    measured = "torque" if fit.of == "elastic" else "inertia"
    unit = kinds.get(measured)
    if fit.unit and (unit is None or not fits(unit, fit.unit)):
        return Misfit(f"the {measured} of `{name}` is in `{unit}`, not in `{fit.unit}`")
    holes.update(_element_units(fit.of, kinds))
    holes.update(_gap(tree, holes))
    return Place(name, holes, _text(holes.get("speed")))


def _element_units(of: str, kinds: Mapping[str, Dimension]) -> dict[str, Hole]:
    """Return the units that follow from the parts of an element."""
    units = dict(kinds)
    angle, force = kinds.get("twist"), kinds.get("torque")
    if of == "inertia" and {"speed", "inertia"} <= set(kinds):
        angle = _times(kinds["speed"], SECOND)
        force = _times(_times(kinds["inertia"], kinds["speed"]), SECOND, -1)
        force = Dimension(force.powers, kinds["inertia"].angle or 0)
    found: dict[str, Hole] = {}
    if angle is not None and force is not None:
        units["angle"], units["force"] = angle, force
        units.setdefault("stiffness", _times(force, angle, -1))
        units.setdefault("damping", _times(_times(force, angle, -1), SECOND))
    for part, dimension in units.items():
        found[part if part in ("angle", "force") else f"{part}_unit"] = unit_text(dimension)
    unit = units.get("force" if of == "elastic" else "speed")
    return {**found, "unit": unit_text(unit)} if unit else found


def _gap(tree: Table, holes: Mapping[str, Hole]) -> dict[str, Hole]:
    """Return the stretch of the spring alone, and the rate of the gap beside it (0 without)."""
    twist, gap = holes.get("twist"), holes.get("gap")
    if twist is None or gap is None:
        return {"stretch": twist, "gap_rate": "0"} if twist else {}
    found: dict[str, Hole] = {"stretch": f"{twist} - {gap}"}
    balances = {scalar.text for state, scalar in entries_of(tree, "flow") if state == gap}
    if len(balances) == 1:
        left, right = sides(balances.pop())
        if left == f"der({gap})":
            found["gap_rate"] = right
    return found


def _declared(tree: Table, name: str) -> dict[str, Hole]:
    """Return the keys that `places` declares for a balance, input or output."""
    places = tree.get("places")
    table = places.get(name) if isinstance(places, Table) else None
    entries = table if isinstance(table, Table) else ()
    return {entry.key: entry.node.text for entry in entries if isinstance(entry.node, Scalar)}


def _coefficient(balance: str, state: str) -> str:
    left, _ = sides(balance)
    factor = left.replace(f"der({state})", "").strip().strip("*").strip()
    return factor or "1"


def _times(a: Dimension, b: Dimension, sign: int = 1) -> Dimension:
    """Return a product (or quotient) whose power of the angle is counted."""
    powers = tuple(x + sign * y for x, y in zip(a.powers, b.powers, strict=True))
    return Dimension(powers, (a.angle or 0) + sign * (b.angle or 0))


def _text(hole: Hole | None) -> str | None:
    return hole if isinstance(hole, str) else None


FINDERS = {"balance": _balance, "input": _input, "output": _output, "element": _element}
"""How a place of each kind is found."""
