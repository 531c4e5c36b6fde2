"""C names: the C text and the C type of each variable and constant of a Program."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

from language.ir.number_type import NumberType
from language.ir.program import (
    MODE_VARIABLE,
    SHORT_TIMER_TICKS,
    TICK_UNIT,
    Constant,
    Program,
    TransitionInfo,
    Variable,
    mode_variable,
    unqualified_name,
)
from language.ir.root_region import CHART

C_REAL_TYPE: Mapping[NumberType, str] = {"float64": "double", "float32": "float"}
"""The C type of a real by the number type."""
MODE_PREFIXES = ("memory.mode", "memory.run_mode")
"""Prefixes of variables that hold the number of a mode."""
TRANSITION_PREFIXES = ("memory.fired", "memory.log", "work.request_", "work.selected_")
"""Prefixes of variables that hold the number of a transition."""
UNSIGNED_PREFIXES = ("timer.", "memory.faults", *TRANSITION_PREFIXES)
"""Prefixes of variables beside which a number is written with the suffix U."""
SOLVED_PREFIX_CONSTANT, SOLVED_PREFIX_ON_PAGE = "solved_", "cal->solved."
"""The prefixes of solved numbers in C: as constants of the file, and as members of the calibration
page."""


@dataclass(frozen=True)
class CNames:
    """The C text of names inside one function: locals by name, all others as members.

    `local` holds the names of the local variables. `solved_prefix` stands before solved numbers.
    """

    program: Program
    local: frozenset[str] = frozenset()
    solved_prefix: str = SOLVED_PREFIX_CONSTANT

    @property
    def number(self) -> NumberType:
        """The number type of the reals (rule C1)."""
        return self.program.number_type

    def __call__(self, name: str) -> str:
        """Return the C text of a variable or constant: `self->state.w_em` for `state.w_em`."""
        group, _, rest = name.partition(".")
        member = c_member(name)
        if name in self.local:
            return member
        match group:
            case "constant":
                return f"constant.{rest}"
            case "solved":
                return f"{self.solved_prefix}{member}"
            case "axis":
                return f"axis_{member}"
            case "calibration":
                return f"cal->{rest}"
            case "input":
                return f"in->{rest}"
            case "is_new":
                return f"in->is_new.{rest}"
            case "work":
                return f"work->{member}"
            case "memory":
                return f"self->{rest}"
            case _:
                return f"self->{group}.{rest}"

    def integer_constant(self, name: str, number: int) -> str:
        """Return the C text of a number that is compared with or assigned to the variable `name`.

        Modes, transitions and enumeration values have named constants. Any other number, also one
        outside the enumeration, is decimal, with the suffix U beside a variable of
        UNSIGNED_PREFIXES. Raises StopIteration for a mode number that the Program does not have.
        """
        if name == "memory.mode":
            return mode_constant(self.program, number)
        if name == "memory.run_mode":
            return run_mode_constant(self.program, number)
        for region in self.program.regions:
            if name == mode_variable(MODE_VARIABLE, region.name):
                return mode_constant(self.program, number, region.name)
        if name.startswith(TRANSITION_PREFIXES) and number in self._transition_names:
            return self._transition_names[number]
        values = self._enumeration_values(name)
        if values and 0 <= number < len(values):
            return value_constant(self.program, values, number)
        return f"{number}U" if name.startswith(UNSIGNED_PREFIXES) else str(number)

    def is_unsigned(self, name: str) -> bool:
        """Tell whether a variable or constant is an unsigned integer in C.

        These are variables whose C type begins with `uint` and constants in ticks; False for an
        unknown name.
        """
        return name in self._unsigned_variables

    def is_volatile(self, name: str) -> bool:
        """Tell whether a constant is on the page of an ECU, which is volatile (rule C14)."""
        return name.startswith("calibration.") and self.solved_prefix == SOLVED_PREFIX_ON_PAGE

    @cached_property
    def _unsigned_variables(self) -> frozenset[str]:
        kinds = {v.name: c_type(v, self.number) for v in self.program.variables}
        ticks = (c.name for c in self.program.constants if c.unit == TICK_UNIT)
        return frozenset((*(n for n, kind in kinds.items() if kind.startswith("uint")), *ticks))

    @cached_property
    def _transition_names(self) -> Mapping[int, str]:
        return transition_constants(self.program)

    def _enumeration_values(self, name: str) -> tuple[str, ...]:
        """Return the enumeration values of a variable or constant.

        Returns an empty tuple for all others.
        """
        return next(
            (values for known, values in _enumeration_lists(self.program) if known == name), ()
        )


def c_member(name: str) -> str:
    """Return the name of a member or local: without its group, with underscores for dots.

    The group is the part before the first dot. In the name of a solved matrix entry two underscores
    separate row and column: `solved.drive_L.w_em.y_w` is `drive_L_w_em__y_w`.
    """
    matrix, *entry = unqualified_name(name).split(".")
    apart = "__" if name.startswith("solved.") else "_"
    return "_".join((matrix, apart.join(entry))) if entry else matrix


def c_type(variable: Variable | Constant, number: NumberType) -> str:
    """Return the C type of a variable or constant (rule C10).

    Reals have the type of `number`, truth values bool, enumerations uint8_t, timers and values in
    ticks uint16_t or uint32_t, transition numbers uint16_t, the fault word uint32_t, modes int16_t,
    other whole numbers int32_t.
    """
    if variable.type == "real":
        return C_REAL_TYPE[number]
    if variable.type == "truth":
        return "bool"
    if variable.values:
        return "uint8_t"
    if variable.name.startswith("timer.") or variable.unit == TICK_UNIT:
        return "uint16_t" if _largest_ticks(variable) <= SHORT_TIMER_TICKS else "uint32_t"
    if variable.name == "memory.faults":
        return "uint32_t"
    if variable.name.startswith(TRANSITION_PREFIXES):
        return "uint16_t"
    return "int16_t" if variable.name.startswith(MODE_PREFIXES) else "int32_t"


def _largest_ticks(variable: Variable | Constant) -> int:
    """Return the largest value of a counter; of a tunable wait the value of its counter after it.

    A wait and its counter so have the same type.
    """
    if isinstance(variable, Variable):
        return variable.largest
    assert variable.range
    return int(variable.range[1]) + 1


def mode_constant(program: Program, number: int, region: str = CHART) -> str:
    """Return the name of the C constant of a mode: `<program>_MODE_<mode>` (rule C9).

    For a parallel region, the name of the region stands for MODE. Dots become underscores. Raises
    StopIteration for an unknown number or region.
    """
    where = "MODE" if region == CHART else region
    return f"{program.name}_{where}_{program.mode_name(number, region)}".replace(".", "_")


def transition_constants(program: Program) -> dict[int, str]:
    """Return the names of the C constants of all transitions by number.

    A name is `<program>_FIRED_<source>_<name>` with underscores for dots; the source mode has its
    region before it in a parallel region. If several transitions have the same name, `_<number>` is
    appended to each.
    """
    names = {info.number: _transition_constant(program, info) for info in program.transitions}
    count = Counter(names.values())
    return {n: f"{name}_{n}" if count[name] > 1 else name for n, name in names.items()}


def _transition_constant(program: Program, info: TransitionInfo) -> str:
    """Return the name of the C constant of a transition; it may not be unique."""
    source = program.mode_name(info.source, info.region)
    if info.chart_endpoints:
        source = info.chart_endpoints[0]
    elif info.region != CHART:
        source = f"{info.region}_{source}"
    return f"{program.name}_FIRED_{source}_{info.name}".replace(".", "_")


def run_mode_constant(program: Program, number: int) -> str:
    """Return the name of the C constant of a run mode: `<program>_RUN_<mode>`.

    A run mode is a mode of the model that a run integrates. Raises StopIteration for an unknown
    number.
    """
    name = next(mode.name for mode in program.run_modes if mode.number == number)
    return f"{program.name}_RUN_{name}"


def enumerations(program: Program) -> list[tuple[str, tuple[str, ...]]]:
    """Return each nonempty list of enumeration values once, with the name of its first owner.

    Owners are the constants, then the variables, in Program order; the name is that of `c_member`.
    """
    owner_by_values: dict[tuple[str, ...], str] = {}
    for name, values in _enumeration_lists(program):
        if values:
            owner_by_values.setdefault(values, c_member(name))
    return [(name, values) for values, name in owner_by_values.items()]


def value_constant(program: Program, values: tuple[str, ...], number: int) -> str:
    """Return the name of the C constant of an enumeration value: `<program>_<owner>_<value>`.

    The owner is that of `enumerations`; `number` is an index of `values`. Raises StopIteration if
    no constant or variable has these values.
    """
    owner = next(name for name, known in enumerations(program) if known == values)
    return f"{program.name}_{owner}_{values[number]}"


def _enumeration_lists(program: Program) -> list[tuple[str, tuple[str, ...]]]:
    """Return all constants and variables with their enumeration values, which may be empty."""
    constants = [(constant.name, constant.values) for constant in program.constants]
    return constants + [(variable.name, variable.values) for variable in program.variables]
