"""Leap: a step in which nothing happens, as one block of C; bits stay (rule C18).

In nearly all steps of a continuous automaton no guard changes, nor in nearly all ticks that run
one. `leap_<mode>` is what is done then, followed with all that is known of such a step: its length,
its mode, that it is one piece. Each value has a name of its own, so that a compiler keeps it in a
register, and what the equations were when the step before ended is not computed again. Where a
guard changed, the step is gone through from where it began.
"""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

from codegen.way import LEFT, PLACE, NotPlain, Way
from language.operation import Assign, Block, Branch, Choose, Expr, Loop, Op, Ref, Run, Unary, Value
from language.program import MODE, ModeInfo, Program, Variable
from language.run import MODE as RUN_MODE
from language.substitution import own_expressions, with_expressions, with_parts
from language.traversal import block_writes, expr_names, reads
from language.wiring import finished

Leaps = Literal["on", "anew", "off"]
"""Whether there are leaps; `anew` computes all equations, for one whose states are set between its
steps, as those of a predictor are: what they were when the step before ended does not count."""
ENTRIES = ("init", "derive", "step")
LEAP, DONE, RECORD, STARTED = "leap", "memory.is_leapt", "record", "memory.started"
THROUGH = "through_events"
END = "work.end_"
Numbers = tuple[tuple[str, int], ...]
MOST_STAYS = 12
"""Modes of chart and regions together that have a leap each: more are too much C."""
UNDONE = (Assign(DONE, Value(False)),)


@dataclass(frozen=True)
class Stay:
    """Where an automaton stays in a step: its modes, as the `numbers` of the variables that hold
    them; `title` is the block of such a step.
    """

    title: str
    numbers: Numbers

    @property
    def known(self) -> dict[str, Expr]:
        """What the variables are."""
        return {variable: Value(number) for variable, number in self.numbers}


def leaping(program: Program, leaps: Leaps = "on") -> Program:
    """Return a Program that takes a whole step at once where nothing happens in it: its own one if
    it is continuous, else that of a model that it runs; the Program itself where `leaps` are off.

    Modes that wait take the general path always; modes without a guard never do. A run in float64,
    which is software on an ECU that has float32 in hardware, stays as it is: its values would be
    on the stack.
    """
    if leaps == "off":
        return program
    if program.period is None:
        return _stepping(program, leaps)
    return _running(program) if program.number == "float32" else program


def _stepping(program: Program, leaps: Leaps) -> Program:
    match program.blocks["step"]:
        case (Branch(started, flow, enter), *rest):
            pass
        case _:
            return program
    first = tuple(op for op in flow if op == Run(RECORD))
    flow = tuple(op for op in flow if op != Run(RECORD))
    stays = list(stays_of(program, LEAP)) if leaps == "anew" else _of_modes(program.modes, LEAP)
    ways = dict(_ways(program, flow, leaps, stays))
    once = (*first, Run(LEAP))
    if _are_sure(ways, stays):
        step: Block = (Branch(started, once, (*enter, *rest)),)
    else:
        step = (*UNDONE, Branch(started, once), *_else(THROUGH))
    whole = (Branch(started, flow, enter), *rest)
    return _with_leaps(program, LEAP, ways, {"step": step, THROUGH: whole})


def _running(program: Program) -> Program:
    """Return a Program whose runs of a model take a whole tick at once where nothing happens."""
    made = program
    for name, block in program.blocks.items():
        if _is_through(block):
            mode = name.removeprefix("run_")
            leap, through = f"{LEAP}_{mode}", f"{THROUGH}_{mode}"
            stays = _of_modes(program.run_modes, leap, RUN_MODE)
            equations = program.blocks.get(f"equations_{mode}", ())
            ways = dict(_run_ways(program, block, equations, stays))
            once: Block = (Run(leap),)
            if not _are_sure(ways, stays):
                once = (*UNDONE, *once, *_else(through))
            made = _with_leaps(made, leap, ways, {name: once, through: block})
    return made


def _else(through: str) -> Block:
    return (Branch(Unary("not", Ref(DONE)), (Run(through),)),)


def stays_of(program: Program, leap: str) -> Iterator[Stay]:
    """Yield the modes of a chart; with regions beside it each with each, unless these are many."""
    names = program.mode_variables()
    found = [_of_modes(program.modes_of(region), "", names[region]) for region in names]
    if program.regions and math.prod(map(len, found)) > MOST_STAYS:
        return
    for stays in itertools.product(*found):
        numbers = tuple(pair for stay in stays for pair in stay.numbers)
        yield Stay(leap + "".join(stay.title for stay in stays), numbers)


def _of_modes(modes: Sequence[ModeInfo], leap: str, variable: str = MODE) -> list[Stay]:
    return [Stay(f"{leap}_{mode.name}", ((variable, mode.number),)) for mode in modes]


def _are_sure(ways: Mapping[Stay, Way], stays: Sequence[Stay]) -> bool:
    """Tell whether nothing has a guard, wherever it stays."""
    return all(stay in ways and ways[stay].is_sure for stay in stays)


def _is_through(block: Block) -> bool:
    """Tell whether a block goes through a tick from event to event."""
    match block:
        case (Assign(target), Loop(), *_):
            return target == LEFT
    return False


