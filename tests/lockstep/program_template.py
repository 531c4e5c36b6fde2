"""A sampled Program of three modes around given blocks: variables, constants, outputs, entries."""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction

from language.ir.number_type import NumberType
from language.ir.ops import (
    Assign,
    Block,
    Branch,
    Compare,
    FaultBit,
    Ref,
    RunBlock,
    Switch,
    Value,
    integer,
)
from language.ir.program import (
    Constant,
    ModeInfo,
    OutputWire,
    Program,
    TransitionInfo,
    ValueType,
    Variable,
)
from language.lowering.program_builder import finalise_program

PERIOD = Fraction(1, 100)
MODES = ("rest", "move", "stop")
INPUTS = ("u", "v", "w")
STATES = ("x", "y")
EQUATIONS = 36
CONDITIONS = 12
SIZE = 4
"""Length of the array `work.list`."""


def assemble_program(
    blocks: dict[str, Block],
    values: tuple[float, float, float],
    number: NumberType = "float64",
) -> Program:
    """Return the Program of some blocks, without the variables that they do not use."""
    program = Program(
        name="random",
        number_type=number,
        period=PERIOD,
        major_step=PERIOD,
        constants=_constants(*values),
        variables=_variables(),
        outputs=(
            OutputWire("mode", "memory.mode", "whole", "1"),
            OutputWire("r0", "equation.r0", "real", "1"),
            OutputWire("q0", "equation.q0", "truth", "1"),
        ),
        modes=tuple(ModeInfo(mode, number) for number, mode in enumerate(MODES)),
        transitions=tuple(_transitions()),
        faults=("stale_calibration", *(f"odd_{mode}" for mode in MODES)),
        functions=(),
        blocks={**blocks, "init": _init(), "step": _step(blocks)},
    )
    return finalise_program(program, entries=("init", "derive", "step"))


def _constants(a: float, b: float, p: float) -> tuple[Constant, ...]:
    return (
        Constant("constant.a", "fixed", a),
        Constant("constant.b", "fixed", b),
        Constant("calibration.p", "tunable", p),
        Constant("derived.c", "derived", 0.0),
        Constant("derived.d", "derived", 0.0),
        Constant("solved.stamp_p", "solved", p, depends_on=("p",)),
    )


def _variables() -> tuple[Variable, ...]:
    def group(name: str, names: Iterable[str], kind: ValueType = "real") -> list[Variable]:
        return [Variable(f"{name}.{part}", kind) for part in names]

    equations = [*(f"r{k}" for k in range(EQUATIONS)), "m0", "m1", "total", "row"]
    temporary = [f"{verb}_{name}" for verb in ("next", "reset") for name in STATES]
    return (
        *group("input", INPUTS),
        *group("input", ["go"], "truth"),
        *group("is_new", ["u"], "truth"),
        *group("state", STATES),
        *group("equation", equations),
        *group("equation", [f"q{k}" for k in range(CONDITIONS)], "truth"),
        *group("before", ["u"]),
        *group("timer", MODES, "whole"),
        *group("memory", ["mode", "fired", "faults"], "whole"),
        *group("memory", ["started"], "truth"),
        *group("work", [*temporary, "sum", "local"]),
        *group("work", ["row", "turn"], "whole"),
        *group("work", ["flag"], "truth"),
        Variable("work.list", "real", size=SIZE),
    )


def _transitions() -> Iterable[TransitionInfo]:
    for source in range(len(MODES)):
        for way in (1, 2):
            number, target = 2 * source + way, (source + way) % len(MODES)
            yield TransitionInfo(number, "t", source, target, Fraction(0), 0, None, "")


def _init() -> Block:
    stale = Compare("!=", Ref("calibration.p"), Ref("solved.stamp_p"))
    return (
        Assign("memory.started", Value(False)),
        Assign("memory.mode", integer(0)),
        Assign("memory.faults", integer(0)),
        Branch(stale, (FaultBit("stale_calibration"),)),
    )


def _step(blocks: dict[str, Block]) -> Block:
    """Advance, jump and update, as language/programs/sampled_program.py prints them."""

    def each(verb: str) -> Switch:
        names = [(number, f"{verb}_{mode}") for number, mode in enumerate(MODES)]
        return Switch(
            "memory.mode",
            tuple((number, (RunBlock(name),)) for number, name in names if name in blocks),
        )

    return (
        Assign("memory.fired", integer(0)),
        Branch(Ref("memory.started"), (each("advance"),), (RunBlock("start"),)),
        each("equations"),
        each("jump"),
        Branch(Compare("!=", Ref("memory.fired"), integer(0)), (each("equations"),)),
        each("update"),
        RunBlock("retain_inputs"),
    )
