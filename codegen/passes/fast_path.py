"""Fast path: a pass that adds a straight-line block for a step without an event (rule C18).

  before                      after
  block step                  block step
      if memory.started           memory.is_fast_path_taken := False
          <flow>                  if memory.started
      else                            run fast_path
          <enter>                 if (not memory.is_fast_path_taken)
      <end of the step>               run through_events
                              block fast_path
                                  when memory.mode is 1
                                      run fast_path_<mode>
                              block fast_path_<mode>
                                  <values up to the guards>
                                  if <no guard changed>
                                      <states and equations at the end of the step>
                                      memory.is_fast_path_taken := True
                              block through_events
                                  <the block step of before>

In most steps of a continuous automaton no guard changes; the same holds for most ticks that run a
model. Block `fast_path_<mode>` executes such a step. It is specialised to what is known of it: its
length, its mode, and that it has no inner event. Each value has its own name, so a compiler keeps
it in a register. Equations whose values at the end of the step before are still valid are not
computed again. If a guard changed, `through_events` executes the step from its beginning. The bits
of all results stay the same.
"""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

from codegen.passes.path_specialisation import (
    POINT_STATE_PREFIX,
    TIME_LEFT,
    ExecutionPath,
    NotSpecialisable,
)
from language.ir.ops import (
    Assign,
    Block,
    Branch,
    Expr,
    Loop,
    Op,
    Ref,
    RunBlock,
    Switch,
    Unary,
    Value,
)
from language.ir.program import ENTRY_BLOCKS, MODE_VARIABLE, ModeInfo, Program, Variable
from language.ir.rewrite_ops import direct_expressions, map_expressions, map_operands
from language.ir.traversal import block_writes, expr_names, names_used
from language.lowering.program_builder import finalise_program
from language.programs.model_run import RUN_MODE

FastPathMode = Literal["on", "anew", "off"]
"""Whether fast paths are added. `anew` computes all equations in each step; it is needed where
states are set between steps, as in a predictor, so that values of the step before are not valid."""
FAST_PATH, FAST_PATH_TAKEN, RECORD_BLOCK, STARTED = (
    "fast_path",
    "memory.is_fast_path_taken",
    "record",
    "memory.started",
)
EVENT_PATH = "through_events"
"""The block that executes a step from event to event."""
STEP_END_PREFIX = "work.end_"
"""The prefix of work variables that hold the states at the end of a step."""
ModeNumbers = tuple[tuple[str, int], ...]
"""Pairs of a mode variable and the number of a mode."""
MAX_CONFIGURATIONS = 12
"""Maximum number of mode configurations with a fast path each; more would be too much code."""
CLEAR_TAKEN = (Assign(FAST_PATH_TAKEN, Value(False)),)
"""The operation that clears the flag of a taken fast path."""


@dataclass(frozen=True)
class ModeConfiguration:
    """A mode configuration: the number of the active mode by mode variable.

    `block_name` is the name of the block that executes an event-free step in it.
    """

    block_name: str
    mode_numbers: ModeNumbers

    @property
    def known_values(self) -> dict[str, Expr]:
        """The numbers of the active modes as literal expressions, by mode variable."""
        return {variable: Value(number) for variable, number in self.mode_numbers}


def add_fast_path(program: Program, fast_path: FastPathMode = "on") -> Program:
    """Return a Program with a fast path for a step without an event.

    For a continuous Program the fast path is that of its own step, for a sampled one that of the
    model that it runs. The Program is returned unchanged with "off", if it is sampled and float64
    (on an ECU with float32 hardware its values would be on the stack), and if no mode can be
    specialised. A mode whose path cannot be specialised, for example one with a wait, always takes
    the general path. If no mode has a guard, there is no general path in the step.
    """
    if fast_path == "off":
        return program
    if program.period is None:
        return _add_step_fast_path(program, fast_path)
    return _add_run_fast_path(program) if program.number_type == "float32" else program


def _add_step_fast_path(program: Program, fast_path: FastPathMode) -> Program:
    """Return a continuous Program with a fast path for its step; see the module for the rule."""
    match program.blocks["step"]:
        case (Branch(started, flow, enter), *rest):
            pass
        case _:
            return program
    first = tuple(op for op in flow if op == RunBlock(RECORD_BLOCK))
    flow = tuple(op for op in flow if op != RunBlock(RECORD_BLOCK))
    configurations = (
        list(mode_configurations(program, FAST_PATH))
        if fast_path == "anew"
        else _region_configurations(program.modes, FAST_PATH)
    )
    paths = dict(_step_paths(program, flow, fast_path, configurations))
    once = (*first, RunBlock(FAST_PATH))
    if _are_unconditional(paths, configurations):
        step: Block = (Branch(started, once, (*enter, *rest)),)
    else:
        step = (*CLEAR_TAKEN, Branch(started, once), *_fallback(EVENT_PATH))
    whole = (Branch(started, flow, enter), *rest)
    return _insert_fast_path(program, FAST_PATH, paths, {"step": step, EVENT_PATH: whole})


