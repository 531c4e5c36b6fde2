"""Automata at the edges of the language: what is unusual is generated, compiled and equal too."""

from __future__ import annotations

import dataclasses
import itertools
from pathlib import Path

import pytest

from language.ir.program import Program
from lockstep.comparison import Verdict, compare
from modewright.api.simulation import program
from tests.lockstep.heater import column
from tests.lockstep.program_strategies import Tick, record_ticks

HEAD = """\
language: 1
automaton: edge
period: 10 ms
numbers: float64
"""
VALUES = (0.5, -0.0, 2.0, float("nan"), 1e308, -3.0, float("inf"), 0.25)
WHOLES = (3, -3, 2147483647, 7, -2147483647, 0, 16777217, 2147483646)


def edge(folder: Path, body: str) -> Program:
    path = folder / "edge.yaml"
    path.write_text(HEAD + body)
    return program(str(path))


def verdict(used: Program) -> Verdict:
    """Run eight ticks with special values in all inputs."""
    inputs: list[Tick] = [
        {v.name: {"truth": value > 0.3, "whole": whole}.get(v.type, value) for v in used.inputs}
        for value, whole in zip(VALUES, itertools.cycle(WHOLES), strict=False)
    ]
    found = compare(record_ticks(used, inputs))
    assert found.ticks == len(VALUES)
    return found


