"""SIMD predictor: a predictor that follows several recordings at once, one in each SIMD lane.

An event-free step is one straight block of C in each mode configuration
(codegen/passes/fast_path.py). The module prints this block again over vectors. Each lane has the
bits of the scalar step. A lane in which an event occurs, or whose configuration has no such block,
executes the scalar step.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from codegen.emit.c_expression import LIBM_FUNCTIONS
from codegen.emit.c_module import module_context
from codegen.emit.c_names import CNames, c_member
from codegen.emit.c_statement import emit_wrapped_statement
from codegen.emit.c_struct import ECU_PAGE as MODULE_PAGE
from codegen.passes.fast_path import (
    EVENT_PATH,
    FAST_PATH,
    FAST_PATH_TAKEN,
    RECORD_BLOCK,
    ModeConfiguration,
    add_fast_path,
    mode_configurations,
)
from codegen.passes.pass_list import run_c_passes
from codegen.passes.step_restriction import restrict_to_step
from codegen.simulator.simd_batch import (
    LANES,
    LaneKind,
    NotVectorisable,
    VectorEmitter,
    flatten_name,
)
from language.ir.ops import Assign, Binary, Block, Branch, Call, Expr, Op, Ref, Select
from language.ir.program import MODE_VARIABLE, Program, unqualified_name
from language.ir.rewrite_ops import map_expressions, map_operands
from language.ir.traversal import block_writes, subexpressions
from language.numerics.function_table import FUNCTIONS
from language.numerics.payne_hanek import REDUCED_PARTS

PAGE_PREFIXES = ("derived.", "calibration.")
"""Prefixes of names that are constant during a run."""
REAL_PREFIX = "real_of "
"""Prefix of the name of a whole number that is read as a real."""
LINE_WIDTH = 96
"""Maximum length of a line."""
TEMPLATE_FUNCTIONS = ("abs", "min", "max", "clip", "floor", "sign", "pow2")
"""Functions that the template implements over vectors."""
VECTOR_TYPE: Mapping[LaneKind, str] = {"real": "Reals", "truth": "Truths"}
"""The C type of a vector by the kind of its lanes."""


def simd_recordings_context(
    program: Program, states: tuple[str, ...], outputs: tuple[str, ...]
) -> Any:
    """Return the context of the template of vectorised recordings.

    `states` are the names of the states, `outputs` those of the compared outputs. Returns None for
    float32, if no mode configuration has a step that can be vectorised, if a compared output is no
    real or a work variable, or if delays are recorded and the work variables of a step are not in
    the instance.
    """
    if program.number_type != "float64":
        return None
    fast = add_fast_path(restrict_to_step(program), "anew")
    records = _delay_record_context(program) if RECORD_BLOCK in fast.blocks else {"record": ""}
    if records is None:
        return None
    types = {one.name: one.type for one in fast.variables}
    types |= {one.name: one.type for one in fast.constants if not one.items}
    kinds: dict[str, LaneKind] = {
        name: "real" if kind == "real" else "truth"
        for name, kind in types.items()
        if kind in ("real", "truth")
    }
    kinds |= {REAL_PREFIX + name: "real" for name, kind in types.items() if kind == "whole"}
    fixed = frozenset(name for name in kinds if name.startswith("constant."))
    emitter = VectorEmitter(fast, kinds, fixed)
    steps = _merge_steps(
        [
            step
            for configuration in mode_configurations(fast, FAST_PATH)
            for step in _lane_steps(emitter, configuration)
        ]
    )
    try:
        return _template_context(emitter, steps, states, outputs) | records if steps else None
    except NotVectorisable:
        return None


def _delay_record_context(program: Program) -> dict[str, Any] | None:
    """Return the calls by which a lane records delayed values and executes a scalar step.

    Returns None if the work variables of a step are not in the instance.
    """
    context = module_context(run_c_passes(program, fast_path="anew"), MODULE_PAGE)
    calls, scratch = context["calls"], context["scratch"]
    if EVENT_PATH not in calls or not (scratch and scratch["is_in_instance"]):
        return None
    return {
        "record": calls[RECORD_BLOCK],
        "through": calls[EVENT_PATH],
        "work_type": context["work_type"],
    }


def _template_context(
    emitter: VectorEmitter,
    steps: list[_LaneStep],
    state_names: tuple[str, ...],
    outputs: tuple[str, ...],
) -> dict[str, Any]:
    """Return the template context of vectorised steps: members, functions and steps.

    Raises NotVectorisable if a compared output is not a real that outlives the step.
    """
    emitter.named_values.clear()
    wires = {wire.name: wire.source for wire in emitter.program.outputs}
    states = [emitter.vector_member(f"state.{name}") for name in state_names]
    inputs = [unqualified_name(variable.name) for variable in emitter.program.inputs]
    for name in inputs:
        emitter.vector_member(f"input.{name}")
        emitter.vector_member(f"before.{name}")
    output_members = _output_members(emitter, [wires[name] for name in outputs])
    written = {name for step in steps for name in step.ends}
    lasting = [name for name in emitter.accessed if not name.startswith((*PAGE_PREFIXES, "input."))]
    written_back = [n for n in lasting if n in written or n.startswith(("state.", "before."))]
    recorded = set(block_writes(emitter.program.blocks.get(RECORD_BLOCK, ())))
    functions = dict(reversed(list(_emit_functions(emitter))))
    region_modes = _region_mode_members(emitter.program)
    return {
        "lanes": LANES,
        "members": [
            *((flatten_name(name), VECTOR_TYPE[kind]) for name, kind in emitter.accessed.items()),
            *((member, VECTOR_TYPE["truth"]) for member, _, _ in region_modes),
        ],
        "page": _instance_members(
            emitter, [name for name in emitter.accessed if name.startswith(PAGE_PREFIXES)]
        ),
        "read": _instance_members(emitter, lasting) + region_modes,
        "written": _instance_members(emitter, written_back),
        "recorded": _instance_members(
            emitter, [n for n in lasting if n.removeprefix(REAL_PREFIX) in recorded]
        ),
        "inputs": [
            (flatten_name(name), flatten_name(f"before.{n}"), emitter.kind_of(Ref(name)), n)
            for n, name in ((n, f"input.{n}") for n in inputs)
        ],
        "states": states,
        "seen": output_members,
        "functions": functions,
        "called": [
            (name, count, LIBM_FUNCTIONS.get(name, f"ha_{name}"))
            for name, count in emitter.called_functions.items()
            if name not in (*functions, *TEMPLATE_FUNCTIONS)
        ],
        "fast_steps": steps,
    }


def _output_members(emitter: VectorEmitter, names: list[str]) -> list[str]:
    """Return the vector members of the compared outputs.

    Raises NotVectorisable unless all are reals, and no work variable is accessed.
    """
    members = [emitter.vector_member(name) for name in names]
    are_real = all(emitter.kind_of(Ref(name)) == "real" for name in names)
    if not are_real or any(name.startswith("work.") for name in emitter.accessed):
        raise NotVectorisable
    return members


def _region_mode_members(program: Program) -> list[tuple[str, str, str]]:
    """Return the members that hold the modes of regions: name, kind and place in an instance."""
    held = [name for name in program.mode_variables().values() if name != MODE_VARIABLE]
    return [(unqualified_name(name), "whole", CNames(program)(name)) for name in held]


def _instance_members(emitter: VectorEmitter, names: list[str]) -> list[tuple[str, LaneKind, str]]:
    """Return vector members with their kinds and their places in a scalar instance."""
    c_names = CNames(emitter.program)
    return [
        (flatten_name(name), emitter.accessed[name], c_names(name.removeprefix(REAL_PREFIX)))
        for name in names
    ]


@dataclass
class _LaneStep:
    """A vectorised event-free step of one or more mode configurations.

    `modes` maps the condition that a lane is in a configuration to the name of that configuration.
    `values` are constants in order: name, kind and text. `quiet` names the conditions that no guard
    changed, `ends` maps each variable to its value at the end of the step.
    """

    modes: dict[str, str]
    values: list[tuple[str, LaneKind, str]] = field(default_factory=list)
    quiet: list[str] = field(default_factory=list)
    ends: dict[str, str] = field(default_factory=dict)

    @property
    def lines(self) -> list[str]:
        """The C lines of the values."""
        return [line for value in self.values for line in _emit_constant(*value)]

    @property
    def commits(self) -> list[tuple[str, str, str]]:
        """The members written after an event-free step: member, value, macro that selects it."""
        return [(flatten_name(name), *end.split(" ")) for name, end in self.ends.items()]  # type: ignore[misc]


def _merge_steps(steps: list[_LaneStep]) -> list[_LaneStep]:
    """Return the steps with those merged that differ only in truth values.

    Lanes in either configuration then take the step together.
    """
    merged: list[_LaneStep] = []
    for step in steps:
        index = next((k for k, one in enumerate(merged) if _is_mergeable(one, step)), None)
        if index is None:
            merged.append(step)
        else:
            merged[index] = _merge_pair(merged[index], step)
    return merged


def _is_mergeable(first: _LaneStep, second: _LaneStep) -> bool:
    """Tell whether two steps differ in truth values only, as at both ends of a backlash."""
    reals = [[value for value in step.values if value[1] == "real"] for step in (first, second)]
    names = [[name for name, _, _ in step.values] for step in (first, second)]
    results = [(step.quiet, step.ends) for step in (first, second)]
    return all(one == other for one, other in (reals, names, results))


def _merge_pair(first: _LaneStep, second: _LaneStep) -> _LaneStep:
    """Return the merged step of two; each lane has the truth values of its own configuration."""
    there = " | ".join(second.modes)
    values = [
        (name, kind, text if text == other else f"CHOSEN_TRUTH({there}, {other}, {text})")
        for (name, kind, text), (_, _, other) in zip(first.values, second.values, strict=True)
    ]
    return _LaneStep(first.modes | second.modes, values, first.quiet, first.ends)


def _select_macro(kind: LaneKind) -> str:
    """Return the macro that selects between two vectors of a kind."""
    return "CHOSEN" if kind == "real" else "CHOSEN_TRUTH"


def _lane_steps(emitter: VectorEmitter, configuration: ModeConfiguration) -> Iterator[_LaneStep]:
    """Yield the vectorised step of a mode configuration; nothing if it has none."""
    block = emitter.program.blocks.get(configuration.block_name)
    if block is None:
        return
    block = map_expressions(block, _integers_as_reals)
    emitter.named_values.clear()
    held = [
        f"(all->{unqualified_name(name)} == {number})"
        for name, number in configuration.mode_numbers
    ]
    here = f"({' & '.join(held)})" if held[1:] else held[0]
    step, accessed = (
        _LaneStep({here: configuration.block_name.removeprefix(f"{FAST_PATH}_")}),
        dict(emitter.accessed),
    )
    try:
        _emit_event_free_arm(emitter, step, block)
    except NotVectorisable:
        emitter.accessed = accessed
        return
    yield step


def _integers_as_reals(expr: Expr) -> Expr:
    """Return an expression with names with REAL_PREFIX for conversions of whole numbers."""
    match expr:
        case Call("real", (Ref(name),)):
            return Ref(REAL_PREFIX + name)
    return map_operands(expr, _integers_as_reals)


def _emit_event_free_arm(emitter: VectorEmitter, step: _LaneStep, ops: Block) -> None:
    """Add the operations of a block to a step; of a branch, only the arm without an event.

    That arm consists of assignments. Raises NotVectorisable for any other operation.
    """
    for op in ops:
        match op:
            case Assign(target) if target == FAST_PATH_TAKEN:
                continue
            case Assign(target, value) if emitter.kind_of(Ref(target)) == emitter.kind_of(value):
                is_local = target.startswith("work.")
                name = (
                    c_member(target)
                    if is_local
                    else f"end_{len(step.values)}_{flatten_name(target)}"
                )
                kind = emitter.kind_of(value)
                step.values.append((name, kind, emitter.emit_expression(value)))
                emitter.named_values[target] = name, kind
                if not is_local:
                    emitter.accessed.setdefault(target, kind)
                    step.ends[target] = f"{name} {_select_macro(kind)}"
            case Branch(condition, then, other) if _is_assignments_only(
                then
            ) or _is_assignments_only(other):
                name, sign = (
                    f"is_quiet_{len(step.quiet)}",
                    "" if _is_assignments_only(then) else "~",
                )
                step.values.append((name, "truth", f"{sign}{emitter.emit_expression(condition)}"))
                step.quiet.append(name)
                _emit_event_free_arm(emitter, step, other if sign else then)
            case _:
                raise NotVectorisable


def _is_assignments_only(ops: Block) -> bool:
    """Tell whether a block has only assignments, and branches with such an arm."""
    return all(_is_assignment_like(op) for op in ops)


def _is_assignment_like(op: Op) -> bool:
    """Tell whether an operation is an assignment, or a branch with an arm of assignments."""
    if isinstance(op, Branch):
        return _is_assignments_only(op.then) or _is_assignments_only(op.other)
    return isinstance(op, Assign)


def _emit_constant(name: str, kind: LaneKind, text: str) -> list[str]:
    """Return the lines that define a constant vector."""
    return [
        f"    {line}"
        for line in emit_wrapped_statement(
            f"const {VECTOR_TYPE[kind]} {name} = ", text, "", LINE_WIDTH
        )
    ]


def _emit_functions(
    emitter: VectorEmitter,
) -> Iterator[tuple[str, tuple[tuple[str, ...], list[str]]]]:
    """Yield the called elementary functions over vectors: name, parameters and lines.

    A function comes before those that it calls. Functions that cannot be vectorised are left out.
    """
    for name in reversed(list(FUNCTIONS)):
        if name not in emitter.called_functions:
            continue
        function = FUNCTIONS[name]
        emitter.named_values = {f"work.{p}": (p, "real") for p in function.parameters}
        lines: list[str] = []
        try:
            for op in function.body:
                assert isinstance(op, Assign)
                local, kind = op.target.partition(".")[2], emitter.kind_of(op.value)
                lines += _emit_value(emitter, local, kind, op.value)
                emitter.named_values[op.target] = local, kind
        except NotVectorisable:
            continue
        yield name, (tuple(function.parameters), lines)


def _emit_value(emitter: VectorEmitter, name: str, kind: LaneKind, value: Expr) -> list[str]:
    """Return the lines that define a value.

    If both arms of a choice divide, or one arm is the reduction of a large angle, each arm is
    computed only if a lane selects it.
    """
    if not (isinstance(value, Select) and _are_arms_costly(value)):
        return _emit_constant(name, kind, emitter.emit_expression(value))
    then, other, chosen = f"{name}_then", f"{name}_other", f"is_{name}_then"
    sides = (then, value.then, chosen), (other, value.other, f"~{chosen}")
    lines = _emit_constant(chosen, "truth", emitter.emit_expression(value.condition))
    for side, arm, where in sides:
        lines.append(f"    {VECTOR_TYPE[kind]} {side} = {{0}};")
        lines.append(f"    if (has_any({where})) {{")
        lines += [
            f"        {line}"
            for line in emit_wrapped_statement(
                f"{side} = ", emitter.emit_expression(arm), "", LINE_WIDTH
            )
        ]
        lines.append("    }")
    return [
        *lines,
        *_emit_constant(name, kind, f"{_select_macro(kind)}({chosen}, {then}, {other})"),
    ]


def _are_arms_costly(choice: Select) -> bool:
    """Tell whether both arms of a choice contain a division, or one arm reduces a large angle."""
    arms = choice.then, choice.other
    return all(map(_has_division, arms)) or any(
        isinstance(arm, Call) and arm.function in REDUCED_PARTS for arm in arms
    )


def _has_division(expr: Expr) -> bool:
    """Tell whether an expression contains a division."""
    return any(isinstance(part, Binary) and part.operator == "/" for part in subexpressions(expr))