def _add_run_fast_path(program: Program) -> Program:
    """Return a sampled Program in which each run of a model has a fast path over the whole tick."""
    made = program
    for name, block in program.blocks.items():
        if _is_event_loop(block):
            mode = name.removeprefix("run_")
            block_name, event_path = f"{FAST_PATH}_{mode}", f"{EVENT_PATH}_{mode}"
            configurations = _region_configurations(program.run_modes, block_name, RUN_MODE)
            equations = program.blocks.get(f"equations_{mode}", ())
            paths = dict(_run_paths(program, block, equations, configurations))
            once: Block = (RunBlock(block_name),)
            if not _are_unconditional(paths, configurations):
                once = (*CLEAR_TAKEN, *once, *_fallback(event_path))
            made = _insert_fast_path(made, block_name, paths, {name: once, event_path: block})
    return made


def _fallback(event_path: str) -> Block:
    """Return the operation that runs `event_path` if the fast path was not taken."""
    return (Branch(Unary("not", Ref(FAST_PATH_TAKEN)), (RunBlock(event_path),)),)


def mode_configurations(program: Program, prefix: str) -> Iterator[ModeConfiguration]:
    """Yield the mode configurations of a Program: all combinations of the modes of its regions.

    The last region varies fastest. The block name of a configuration is `prefix` and, for each
    region, `_` and the name of its mode. Yields nothing for a Program with parallel regions and
    more than MAX_CONFIGURATIONS combinations.
    """
    names = program.mode_variables()
    by_region = [
        _region_configurations(program.modes_of(region), "", names[region]) for region in names
    ]
    if program.regions and math.prod(map(len, by_region)) > MAX_CONFIGURATIONS:
        return
    for combination in itertools.product(*by_region):
        numbers = tuple(
            pair for configuration in combination for pair in configuration.mode_numbers
        )
        yield ModeConfiguration(
            prefix + "".join(configuration.block_name for configuration in combination), numbers
        )


def _region_configurations(
    modes: Sequence[ModeInfo], prefix: str, variable: str = MODE_VARIABLE
) -> list[ModeConfiguration]:
    """Return one configuration for each mode of a region; `variable` is its mode variable."""
    return [
        ModeConfiguration(f"{prefix}_{mode.name}", ((variable, mode.number),)) for mode in modes
    ]


def _are_unconditional(
    paths: Mapping[ModeConfiguration, ExecutionPath], configurations: Sequence[ModeConfiguration]
) -> bool:
    """Tell whether every configuration has a path without guards."""
    return all(one in paths and paths[one].is_unconditional for one in configurations)


def _is_event_loop(block: Block) -> bool:
    """Tell whether a block executes a tick from event to event: an assignment, then a loop."""
    match block:
        case (Assign(target), Loop(), *_):
            return target == TIME_LEFT
    return False


def _run_paths(
    program: Program, flow: Block, equations: Block, configurations: Sequence[ModeConfiguration]
) -> Iterator[tuple[ModeConfiguration, ExecutionPath]]:
    """Yield for each mode of the model that is run its specialised path through a tick.

    Modes whose path cannot be specialised are left out. Equations are reused only if no update
    assigns a state, because updates run after the equations were computed.
    """
    updates = [block for name, block in program.blocks.items() if name.startswith("update")]
    is_fixed = not any(name.startswith("state.") for b in updates for name in block_writes(b))
    for configuration in configurations:
        path = ExecutionPath(program, configuration.known_values)
        try:
            path.reuse_equations(equations if is_fixed else (), ("state.", "constant."))
            path.follow(flow)
        except NotSpecialisable:
            continue
        yield configuration, path


def _step_paths(
    program: Program,
    flow: Block,
    fast_path: FastPathMode,
    configurations: Sequence[ModeConfiguration],
) -> Iterator[tuple[ModeConfiguration, ExecutionPath]]:
    """Yield for each mode configuration its specialised path through a step.

    Configurations whose path cannot be specialised are left out.
    """
    for configuration in configurations:
        path = ExecutionPath(program, configuration.known_values | {STARTED: Value(True)})
        mode = configuration.block_name.removeprefix(f"{FAST_PATH}_")
        known = program.blocks.get(f"equations_{mode}", ()) if fast_path == "on" else ()
        try:
            path.reuse_equations(known, ("state.", "constant.", "before."))
            path.follow(flow)
            path.follow_step_end()
        except NotSpecialisable:
            continue
        yield configuration, path


