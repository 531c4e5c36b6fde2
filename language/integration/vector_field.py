"""The vector field of a continuous automaton: rates and guards at the point `work.at_<state>`.

Integration methods evaluate the blocks `rates_<mode>`; the location of crossings and the
micro-steps evaluate the blocks `guards_<mode>`.
"""

from __future__ import annotations

import dataclasses
from collections import ChainMap
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from language.expressions.units import rate_dimension
from language.ir.analysis_cache import cache_on_owner
from language.ir.ops import (
    Assign,
    Binary,
    Block,
    Compare,
    Expr,
    Op,
    Ref,
    RunBlock,
    Switch,
    Value,
    integer,
)
from language.ir.program import Variable, mode_variable
from language.lowering.action_stages import (
    StageBindings,
    action_variables,
    stage_reads,
    transition_stages,
)
from language.lowering.continuous_edge_detection import level_change_conditions, set_levels
from language.lowering.expressions import (
    NameBindings,
    choose_by_mode,
    equation_bindings,
    lower_equations,
    lower_expression,
    lower_rate,
    names_read,
)
from language.lowering.guard_variable_names import (
    all_guard_slots,
    guard_slot,
    guard_slots,
    mode_bindings,
)
from language.lowering.program_builder import equation_variables
from language.model.automaton import Automaton, Balance, Mode, Transition
from language.model.region_queries import (
    possible_balances,
    region_of_balance,
    watched_transitions,
)


@dataclass(frozen=True)
class VectorField:
    """A continuous automaton to integrate, on its own or as a run inside a tick.

    `constants` and `inputs` are the expressions of parameters and inputs. `mode_variable_name` is
    the variable of the mode of the chart. `is_time_dependent` tells whether inputs or delayed
    values change with `work.s`, the time since the start of the step. `guard_memory` gives the
    conditions of `after` and of edges, by the key path of a mode. `has_stage_blocks` tells whether
    the stages of a method are blocks that all modes share.
    """

    automaton: Automaton
    constants: NameBindings
    inputs: NameBindings
    mode_variable_name: str
    key_prefix: str
    is_time_dependent: bool = False
    guard_memory: Mapping[str, NameBindings] = dataclasses.field(default_factory=dict)
    has_stage_blocks: bool = False

    @property
    def states(self) -> tuple[str, ...]:
        """The names of the states, in the order of the file."""
        return tuple(self.automaton.states)

    @property
    def guard_slots(self) -> tuple[str, ...]:
        """The suffixes of the guard variables of all regions, those of the chart first."""
        return tuple(all_guard_slots(self.automaton))

    def mode_variable_of(self, region: str) -> str:
        """Return the variable that holds the mode of a region.

        It is derived from `mode_variable_name`, which is that of the chart.
        """
        return mode_variable(self.mode_variable_name, region)


def field_blocks(field: VectorField) -> dict[str, Block]:
    """Return the blocks `rates_<mode>` and `guards_<mode>` of each mode of the chart.

    A mode of a parallel region has a `guards_<region>_<mode>` block only; its balances are in the
    rates of the modes of the chart. Each block evaluates the equations that it reads first.
    """
    blocks: dict[str, Block] = {}
    for region in field.automaton.regions:
        for mode in region.modes.values():
            blocks[f"guards_{mode.label}"] = tuple(
                _lower_own_guards(field, mode, region.max_transitions)
            )
    for name, mode in field.automaton.modes.items():
        blocks[f"rates_{name}"] = _lower_rates(field, mode)
        blocks[f"guards_{name}"] = _lower_guards(field, mode)
    return blocks


def field_variables(field: VectorField) -> list[Variable]:
    """Return the `work` variables of the blocks of a vector field.

    They are `work.at_<state>` and `work.rate_<state>` of each state, `work.at_<name>` of each
    equation, `work.guard_<slot>` of each guard slot, and those of actions (`action_variables`).
    """
    found = []
    for state, thing in field.automaton.states.items():
        dimension = thing.unit.dimension
        about = "at the point of evaluation"
        found.append(Variable(f"work.at_{state}", "real", str(dimension), about=about))
        found.append(
            Variable(f"work.rate_{state}", "real", str(rate_dimension(dimension)), about=about)
        )
    found += equation_variables(field.automaton, "work.at_")
    about = "a guard of the mode that flows, in the order of its transitions"
    found += [Variable(f"work.guard_{slot}", "truth", about=about) for slot in field.guard_slots]
    found += action_variables(field.automaton)
    return found


def bindings_at_point(field: VectorField) -> dict[str, Expr]:
    """Return a new dict of the expressions of names at the point, without equations.

    States are `work.at_<state>`; inputs and constants are those of the field; conditions on modes
    are included.
    """
    return dict(_bindings_at_point(field))


@cache_on_owner
def _bindings_at_point(field: VectorField) -> dict[str, Expr]:
    """Return the cached expressions of names at the point, without equations."""
    known: dict[str, Expr] = dict(field.constants)
    known.update(field.inputs)
    known.update({name: Ref(f"work.at_{name}") for name in field.states})
    known.update(mode_bindings(field.automaton, field.mode_variable_name))
    return known


@cache_on_owner
def all_bindings_at_point(field: VectorField) -> dict[str, Expr]:
    """Return the expressions of names at the point, equations of all modes included.

    An equation is `work.at_<name>`. The dict is cached by field and not to be changed.
    """
    known = bindings_at_point(field)
    known.update(equation_bindings(field.automaton, "work.at_"))
    return known


