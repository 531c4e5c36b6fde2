"""Assembly of a Program: variables, outputs, start values, and the removal of unused parts.

The lowering of sampled and of continuous automata shares these functions.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping
from fractions import Fraction

from language.expressions.units import Dimension
from language.ir.annotate_types import annotate_types
from language.ir.number_type import NumberType, round_to_type
from language.ir.ops import Assign, Binary, Block, Compare, Expr, Op, Ref, integer
from language.ir.program import (
    Constant,
    Function,
    ModeInfo,
    OutputWire,
    Program,
    RegionInfo,
    TransitionInfo,
    ValueType,
    Variable,
    fired_variable,
    mode_variable,
    value_type,
)
from language.ir.rewrite_ops import remove_empty_switches
from language.ir.root_region import CHART
from language.ir.round_literals import round_program
from language.ir.traversal import called_functions, names_used, reachable_blocks
from language.lowering.expressions import WHOLE_TYPES, lower_assigned_value
from language.lowering.invariants import invariant_infos
from language.lowering.program_parameters import cast_to_type
from language.lowering.range_saturation import store_initial_value
from language.model.automaton import Automaton, Region
from language.model.declaration import State
from language.model.graph_algorithms import post_order
from language.model.statechart import Chart
from language.numerics.function_table import FUNCTIONS_BY_TYPE
from language.typecheck.types import EnumType, IntType

INACTIVE = "inactive"
"""The name of the mode of a region inside a mode while that mode is not active."""
FORMULA_RESULT = "work.value"
"""The variable that a block of a Program of formulas sets."""


def input_variables(automaton: Automaton, group: str) -> list[Variable]:
    """Return a variable `<group>.<name>` for each input, in the order of the file.

    Only the group `input` has a comment: the key path and the description of the input, separated
    by `; `.
    """
    return [
        Variable(
            f"{group}.{name}",
            value_type(thing.type),
            str(thing.unit.dimension),
            about="; ".join(filter(None, (thing.key, thing.about))) if group == "input" else "",
            values=thing.values,
        )
        for name, thing in automaton.inputs.items()
    ]


def state_variables(automaton: Automaton) -> list[Variable]:
    """Return `state.<name>` for each state, then `equation.<name>` for each equation of any mode.

    A state of a continuous automaton carries its range, in SI units.
    """
    found = [
        Variable(
            f"state.{name}",
            "real",
            str(thing.unit.dimension),
            about=thing.about,
            range=event_range(automaton, thing),
        )
        for name, thing in automaton.states.items()
    ]
    return [*found, *equation_variables(automaton, "equation.")]


def event_range(automaton: Automaton, thing: State) -> tuple[float, float] | None:
    """Return the range whose violation is an event (rule 18c), rounded to float64.

    The result is None for a sampled automaton and for a variable without a range.
    """
    if automaton.is_sampled or thing.range is None:
        return None
    return round_to_type(thing.range[0]), round_to_type(thing.range[1])


def equation_variables(automaton: Automaton, group: str) -> list[Variable]:
    """Return a variable `<group><name>` for each equation of any mode.

    `group` is a prefix such as `equation.` or `work.at_`. The order is that of the first mode that
    defines each equation.
    """
    found = []
    for name in dict.fromkeys(n for mode in automaton.all_modes for n in mode.equations):
        kind, unit, values = _equation_type(automaton, name)
        found.append(Variable(f"{group}{name}", kind, unit, values=values))
    return found


def _equation_type(automaton: Automaton, name: str) -> tuple[ValueType, str, tuple[str, ...]]:
    """Return the value type, the unit and the enumeration literals of an equation.

    The unit is `1` and there are no literals unless the type says otherwise.
    """
    kind = automaton.name_types.get(name)
    if isinstance(kind, Dimension):
        return "real", str(kind), ()
    values = kind.values if isinstance(kind, EnumType) else ()
    return ("whole" if isinstance(kind, IntType | EnumType) else "truth"), "1", values


def output_wires(automaton: Automaton) -> tuple[OutputWire, ...]:
    """Return the outputs in the order of the file, each with the variable that it reads.

    `faults` reads the fault word. The output `mode` reads the mode of the chart and adds one output
    for each other region, `_` for dots in its name, unless an output has that name. Others are
    regions, states, discrete variables and equations.
    """
    found = []
    for output in automaton.outputs:
        name = automaton.output_source(output)
        if name == "faults":
            found.append(OutputWire(output, "memory.faults", "whole", "1"))
            continue
        if name == "mode":
            for region in automaton.all_regions:
                variable = mode_variable("memory.mode", region.name)
                wire = output if region.name == CHART else region.name.replace(".", "_")
                if wire == output or wire not in automaton.outputs:
                    found.append(OutputWire(wire, variable, "whole", "1"))
            continue
        if name in (region.name for region in automaton.all_regions):
            found.append(OutputWire(output, mode_variable("memory.mode", name), "whole", "1"))
            continue
        thing = automaton.state_variables.get(name)
        if thing:
            group = "discrete" if name in automaton.discrete else "state"
            unit = str(thing.unit.dimension)
            found.append(OutputWire(output, f"{group}.{name}", value_type(thing.type), unit))
            continue
        kind, unit, _ = _equation_type(automaton, name)
        found.append(OutputWire(output, f"equation.{name}", kind, unit))
    return tuple(found)


def region_variables(automaton: Automaton, activation_unit: str) -> list[Variable]:
    """Return `memory.mode` and the fired-transition variable of each region, in pairs.

    `activation_unit`, such as `tick`, is the word that the comments use for one execution.
    """
    found = []
    for region in automaton.all_regions:
        where = "" if region.name == CHART else f" of region {region.name}"
        mode = mode_variable("memory.mode", region.name)
        found.append(Variable(mode, "whole", about=f"active mode{where}"))
        about = f"transition{where} of this {activation_unit}, 0: none"
        found.append(Variable(fired_variable(region.name), "whole", about=about))
    return found


def clear_fired(automaton: Automaton) -> list[Op]:
    """Return the assignments that set the fired-transition variable of each region to 0."""
    return [Assign(fired_variable(region.name), integer(0)) for region in automaton.all_regions]


def any_fired_condition(automaton: Automaton) -> Expr:
    """Return the condition that the fired-transition variable of some region is not 0."""
    found: Expr | None = None
    for region in automaton.all_regions:
        here = Compare("!=", Ref(fired_variable(region.name)), integer(0))
        found = here if found is None else Binary("or", found, here)
    assert found is not None
    return found


def enter_initial_modes(automaton: Automaton, base: str) -> list[Assign]:
    """Return the assignments of the initial mode's number to the mode variable of each region.

    `base` is the mode variable of the chart. In a chart with nested modes, a region that is not
    part of the initial configuration gets its number for inactive.
    """
    if automaton.statechart:
        return _enter_initial_nodes(automaton, automaton.statechart, base)
    return [
        Assign(mode_variable(base, region.name), integer(region.modes[region.initial].number))
        for region in automaton.all_regions
    ]


def _enter_initial_nodes(automaton: Automaton, chart: Chart, base: str) -> list[Assign]:
    """Return the assignments that activate the initial configuration of nested modes."""
    numbers = {
        node.region: node.number
        for node in chart.initial_configuration()
        if node.number is not None
    }
    found = []
    for region in automaton.all_regions:
        number = numbers.get(region.name, region.inactive)
        assert number is not None
        found.append(Assign(mode_variable(base, region.name), integer(number)))
    return found


def lower_initial_values(automaton: Automaton, known: Mapping[str, Expr], prefix: str) -> list[Op]:
    """Return the assignments of the start values of all states and discrete variables.

    Each variable comes after those that its start value reads. `prefix` opens the key paths. In a
    sampled automaton a start value is held in the range of its variable (rule 18).
    """
    ops: list[Op] = []
    variables = automaton.state_variables
    for name in post_order({name: state.initial.reads for name, state in variables.items()}):
        state = variables[name]
        value = lower_assigned_value(state.initial.tree, known, state.type in WHOLE_TYPES)
        ops += store_initial_value(automaton, name, value, prefix + state.initial.key)
    return ops


def input_defaults(automaton: Automaton) -> dict[str, float | bool]:
    """Return the declared default of each input that has one, by name, in the type of the input.

    A real is rounded to the number type; an enumeration gives its number.
    """
    found: dict[str, float | bool] = {}
    for name, thing in automaton.inputs.items():
        if thing.default is not None:
            found[name] = cast_to_type(round_to_type(thing.default, automaton.numbers), thing.type)
    return found


def assemble_program(
    automaton: Automaton,
    blocks: Mapping[str, Block],
    constants: Iterable[Constant],
    variables: Iterable[Variable],
    transitions: tuple[TransitionInfo, ...],
) -> Program:
    """Return a Program of blocks, with outputs, modes, regions and invariants of the automaton.

    Variables with equal names are merged: the last one wins, at the place of the first. Faults and
    functions are still empty. The major step is the period, else the step.
    """
    return Program(
        name=automaton.name,
        number_type=automaton.numbers,
        period=automaton.period,
        major_step=automaton.period or automaton.step,
        constants=tuple(constants),
        variables=tuple({variable.name: variable for variable in variables}.values()),
        outputs=output_wires(automaton),
        modes=mode_infos(automaton.root_region),
        invariants=invariant_infos(automaton),
        regions=tuple(RegionInfo(r.name, mode_infos(r)) for r in automaton.regions),
        transitions=transitions,
        faults=(),
        functions=(),
        blocks=blocks,
        defaults=input_defaults(automaton),
    )


def formula_program(
    name: str, variables: Iterable[Variable], blocks: Mapping[str, Block]
) -> Program:
    """Return a Program without modes, of which each block is run alone and computes in float64.

    A block sets FORMULA_RESULT, which is added to `variables`, or one of these.
    """
    program = Program(
        name=name,
        number_type="float64",
        period=None,
        major_step=Fraction(1),
        constants=(),
        variables=(*variables, Variable(FORMULA_RESULT, "real")),
        outputs=(),
        modes=(),
        transitions=(),
        faults=(),
        functions=(),
        blocks=blocks,
    )
    return finalise_program(program, tuple(blocks))


def mode_infos(region: Region) -> tuple[ModeInfo, ...]:
    """Return the modes of a region with their numbers, in the order of the file.

    The mode `inactive` comes last if the region has a number for it.
    """
    found = [ModeInfo(mode.name, mode.number) for mode in region.modes.values()]
    if region.inactive is not None:
        found.append(ModeInfo(INACTIVE, region.inactive))
    return tuple(found)


def finalise_program(
    program: Program, entries: tuple[str, ...], keep: tuple[str, ...] = ()
) -> Program:
    """Return the Program with only the blocks that are reachable from its entry blocks.

    Entries that do not exist are ignored. Switches without cases are removed. Constants and
    variables that no block, output or `keep` names are removed, except inputs and the `is_new`
    flags; tunables that solved constants depend on stay. The elementary functions that are called
    are added. Literals are rounded to the number type, and references get the types of their
    declarations. `retain_inputs` keeps only inputs that another block reads.
    """
    runs = (reachable_blocks(entry, program.blocks) for entry in entries if entry in program.blocks)
    reached = set[str]().union(*runs)
    blocks = {
        name: remove_empty_switches(block)
        for name, block in program.blocks.items()
        if name in reached
    }
    used = names_used(blocks.values())
    used |= {*keep, *(wire.source for wire in program.outputs)}
    constants = [c for c in program.constants if c.name in used]
    while True:
        needed = {name for c in constants if c.kind == "solved" for name in c.depends_on}
        more = {f"calibration.{name}" for name in needed} - {c.name for c in constants}
        if not more:
            break
        constants += [c for c in program.constants if c.name in more]
    functions = _used_functions(called_functions(blocks.values()), program.number_type)
    interface = ("input.", "is_new.")
    variables = [v for v in program.variables if v.name in used or v.name.startswith(interface)]
    variables = _remove_unused_before(variables, blocks)
    return annotate_types(
        round_program(
            dataclasses.replace(
                program,
                constants=tuple(constants),
                variables=tuple(variables),
                functions=functions,
                blocks=blocks,
            )
        )
    )


def _remove_unused_before(variables: list[Variable], blocks: dict[str, Block]) -> list[Variable]:
    """Return the variables without each `before.<input>` that no block but `retain_inputs` reads.

    The block `retain_inputs` in `blocks` is replaced by one without the assignments to them.
    """
    if "retain_inputs" not in blocks:
        return variables
    reading = names_used(block for name, block in blocks.items() if name != "retain_inputs")
    assignments = tuple(
        op for op in blocks["retain_inputs"] if isinstance(op, Assign) and op.target in reading
    )
    blocks["retain_inputs"] = assignments
    targets = {op.target for op in assignments}
    return [v for v in variables if not v.name.startswith("before.") or v.name in targets]


def _used_functions(called: set[str], number: NumberType) -> tuple[Function, ...]:
    """Return the elementary functions among `called`, with those that these call."""
    known = FUNCTIONS_BY_TYPE[number]
    stack = [*called]
    found: set[str] = set()
    while stack:
        name = stack.pop()
        if name in known and name not in found:
            found.add(name)
            stack += called_functions([known[name].body])
    return tuple(function for name, function in known.items() if name in found)