def _run_ways(
    program: Program, flow: Block, equations: Block, stays: Sequence[Stay]
) -> Iterator[tuple[Stay, Way]]:
    """Yield the way through a tick without a crossing of each mode of the model.

    What updates does not count yet when equations are made: then these are computed again.
    """
    updates = [block for name, block in program.blocks.items() if name.startswith("update")]
    is_fixed = not any(name.startswith("state.") for b in updates for name in block_writes(b))
    for stay in stays:
        way = Way(program, stay.known)
        try:
            way.keep(equations if is_fixed else (), ("state.", "constant."))
            way.follow(flow)
        except NotPlain:
            continue
        yield stay, way


def _ways(
    program: Program, flow: Block, leaps: Leaps, stays: Sequence[Stay]
) -> Iterator[tuple[Stay, Way]]:
    """Yield the way through a step without a crossing of each stay that has one."""
    for stay in stays:
        way = Way(program, stay.known | {STARTED: Value(True)})
        mode = stay.title.removeprefix(f"{LEAP}_")
        known = program.blocks.get(f"equations_{mode}", ()) if leaps == "on" else ()
        try:
            way.keep(known, ("state.", "constant.", "before."))
            way.follow(flow)
            way.end()
        except NotPlain:
            continue
        yield stay, way


def _with_leaps(
    program: Program, leap: str, ways: Mapping[Stay, Way], changed: Mapping[str, Block]
) -> Program:
    """Return a Program with a block `leap` by the modes that variables tell, and changed blocks.

    The same Program where nothing has a way, or where a block is called like that already.
    """
    if not ways or {leap, *(stay.title for stay in ways)} & set(program.blocks):
        return program
    tells = DONE in reads(changed.values())
    done = {stay: _needed(_block(way, tells)) for stay, way in ways.items()}
    blocks = {stay.title: _named(done[stay], way) for stay, way in ways.items()}
    chosen = _chosen([(stay.numbers, stay.title) for stay in ways])
    made: dict[str, Variable] = {}
    used = reads(blocks.values())
    for way in ways.values():
        names = ((old, name) for old, name in _names(way).items() if name in used)
        made |= {n: dataclasses.replace(way.made[old].variable, name=n) for old, n in names}
    made[DONE] = Variable(DONE, "truth", about="the whole step is taken: nothing happened in it")
    variables = (
        *(v for v in program.variables if v.name not in made),
        *made.values(),
    )
    blocks = {**program.blocks, **blocks, leap: chosen, **changed}
    return finished(dataclasses.replace(program, blocks=blocks, variables=variables), ENTRIES)


def _chosen(titles: Sequence[tuple[Numbers, str]]) -> Block:
    """Return what runs the block of the modes that variables tell, one variable in another."""
    ((numbers, title), *_) = titles
    if not numbers:
        return (Run(title),)
    inner: dict[int, list[tuple[Numbers, str]]] = {}
    for ((_, number), *rest), one in titles:
        inner.setdefault(number, []).append((tuple(rest), one))
    cases = tuple((number, _chosen(some)) for number, some in inner.items())
    return (Choose(numbers[0][0], cases),)


def _block(way: Way, tells: bool) -> Block:
    """Return what is done on a way: what comes after the guards if none of them changed; the end
    `tells` that it is done.
    """
    last = (*way.ops, Assign(DONE, Value(True))) if tells else tuple(way.ops)
    return (*way.first, *last) if way.is_sure else (*way.first, Branch(way.quiet, last))


def _names(way: Way) -> dict[str, str]:
    """Return what each value is called: as its variable is, with the point of the step."""
    names = {}
    for name, made in way.made.items():
        variable, point = made.variable.name, made.point
        if variable.startswith(END):
            variable, point = variable.replace(END, PLACE), way.points
        names[name] = f"{variable}_{_title(point, way.points)}"
    count = Counter(names.values())
    return {
        n: f"{title}{n[n.rindex('_') :]}" if count[title] > 1 else title
        for n, title in names.items()
    }


def _title(point: int, points: int) -> str:
    """Return what a point of a step is called: start, middle, end, or by its number."""
    if point in (1, points):
        return "start" if point == 1 else "end"
    return "middle" if points == 3 else str(point)


def _named(block: Block, way: Way) -> Block:
    """Return a block whose values are called by their names."""
    names = _names(way)

    def called(expr: Expr) -> Expr:
        if isinstance(expr, Ref):
            return dataclasses.replace(expr, name=names.get(expr.name, expr.name))
        return with_parts(expr, called)

    def setting(ops: Block) -> Iterator[Op]:
        for op in ops:
            match op:
                case Assign(target):
                    yield dataclasses.replace(op, target=names.get(target, target))
                case Branch(condition, then, other):
                    yield Branch(condition, tuple(setting(then)), tuple(setting(other)))
                case _:
                    yield op

    return with_expressions(tuple(setting(block)), called)


def _needed(block: Block) -> Block:
    """Leave out the values of a step that nothing reads."""
    return tuple(reversed(list(_kept(block, set()))))


def _kept(block: Block, read: set[str]) -> Iterator[Op]:
    """Yield, from the last to the first, the operations of a block whose values are read."""
    for op in reversed(block):
        kept = op
        if isinstance(op, Branch):
            arms = [tuple(reversed(list(_kept(arm, read)))) for arm in (op.then, op.other)]
            kept = Branch(op.condition, *arms)
        elif isinstance(op, Assign) and op.target.startswith("work.") and op.target not in read:
            continue
        for expr in own_expressions(op):
            read.update(expr_names(expr))
        yield kept
