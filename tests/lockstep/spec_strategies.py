"""Random sampled automata as YAML text, with a system of two instances and a scenario."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

from hypothesis import strategies as st

from language.ir.number_type import NUMBER_TYPES
from tests.lockstep.expression_strategies import Draw

PERIOD_MS = 10
TICKS = 24
MODES = ("low", "mid", "high")
READS = ("u", "v", "x", "z", "a", "b", "c", "r")
RELATIONS = ("<", "<=", ">", ">=")

SYSTEM = """\
language: 1
system: pair
inputs: {u: {unit: "1"}, v: {unit: "1"}}
instances:
  first: {of: chance}
  second: {of: chance, values: {b: "%s"}, offset: %s ms}
connections: {first.u: u, first.v: v, second.u: first.r, second.v: u}
"""
SCENARIO = """\
language: 1
scenario: chances
of: pair
horizon: %s ms
inputs:
  u: {start: %s, steps: {%s}}
  v: {start: %s, steps: {%s}}
record: {every: 10 ms}
"""


@dataclass(frozen=True)
class Specs:
    """The texts of three files: automaton `chance`, system `pair`, scenario `chances`."""

    automaton: str
    system: str
    scenario: str


@st.composite
def specs(draw: Draw) -> Specs:
    """Return an automaton of two or three modes with guards, waits, resets and updates."""
    modes = MODES[: draw(st.integers(2, 3))]
    lines = [
        "language: 1",
        "automaton: chance",
        f"period: {PERIOD_MS} ms",
        f"numbers: {draw(st.sampled_from(NUMBER_TYPES))}",
        "parameters:",
        f"  a: {{value: {draw(numbers())}}}",
        f"  b: {{value: {draw(numbers())}, tunable: true}}",
        f'  c: {{derived: "{draw(sums(("a", "b"), 2))} + b"}}',
        'inputs: {u: {unit: "1", range: [-60, 60]}, v: {unit: "1", range: [-1.0e5, 1.0e5]}}',
        "states:",
        f'  x: {{unit: "1", initial: "{draw(sums(("u", "a", "c"), 2))}", range: [-1.0e5, 1.0e5]}}',
        f'  z: {{unit: "1", initial: "{draw(sums(("x", "v"), 1))}", range: [-1.0e7, 1.0e7]}}',
        "equations:",
        f"  r: {bounded(draw(sums(READS[:-1], 3)))}",
        "initial: low",
        "modes:",
    ]
    for mode in modes:
        lines += draw(mode_lines(mode, modes))
    lines.append("outputs: [x, z, r, s, go, mode]")
    scenario = SCENARIO % (
        PERIOD_MS * (TICKS - 1),
        *(draw(numbers()), draw(steps()), draw(numbers()), draw(steps())),
    )
    system = SYSTEM % (draw(numbers()), draw(st.integers(0, 12)))
    return Specs("\n".join(lines) + "\n", system, scenario)


@st.composite
def mode_lines(draw: Draw, mode: str, modes: tuple[str, ...]) -> list[str]:
    """Return a mode: equations of its own, updates, transitions of different priorities."""
    lines = [
        f"  {mode}:",
        "    equations:",
        f"      s: {draw(sums(READS, 3))}",
        f"      go: {draw(guards())}",
    ]
    if draw(st.booleans()):
        lines += ["    update:", f"      x: {bounded(draw(sums((*READS, 's'), 2)))}"]
        lines += [f"      z: {bounded(draw(sums((*READS, 's'), 2)))}"] * draw(st.integers(0, 1))
    lines.append("    transitions:")
    others = [other for other in modes if other != mode]
    for priority, other in enumerate(draw(st.permutations(others))):
        # In whole periods, between them, and none: the wait is rounded up to ticks.
        wait = draw(st.sampled_from(["", "", ", wait: 0 ms", ", wait: 15 ms", ", wait: 30 ms"]))
        reset = draw(st.sampled_from(["", "", "x", "xz"]))
        pairs = ", ".join(f'{name}: "{draw(sums((*READS, "s"), 2))}"' for name in reset)
        lines.append(
            f'      {other}: {{when: "{draw(guards())}", priority: {priority}{wait}'
            + (f", reset: {{{pairs}}}}}" if pairs else "}")
        )
    return lines


def bounded(text: str) -> str:
    """Return an expression kept within limits, so that a run does not end at an infinity."""
    return f"clip({text}, -1.0e6, 1.0e6)"


@st.composite
def numbers(draw: Draw) -> str:
    """Return a decimal number, with a point and an exponent or without."""
    whole = draw(st.integers(0, 50))
    digits = draw(st.sampled_from(["", ".1", ".5", ".333", ".0078125", ".1e-3", ".25e2"]))
    return f"{draw(st.sampled_from(['', '-']))}{whole}{digits}"


@st.composite
def steps(draw: Draw) -> str:
    """Return the steps of an input, half of them between two ticks."""
    instants = draw(st.lists(st.integers(1, 2 * TICKS), min_size=2, max_size=8, unique=True))
    times = [Fraction(PERIOD_MS * instant, 2) for instant in sorted(instants)]
    return ", ".join(f"{float(time)} ms: {draw(numbers())}" for time in times)


@st.composite
def sums(draw: Draw, names: tuple[str, ...], depth: int) -> str:
    """Return an expression without a division by what may be zero."""
    kind = draw(st.integers(0, 9)) if depth else draw(st.integers(8, 9))

    def part() -> str:
        text: str = draw(sums(names, depth - 1))
        return f"({text})"

    if kind <= 3:
        return f"{part()} {'+-*-'[kind]} {part()}"
    if kind == 4:
        return f"{part()} / (abs{part()} + 1)"
    if kind == 5:
        call = draw(st.sampled_from(["sin(%s * 1 rad)", "cos(%s * 1 rad)", "exp(-abs(%s))"]))
        return str(call % part())
    if kind == 6:
        call = draw(st.sampled_from(["min(%s, %s)", "max(%s, %s)", "tanh(%s) + sqrt(abs(%s))"]))
        return str(call % (part(), part()))
    if kind == 7:
        condition = f"{part()} {draw(st.sampled_from(RELATIONS))} {part()}"
        return f"if {condition} then {part()} else {part()}"
    return str(draw(numbers())) if kind == 8 else str(draw(st.sampled_from(names)))


@st.composite
def guards(draw: Draw) -> str:
    """Return a guard: one or two relations."""

    def relation() -> str:
        left, right = draw(sums(("u", "v", "x"), 1)), draw(sums(READS, 1))
        return f"({left}) {draw(st.sampled_from(RELATIONS))} ({right})"

    word = draw(st.sampled_from(["", "not", "and", "or", "or not"]))
    if word in ("", "not"):
        return f"{word} ({relation()})".strip()
    return f"{relation()} {word} ({relation()})"