def set_point_to_state(field: VectorField) -> list[Op]:
    """Return the assignments `work.at_<state> = state.<state>` of all states."""
    return [Assign(f"work.at_{name}", Ref(f"state.{name}")) for name in field.states]


def set_point_time(field: VectorField, time: Expr) -> list[Op]:
    """Return the assignment of a time since the start of the step [s] to `work.s`.

    The list is empty if the field does not depend on time.
    """
    return [Assign("work.s", time)] if field.is_time_dependent else []


def run_block_by_mode(field: VectorField, block_prefix: str) -> Switch:
    """Return a Switch over the mode of the chart that runs `<block_prefix>_<mode>`."""
    modes = field.automaton.modes.values()
    return Switch(
        field.mode_variable_name,
        tuple((m.number, (RunBlock(f"{block_prefix}_{m.name}"),)) for m in modes),
    )


def any_guard_condition(
    field: VectorField, mode: Mode, armed: Mapping[str, str] | None = None
) -> Expr:
    """Return the condition that a guard of a mode is true, or has changed if `armed` is given.

    The guards are those of the mode and its parallel regions; without any it starts from false.
    `armed` maps guard slots to the variables of their earlier truth. A change of the level of any
    edge of the automaton counts as well, in both cases.
    """
    result: Expr = Value(False)
    for k, watched in enumerate(guard_slots(mode)):
        guard: Expr = Ref(f"work.guard_{watched}")
        if armed is not None:
            guard = Compare("!=", guard, Ref(armed[watched]))
        result = guard if k == 0 else Binary("or", result, guard)
    for level in level_change_conditions(field.automaton):
        result = Binary("or", result, level)
    return result


def stage_bindings(field: VectorField, targets: Iterable[Mode]) -> StageBindings:
    """Return what the stages of a transition read at the point (rule 6).

    `targets` are the modes of the chart that may be active after it. Their equations are evaluated
    by the active mode.
    """

    def equations_of(names: list[str]) -> Iterable[Op]:
        """Return the operations that evaluate the equations of the active mode among some names."""
        cases = []
        for mode in targets:
            known = bindings_at_point(field)
            ops = lower_equations(mode, known, "work.at_", field.key_prefix, names)
            cases.append((mode.number, tuple(ops)))
        if len(cases) == 1:
            return cases[0][1]
        return [Switch(field.mode_variable_name, tuple(cases))] * any(ops for _, ops in cases)

    known = all_bindings_at_point(field)
    return StageBindings(known, known, equations_of, tuple(set_point_to_state(field)))


def set_target_mode(field: VectorField, transition: Transition) -> Assign:
    """Return the assignment that makes the target of a transition the mode of its region."""
    number = field.automaton.target_mode(transition).number
    return Assign(field.mode_variable_of(transition.region), integer(number))


def _lower_rates(field: VectorField, mode: Mode) -> Block:
    """Return the block that evaluates `work.rate_<state>` of all states in a mode.

    A balance of a parallel region is chosen by the mode of that region.
    """
    known = bindings_at_point(field)
    required = names_read(
        tree for balance in possible_balances(mode) for tree in (balance.right, balance.left)
    )
    ops = lower_equations(mode, known, "work.at_", field.key_prefix, required)

    def rate_is(balance: Balance) -> Assign:
        """Return the assignment of the rate of a balance."""
        target = f"work.rate_{balance.state}"
        return Assign(target, lower_rate(balance, known), field.key_prefix + balance.key)

    for name in field.states:
        region = region_of_balance(mode, name)
        if region is None:
            ops.append(rate_is(mode.flow[name]))
        else:
            modes = region.modes.values()
            cases = {other.name: (rate_is(other.flow[name]),) for other in modes}
            ops.append(choose_by_mode(region, known, cases))
    return tuple(ops)


def _lower_guards(field: VectorField, mode: Mode) -> Block:
    """Return the block of the guards of a mode of the chart and of its parallel regions.

    The equations that guards, exits and resets read are evaluated first.
    """
    known = bindings_at_point(field)
    watched = list(watched_transitions(mode))
    read = [name for transition in watched for name in transition.when.reads]
    for transition in watched:
        read += stage_reads(transition_stages(field.automaton, transition).before)
    ops = lower_equations(mode, known, "work.at_", field.key_prefix, read)
    ops += _lower_own_guards(field, mode, len(mode.transitions))
    for region in mode.parallel_regions:
        modes = region.modes.values()
        cases: dict[str, Block] = {m.name: (RunBlock(f"guards_{m.label}"),) for m in modes}
        ops.append(choose_by_mode(region, known, cases))
    return tuple(ops)


def _lower_own_guards(field: VectorField, mode: Mode, slot_count: int) -> list[Op]:
    """Return the operations that set the guards of a mode.

    Unused slots up to `slot_count` become false.
    """
    known = ChainMap(dict(field.guard_memory.get(mode.key, {})), all_bindings_at_point(field))
    ops = set_levels(field.automaton, mode, known)
    for k, transition in enumerate(mode.transitions):
        guard = lower_expression(transition.when.tree, known)
        target = f"work.guard_{guard_slot(mode.region, k)}"
        ops.append(Assign(target, guard, field.key_prefix + transition.when.key))
    for k in range(len(mode.transitions), slot_count):
        ops.append(Assign(f"work.guard_{guard_slot(mode.region, k)}", Value(False)))
    return ops