CASES = {
    "what is derived from tunables": """\
parameters:
  k: {value: 1.7, tunable: true}
  d: {derived: k * 3 + 1 / k}
  e: {derived: sqrt(d) - sin(d * 1 rad)}
inputs: {u: {unit: "1"}}
states: {x: {unit: "1", initial: e}}
equations: {r: u * e + d}
modes: {only: {update: {x: x + e}}}
outputs: [r, x]
""",
    "tunables without anything derived": """\
parameters: {k: {value: 1.7, tunable: true}}
inputs: {u: {unit: "1"}}
equations: {r: u * k}
modes: {only: {}}
outputs: [r]
""",
    "no inputs": """\
states: {x: {unit: "1", initial: 1}}
modes: {only: {update: {x: x * 1.1}}}
outputs: [x]
""",
    "no outputs": """\
inputs: {u: {unit: "1"}}
states: {x: {unit: "1", initial: 1}}
modes: {only: {update: {x: x * u}}}
""",
    "no real value": """\
inputs: {u: {unit: "1"}}
initial: a
modes:
  a: {transitions: {b: {when: u > 1}}}
  b: {transitions: {a: {when: u < 0, wait: 10 ms}}}
outputs: [mode]
""",
    "nothing but truth": """\
inputs: {go: {type: bool}}
equations: {q: not go, p: go and q or not q}
modes: {only: {}}
outputs: [q, p]
""",
    "the lowest and highest numbers of modes": """\
inputs: {u: {unit: "1"}}
equations: {r: u * 2}
initial: a
modes:
  a: {number: -100, transitions: {b: {when: u > 1}}}
  b: {number: 100, transitions: {a: {when: u < 0}}}
outputs: [mode, r]
""",
    "the longest wait": """\
inputs: {u: {unit: "1"}}
equations: {r: u * 2}
initial: a
modes:
  a: {transitions: {b: {when: u < 1, wait: 655.34 s}}}
  b: {transitions: {a: {when: u > 0, wait: 10 ms}}}
outputs: [mode, r]
""",
    "overflow and underflow of literals": """\
inputs: {u: {unit: "1"}}
equations: {r: u / 1.0e-320, s: 1.0 / 1.0e-320 - u, t: 1.0e308 * 10 * u, v: 1.0e-320 * 1.0e-10 * u}
modes: {only: {}}
outputs: [r, s, t, v]
""",
    "names of our own C": """\
parameters:
  piece: {value: 2}
  elapsed: {value: 3, tunable: true}
  page: {value: 4}
  settle: {value: 1}
inputs: {is_old: {unit: "1"}, values: {unit: "1"}}
states: {state: {unit: "1", initial: 0}, equation: {unit: "1", initial: 1}}
equations: {started: is_old * piece * elapsed * page * settle, fired: values, record: values + 1}
modes: {only: {update: {state: state + 1, equation: state}}}
outputs: [started, fired, state, equation, record]
""",
    "an expression of many lines": f"""\
inputs: {{u: {{unit: "1"}}, v: {{unit: "1"}}}}
equations:
  r: "{" - ".join(["(if u > 1 or v < 2 and not (u >= v) then u / 3 else -u * v / 7 / -u)"] * 20)}"
modes: {{only: {{}}}}
outputs: [r]
""",
    "whole numbers in functions": """\
inputs: {j: {type: int, range: [-2147483647, 2147483647]}, u: {unit: "1"}}
discrete:
  k: {type: int, initial: 0, range: [0, 5]}
  top: {type: int, initial: -2147483647, range: [-2147483647, 2147483647]}
  size: {type: int, initial: 0, range: [0, 2147483647]}
  held: {type: int, initial: 0, range: [-3, 7]}
equations: {half: "min(k, 3) / 2", more: "max(min(k, 3), 0.5)", odd: "clip(j, top, -k)", r: u * odd}
initial: a
modes:
  a:
    update: {k: "min(k + 1, 5)", top: "max(j, top)", size: abs(j), held: "clip(j, -3, 7)"}
    transitions: {b: {when: "min(k, held) == 3"}}
  b: {update: {k: "max(0, k - abs(held))"}, transitions: {a: {when: u > 0}}}
outputs: [mode, k, top, size, held, half, more, odd, r]
""",
    "beats and changes": """\
inputs: {u: {unit: "1"}, go: {type: bool}}
discrete: {count: {type: int, initial: 0, range: [0, 9]}}
initial: a
modes:
  a:
    update: {count: "floor(min(abs(u), 3))"}
    transitions:
      b: {when: every(20 ms) and changed(u), priority: 1}
      again: {to: a, when: changed(go) and not every(30 ms), priority: 2}
  b:
    update: {count: count + 1}
    transitions: {a: {when: changed(count) or changed(count > 3 or go)}}
outputs: [count, mode]
""",
    "tables inside a chart": """\
inputs: {u: {unit: "1"}, go: {type: bool}}
events: {trip: {}, press: {from: input}}
micro_steps: 4
discrete: {permit: {type: bool, initial: false}, level: {initial: 0, range: [-9, 9]}}
tables:
  permission:
    if: {big: u > 0.4, go: go}
    rows: {"T T": {permit: true, level: level + 1}, "F -": {}, "T F": {permit: false}}
initial: run
modes:
  run:
    initial: idle
    transition_table:
      columns:
        start: {when: permit, priority: 2}
        pressed: {event: press, priority: 1, raise: trip}
        beat: {when: every(20 ms) or changed(level), priority: 3}
      rows:
        idle: {start: busy, pressed: stay, beat: stay}
        busy: {start: stay, pressed: idle, beat: idle}
    modes: {idle: {entry: {level: -0.0}}, busy: {update: {level: level - 0.5}}}
    transitions: {down: {event: trip, when: not permit}}
  down: {transitions: {run: {when: u < 0, history: shallow}}}
outputs: [level, permit, mode]
""",
    "truth tables": """\
inputs: {u: {unit: "1"}, go: {type: bool}}
discrete:
  level: {initial: -0.0, range: [-1, 400]}
  kind: {type: enum, values: [low, mid], initial: low}
  count: {type: int, initial: 0, range: [-5, 5]}
  fell: {initial: 0}
  rose: {initial: 0}
equations: {r: level * 3 + u}
tables:
  first:
    if: {big: u > 1, go: go, rest: not (u <= 1)}
    rows:
      "T - T": {level: r / u, kind: mid}
      "T T F": {level: u}
      "T F F": {}
      "F T -": {level: -u, count: count + 3}
      else: {kind: low, level: previous(r) - 1.0e-308}
  second: {if: {seen: kind == mid}, rows: {"T": {}, "F": {fell: rose}}}
  third: {if: {any: kind == low}, rows: {"-": {rose: level - r}}}
modes: {a: {transitions: {b: {when: kind == mid}}}, b: {transitions: {a: {when: count > 2}}}}
initial: a
outputs: [level, kind, count, r, fell, rose, mode]
""",
    "deep parentheses": f"""\
inputs: {{u: {{unit: "1"}}}}
equations: {{r: "{"-(" * 60}u{")" * 60} ^ -3"}}
modes: {{only: {{}}}}
outputs: [r]
""",
}


@pytest.mark.parametrize("case", CASES)
def test_is_in_lockstep(case: str, tmp_path: Path) -> None:
    found = verdict(edge(tmp_path, CASES[case]))
    assert found.is_equal, str(found.first)


def test_a_calibration_that_does_not_fit_the_solved_numbers_is_a_fault_in_both() -> None:
    """The stamps of rule 17g: compared by `init`, in C as in the engine."""
    used = program("estimator_simple")
    other = tuple(
        dataclasses.replace(c, value=c.value * 2) if c.name == "solved.stamp_J_em" else c
        for c in used.constants
    )
    stale = dataclasses.replace(used, constants=other)
    bit = 1 << used.faults.index("stale_calibration")
    for tried, wanted in ((used, 0), (stale, bit)):
        tape = record_ticks(tried, [{}])
        assert column(tape, "memory.faults") == [wanted]
        assert compare(tape).is_equal