def _insert_fast_path(
    program: Program,
    block_name: str,
    paths: Mapping[ModeConfiguration, ExecutionPath],
    changed: Mapping[str, Block],
) -> Program:
    """Return a Program with the blocks of the paths, their dispatcher, and `changed` blocks.

    `block_name` is the name of the dispatching block. The Program is returned as it is if there are
    no paths, or if one of the new names is taken.
    """
    if not paths or {block_name, *(one.block_name for one in paths)} & set(program.blocks):
        return program
    sets_taken = FAST_PATH_TAKEN in names_used(changed.values())
    blocks = {}
    for configuration, path in paths.items():
        block = _remove_dead_assignments(_fast_path_block(path, sets_taken))
        blocks[configuration.block_name] = _rename_values(block, path)
    dispatch = _dispatch_on_modes([(one.mode_numbers, one.block_name) for one in paths])
    added: dict[str, Variable] = {}
    used = names_used(blocks.values())
    for path in paths.values():
        names = ((old, name) for old, name in _value_names(path).items() if name in used)
        added |= {n: dataclasses.replace(path.values[old].variable, name=n) for old, n in names}
    added[FAST_PATH_TAKEN] = Variable(
        FAST_PATH_TAKEN, "truth", about="the fast path was taken: no guard changed in the step"
    )
    variables = (
        *(v for v in program.variables if v.name not in added),
        *added.values(),
    )
    blocks = {**program.blocks, **blocks, block_name: dispatch, **changed}
    return finalise_program(
        dataclasses.replace(program, blocks=blocks, variables=variables), ENTRY_BLOCKS
    )


def _dispatch_on_modes(titles: Sequence[tuple[ModeNumbers, str]]) -> Block:
    """Return nested switches that run the block of the active mode configuration."""
    ((numbers, title), *_) = titles
    if not numbers:
        return (RunBlock(title),)
    inner: dict[int, list[tuple[ModeNumbers, str]]] = {}
    for ((_, number), *rest), one in titles:
        inner.setdefault(number, []).append((tuple(rest), one))
    cases = tuple((number, _dispatch_on_modes(some)) for number, some in inner.items())
    return (Switch(numbers[0][0], cases),)


def _fast_path_block(path: ExecutionPath, sets_taken: bool) -> Block:
    """Return the block of a path: its prologue, then its operations if no guard changed.

    With `sets_taken` the block sets the flag that the fast path was taken.
    """
    last = (*path.ops, Assign(FAST_PATH_TAKEN, Value(True))) if sets_taken else tuple(path.ops)
    return (
        (*path.prologue, *last)
        if path.is_unconditional
        else (*path.prologue, Branch(path.is_event_free, last))
    )


def _value_names(path: ExecutionPath) -> dict[str, str]:
    """Return the new name of each value of a path: its variable and the point of the step.

    Names that would occur twice get the version number of the value.
    """
    names = {}
    for name, made in path.values.items():
        variable, point = made.variable.name, made.point
        if variable.startswith(STEP_END_PREFIX):
            variable, point = variable.replace(STEP_END_PREFIX, POINT_STATE_PREFIX), path.points
        names[name] = f"{variable}_{_point_name(point, path.points)}"
    count = Counter(names.values())
    return {
        n: f"{title}{n[n.rindex('_') :]}" if count[title] > 1 else title
        for n, title in names.items()
    }


def _point_name(point: int, points: int) -> str:
    """Return the name of a point of the step: start, middle, end, or its number."""
    if point in (1, points):
        return "start" if point == 1 else "end"
    return "middle" if points == 3 else str(point)


def _rename_values(block: Block, path: ExecutionPath) -> Block:
    """Return a block in which the values of a path have the names of `_value_names`."""
    names = _value_names(path)

    def called(expr: Expr) -> Expr:
        if isinstance(expr, Ref):
            return dataclasses.replace(expr, name=names.get(expr.name, expr.name))
        return map_operands(expr, called)

    def setting(ops: Block) -> Iterator[Op]:
        for op in ops:
            match op:
                case Assign(target):
                    yield dataclasses.replace(op, target=names.get(target, target))
                case Branch(condition, then, other):
                    yield Branch(condition, tuple(setting(then)), tuple(setting(other)))
                case _:
                    yield op

    return map_expressions(tuple(setting(block)), called)


def _remove_dead_assignments(block: Block) -> Block:
    """Return a block without assignments to work variables that no later operation reads."""
    return tuple(reversed(list(_live_operations(block, set()))))


def _live_operations(block: Block, live_names: set[str]) -> Iterator[Op]:
    """Yield, from the last to the first, the operations of a block whose values are read.

    `live_names` holds the names that later operations read; it is extended in place.
    """
    for op in reversed(block):
        live = op
        if isinstance(op, Branch):
            arms = [
                tuple(reversed(list(_live_operations(arm, live_names))))
                for arm in (op.then, op.other)
            ]
            live = Branch(op.condition, *arms)
        elif (
            isinstance(op, Assign) and op.target.startswith("work.") and op.target not in live_names
        ):
            continue
        for expr in direct_expressions(op):
            live_names.update(expr_names(expr))
        yield live
