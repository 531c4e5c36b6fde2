"""Tracks: recordings that a predictor follows side by side, in the vectors of the processor.

A step in which nothing happens is one block of C in each mode (codegen/leap.py): it is printed once
more, over vectors. Each lane has the bits of the step of one; a lane in which something happens, or
whose mode has no such block, takes that.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from codegen.abreast import LANES, Kind, Lanes, NotAbreast, flat
from codegen.expression import LIBRARY
from codegen.leap import DONE, LEAP, RECORD, THROUGH, Stay, leaping, stays_of
from codegen.member import PAGE as MODULE_PAGE
from codegen.names import CNames, c_member
from codegen.source import c_program, module_context, stepped
from codegen.statement import wrapped
from language.functions import FUNCTIONS
from language.operation import Assign, Binary, Block, Branch, Call, Expr, Op, Ref, Select
from language.program import MODE, Program, short
from language.substitution import with_expressions, with_parts
from language.traversal import block_writes, parts

PAGE = ("derived.", "calibration.")
"""What stays in all steps."""
REAL_OF = "real_of "
"""Before the name of a whole number: that as a real."""
WIDTH = 96
OVER_VECTORS = ("abs", "min", "max", "clip", "floor", "sign", "pow2")
"""Operations that the template has for all lanes at once."""
TRUTH: Mapping[Kind, str] = {"real": "Reals", "truth": "Truths"}


def tracks(program: Program, columns: tuple[str, ...], seen: tuple[str, ...]) -> Any:
    """Return what the template of a predictor's tracks reads; None where none go side by side.

    `columns` are the states, `seen` the outputs that are compared.
    """
    if program.number != "float64":
        return None
    made = leaping(stepped(program), "anew")
    records = _records(program) if RECORD in made.blocks else {"record": ""}
    if records is None:
        return None
    types = {one.name: one.type for one in made.variables}
    types |= {one.name: one.type for one in made.constants if not one.items}
    kinds: dict[str, Kind] = {
        name: "real" if kind == "real" else "truth"
        for name, kind in types.items()
        if kind in ("real", "truth")
    }
    kinds |= {REAL_OF + name: "real" for name, kind in types.items() if kind == "whole"}
    fixed = frozenset(name for name in kinds if name.startswith("constant."))
    lanes = Lanes(made, kinds, fixed)
    leaps = _together([leap for stay in stays_of(made, LEAP) for leap in _leaps(lanes, stay)])
    try:
        return _context(lanes, leaps, columns, seen) | records if leaps else None
    except NotAbreast:
        return None


def _records(program: Program) -> dict[str, Any] | None:
    """Return how a lane records by itself what a delay reads, and goes through events behind that;
    None where the values of a step are not in the instance.
    """
    context = module_context(c_program(program, leaps="anew"), MODULE_PAGE)
    calls, scratch = context["calls"], context["scratch"]
    if THROUGH not in calls or not (scratch and scratch["is_in_instance"]):
        return None
    return {"record": calls[RECORD], "through": calls[THROUGH], "work_type": context["work_type"]}


def _context(
    lanes: Lanes, leaps: list[_Leap], columns: tuple[str, ...], seen: tuple[str, ...]
) -> dict[str, Any]:
    lanes.named.clear()
    wires = {wire.name: wire.source for wire in lanes.program.outputs}
    states = [lanes.member(f"state.{name}") for name in columns]
    inputs = [short(variable.name) for variable in lanes.program.inputs]
    for name in inputs:
        lanes.member(f"input.{name}")
        lanes.member(f"before.{name}")
    looks = _looks(lanes, [wires[name] for name in seen])
    written = {name for leap in leaps for name in leap.ends}
    kept = [name for name in lanes.touched if not name.startswith((*PAGE, "input."))]
    own = [n for n in kept if n in written or n.startswith(("state.", "before."))]
    recorded = set(block_writes(lanes.program.blocks.get(RECORD, ())))
    functions = dict(reversed(list(_functions(lanes))))
    beside = _modes_beside(lanes.program)
    return {
        "lanes": LANES,
        "members": [
            *((flat(name), TRUTH[kind]) for name, kind in lanes.touched.items()),
            *((member, TRUTH["truth"]) for member, _, _ in beside),
        ],
        "page": _places(lanes, [name for name in lanes.touched if name.startswith(PAGE)]),
        "read": _places(lanes, kept) + beside,
        "written": _places(lanes, own),
        "recorded": _places(lanes, [n for n in kept if n.removeprefix(REAL_OF) in recorded]),
        "inputs": [(flat(f"input.{n}"), flat(f"before.{n}"), _kind(lanes, n), n) for n in inputs],
        "states": states,
        "seen": looks,
        "functions": functions,
        "called": [
            (name, count, LIBRARY.get(name, f"ha_{name}"))
            for name, count in lanes.called.items()
            if name not in (*functions, *OVER_VECTORS)
        ],
        "leaps": leaps,
    }


def _looks(lanes: Lanes, names: list[str]) -> list[str]:
    """Return the members of what is compared. Raises NotAbreast unless these are lasting reals."""
    looks = [lanes.member(name) for name in names]
    are_real = all(lanes.kind(Ref(name)) == "real" for name in names)
    if not are_real or any(name.startswith("work.") for name in lanes.touched):
        raise NotAbreast
    return looks


def _modes_beside(program: Program) -> list[tuple[str, str, str]]:
    """Return the members that hold the modes of regions, as `_places` does."""
    held = [name for name in program.mode_variables().values() if name != MODE]
    return [(short(name), "whole", CNames(program)(name)) for name in held]


def _kind(lanes: Lanes, name: str) -> Kind:
    return lanes.kind(Ref(f"input.{name}"))


def _places(lanes: Lanes, names: list[str]) -> list[tuple[str, Kind, str]]:
    """Return members with what they are and where a single instance has them."""
    place = CNames(lanes.program)
    return [(flat(name), lanes.touched[name], place(name.removeprefix(REAL_OF))) for name in names]


@dataclass
class _Leap:
    """The step of modes, by where lanes are in them and what they are called, in `values`: name,
    kind and text of each. The lanes of which `quiet` is true end at `ends`.
    """

    modes: dict[str, str]
    values: list[tuple[str, Kind, str]] = field(default_factory=list)
    quiet: list[str] = field(default_factory=list)
    ends: dict[str, str] = field(default_factory=dict)

    @property
    def lines(self) -> list[str]:
        """The values as they are printed."""
        return [line for value in self.values for line in _set(*value)]

    @property
    def commits(self) -> list[tuple[str, str, str]]:
        """What is written where nothing happened: member, its value, and how one is chosen."""
        return [(flat(name), *end.split(" ")) for name, end in self.ends.items()]  # type: ignore[misc]


def _together(leaps: list[_Leap]) -> list[_Leap]:
    """Return steps, those of modes that flow alike as one: lanes in either take it at once."""
    found: list[_Leap] = []
    for leap in leaps:
        same = next((k for k, one in enumerate(found) if _is_alike(one, leap)), None)
        if same is None:
            found.append(leap)
        else:
            found[same] = _joined(found[same], leap)
    return found


def _is_alike(first: _Leap, second: _Leap) -> bool:
    """Tell whether steps differ in truths alone, as the guards at both ends of a gap do."""
    reals = [[value for value in leap.values if value[1] == "real"] for leap in (first, second)]
    names = [[name for name, _, _ in leap.values] for leap in (first, second)]
    kept = [(leap.quiet, leap.ends) for leap in (first, second)]
    return all(one == other for one, other in (reals, names, kept))


def _joined(first: _Leap, second: _Leap) -> _Leap:
    """Return the step of the modes of two, each lane with the truths of its own mode."""
    there = " | ".join(second.modes)
    values = [
        (name, kind, text if text == other else f"CHOSEN_TRUTH({there}, {other}, {text})")
        for (name, kind, text), (_, _, other) in zip(first.values, second.values, strict=True)
    ]
    return _Leap(first.modes | second.modes, values, first.quiet, first.ends)


def _chooser(kind: Kind) -> str:
    return "CHOSEN" if kind == "real" else "CHOSEN_TRUTH"


def _leaps(lanes: Lanes, stay: Stay) -> Iterator[_Leap]:
    """Yield the step of a stay over vectors, if it has one that is arithmetic of reals."""
    block = lanes.program.blocks.get(stay.title)
    if block is None:
        return
    block = with_expressions(block, _real)
    lanes.named.clear()
    held = [f"(all->{short(name)} == {number})" for name, number in stay.numbers]
    here = f"({' & '.join(held)})" if held[1:] else held[0]
    leap, touched = _Leap({here: stay.title.removeprefix(f"{LEAP}_")}), dict(lanes.touched)
    try:
        _follow(lanes, leap, block)
    except NotAbreast:
        lanes.touched = touched
        return
    yield leap


def _real(expr: Expr) -> Expr:
    """Return an expression that reads whole numbers as the reals that they are."""
    match expr:
        case Call("real", (Ref(name),)):
            return Ref(REAL_OF + name)
    return with_parts(expr, _real)


def _follow(lanes: Lanes, leap: _Leap, ops: Block) -> None:
    """Print the operations of a step; where one branches, the arm in which nothing happens."""
    for op in ops:
        match op:
            case Assign(target) if target == DONE:
                continue
            case Assign(target, value) if lanes.kind(Ref(target)) == lanes.kind(value):
                is_local = target.startswith("work.")
                name = c_member(target) if is_local else f"end_{len(leap.values)}_{flat(target)}"
                kind = lanes.kind(value)
                leap.values.append((name, kind, lanes.text(value)))
                lanes.named[target] = name, kind
                if not is_local:
                    lanes.touched.setdefault(target, kind)
                    leap.ends[target] = f"{name} {_chooser(kind)}"
            case Branch(condition, then, other) if _is_plain(then) or _is_plain(other):
                name, sign = f"is_quiet_{len(leap.quiet)}", "" if _is_plain(then) else "~"
                leap.values.append((name, "truth", f"{sign}{lanes.text(condition)}"))
                leap.quiet.append(name)
                _follow(lanes, leap, other if sign else then)
            case _:
                raise NotAbreast


def _is_plain(ops: Block) -> bool:
    return all(_is_plain_one(op) for op in ops)


def _is_plain_one(op: Op) -> bool:
    if isinstance(op, Branch):
        return _is_plain(op.then) or _is_plain(op.other)
    return isinstance(op, Assign)


def _set(name: str, kind: Kind, text: str) -> list[str]:
    return [f"    {line}" for line in wrapped(f"const {TRUTH[kind]} {name} = ", text, "", WIDTH)]


def _functions(lanes: Lanes) -> Iterator[tuple[str, tuple[tuple[str, ...], list[str]]]]:
    """Yield the elementary functions that are called, over vectors, before those that call them."""
    for name in reversed(list(FUNCTIONS)):
        if name not in lanes.called:
            continue
        function = FUNCTIONS[name]
        lanes.named = {f"work.{p}": (p, "real") for p in function.parameters}
        lines: list[str] = []
        try:
            for op in function.body:
                assert isinstance(op, Assign)
                local, kind = op.target.partition(".")[2], lanes.kind(op.value)
                lines += _value(lanes, local, kind, op.value)
                lanes.named[op.target] = local, kind
        except NotAbreast:
            continue
        yield name, (tuple(function.parameters), lines)


def _value(lanes: Lanes, name: str, kind: Kind, value: Expr) -> list[str]:
    """Print a value; of two that take a division, each only where a lane asks for it."""
    if not (isinstance(value, Select) and _divides(value.then) and _divides(value.other)):
        return _set(name, kind, lanes.text(value))
    then, other, chosen = f"{name}_then", f"{name}_other", f"is_{name}_then"
    sides = (then, value.then, chosen), (other, value.other, f"~{chosen}")
    lines = _set(chosen, "truth", lanes.text(value.condition))
    for side, arm, where in sides:
        lines.append(f"    {TRUTH[kind]} {side} = {{0}};")
        lines.append(f"    if (has_any({where})) {{")
        lines += [f"        {line}" for line in wrapped(f"{side} = ", lanes.text(arm), "", WIDTH)]
        lines.append("    }")
    return [*lines, *_set(name, kind, f"{_chooser(kind)}({chosen}, {then}, {other})")]


def _divides(expr: Expr) -> bool:
    return any(isinstance(part, Binary) and part.operator == "/" for part in parts(expr))
