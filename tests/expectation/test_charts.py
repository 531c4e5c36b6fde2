"""Charts: modes inside modes, events and micro-steps, as tests see them; derived by hand.

`go` comes at 50 ms: drive. `hot` at 80 ms: pull, which raises trip: fault, all in one tick. `clear`
at 250 ms: operation, and as `go` holds drive. `go` ends at 400 ms: ready. `ok` ends at 440 ms:
30 ms later fault, where all is over in the same tick.
"""

from __future__ import annotations

from pathlib import Path

from engine.simulation.simulate import simulate
from expectation.coverage_measurement import instrument_programs, measure_coverage
from expectation.evaluate_expectations import evaluate_test
from expectation.expectations import Test
from language.ir.ops import Store
from language.ir.traversal import walk_ops
from modewright.api import spec_tests as tests
from modewright.api.spec_coverage import coverage_diagram
from modewright.diagram.diagram_elements import ModeBox

CHART = """\
language: 1
automaton: supervisor
period: 10 ms
numbers: float64
events: {clear: {from: input}, trip: {}, warn: {}}
inputs: {clear: {type: bool}, go: {type: bool}, ok: {type: bool}, hot: {type: bool}}
initial: operation
modes:
  operation:
    initial: ready
    transitions:
      fault: {when: not ok, wait: 30 ms, priority: 1}
      tripped: {to: fault, event: [trip, warn], when: go, priority: 2}
    modes:
      ready: {transitions: {drive: {when: go}}}
      drive:
        transitions: {ready: {when: not go}}
        regions:
          torque:
            initial: creep
            modes: {creep: {transitions: {pull: {when: go and hot, raise: trip}}}, pull: {}}
          derating:
            initial: cool
            modes:
              cool: {transitions: {warm: {when: hot}}}
              warm: {transitions: {cool: {when: not hot}}}
  fault:
    initial: hurt
    transitions: {operation: {event: clear, when: ok, priority: 1}, over: {to: ended, priority: 2}}
    modes: {hurt: {transitions: {given_up: {when: not ok and not hot}}}, given_up: {final: true}}
  ended: {}
outputs: [mode]
"""
TEST = """\
language: 1
test: supervised
scenario:
  of: supervisor
  horizon: 500 ms
  inputs:
    go: {start: false, steps: {50 ms: true, 400 ms: false}}
    ok: {start: true, steps: {110 ms: false, 200 ms: true, 440 ms: false}}
    hot: {start: false, steps: {80 ms: true, 240 ms: false}}
    clear: {start: false, steps: {250 ms: true, 260 ms: false}}
  record: {every: 15 ms}
expect:
  ready:  {that: mode == operation.ready, at: 40 ms}
  inside: {that: in(operation) and in(operation.drive.torque.creep), at: 50 ms}
  trips:  {event: fault, at: 80 ms}
  pulls:  {event: operation.drive.torque.pull, at: 80 ms}
  direct: {event: operation -> fault, count: 2}
  back:   {event: operation, at: 250 ms}
  drives: {event: operation.drive, count: 2}
  never:  {never: in(operation), from: 80 ms, until: 240 ms}
  super:  {that: mode == operation, at: 300 ms}
  order:
    modes: [operation.ready, operation.drive, fault.hurt, operation.drive, operation.ready, ended]
  inner:
    of: supervisor.operation.drive.torque
    modes: [inactive, creep, inactive, creep, inactive]
"""
WRONG = """\
  order:  {modes: [operation.ready, operation.drive, ended]}
  early:  {event: operation.drive, at: 60 ms}
  twice:  {event: operation.drive.torque.pull, count: 2}
  still:  {always: in(operation)}
"""


def written(folder: Path, text: str = TEST) -> str:
    (folder / "spec").mkdir()
    (folder / "spec" / "supervisor.yaml").write_text(CHART)
    path = folder / "spec" / "test_supervised.yaml"
    path.write_text(text)
    return str(path)


def test_modes_inside_modes_are_expected_on_engine_and_c(tmp_path: Path) -> None:
    (run,) = tests.run_tests([written(tmp_path)], tmp_path)
    assert [(each.name, each.message) for each in run.outcomes if not each.passed] == []
    assert (run.difference, len(run.outcomes)) == ("", 11) and run.backend.startswith("compiled")


def test_what_is_wrong_is_told(tmp_path: Path) -> None:
    path = written(tmp_path, TEST[: TEST.index("expect:\n")] + "expect:\n" + WRONG)
    (run,) = tests.run_tests([path], tmp_path, compiled=False)
    assert [each.message for each in run.outcomes] == [
        "was `fault.hurt` from 0.08 s on, not `ended`",
        "happened at 0.05 s, expected at 0.06 s",
        "happened once, not 2",
        "is false at 0.08 s",
    ]
    assert run.outcomes[3].modes["supervisor"] == "fault.hurt"


def test_coverage_knows_superstates_events_and_completion(tmp_path: Path) -> None:
    test = tests.load_test(written(tmp_path), tmp_path)
    (found,) = measure_coverage(test)
    assert found.count()["modes"] == (11, 11)  # some are left in the tick of their entry
    assert found.count()["transitions"] == (9, 10)
    tripped = next(d for d in found.decisions if d.key.endswith("tripped"))
    assert tripped.conditions == ("event trip", "event warn", "go")
    assert found.condition_coverage(tripped) == ("unique cause", "always false", "not shown")
    over = next(d for d in found.decisions if d.key.endswith("over"))
    assert (over.conditions, found.condition_coverage(over)) == (("completion",), ("unique cause",))
    (chart,) = coverage_diagram(found, tmp_path).regions
    boxes = {box.name: box for box in chart.modes}
    assert boxes["operation"].shade == "covered" and isinstance(boxes["ended"], ModeBox)


def test_each_guard_of_a_chart_has_a_probe(tmp_path: Path) -> None:
    automaton = (
        tests.load_test(written(tmp_path), tmp_path).system.instances["supervisor"].automaton
    )
    decisions, programs, arrays = instrument_programs({"one": (automaton, [])})
    ops = [op for block in programs["one"].blocks.values() for op in walk_ops(block)]
    stored = {op.array for op in ops if isinstance(op, Store) and op.array.startswith("probe.")}
    assert stored == set(arrays["one"].values()) and len(stored) == len(decisions["one"]) == 10


BRIEF = """\
language: 1
automaton: brief
period: 10 ms
numbers: float64
micro_steps: 5
events: {beat: {from: input}, passed: {}}
discrete: {beats: {type: int, range: [0, 9], initial: 0}}
initial: idle
modes:
  idle: {transitions: {start: {to: op.left.first, when: "true"}}}
  op:
    regions:
      left:
        initial: none
        modes:
          none: {}
          first: {transitions: {last: {when: "true", raise: passed}}}
          last: {transitions: {count: {to: [], event: beat, reset: {beats: beats + 1}}}}
      right:
        initial: waits
        modes: {waits: {transitions: {goes: {event: passed}}}, goes: {}}
outputs: [mode, beats]
"""
BRIEF_TEST = """\
language: 1
test: briefly
scenario:
  of: brief
  horizon: 100 ms
  inputs: {beat: {start: false, steps: {50 ms: true, 80 ms: false}}}
expect:
  beats:   {that: beats == 3, at: end}
"""


def briefly(folder: Path, more: str = "", spec: str = BRIEF) -> Test:
    (folder / "spec").mkdir()
    (folder / "spec" / "brief.yaml").write_text(spec)
    path = folder / "spec" / "test_briefly.yaml"
    path.write_text(BRIEF_TEST + more)
    return tests.load_test(str(path), folder)


def test_a_mode_left_in_the_tick_of_its_entry_was_entered(tmp_path: Path) -> None:
    """`waits` is the default of a neighbouring region; `idle` is left at tick 0."""
    (found,) = measure_coverage(briefly(tmp_path))
    assert found.list_missed() == ["mode `op.left.none` was not entered"]


def test_a_transition_to_nothing_enters_nothing(tmp_path: Path) -> None:
    """`count` fires at 50, 60 and 70 ms in `last`, which was entered at 0."""
    more = """\
  entered: {event: op.left.last, count: 1}
  anew:    {event: op.left.last -> op.left.last, count: 0}
"""
    run = tests.run_test(briefly(tmp_path, more))
    assert [(each.name, each.message) for each in run.outcomes if not each.passed] == []
    assert (run.difference, len(run.outcomes)) == ("", 3)
    events = simulate(run.test.system, run.test.scenario).events[-3:]
    assert [(each.source, each.target) for each in events] == [("op.left.last", "")] * 3


def test_a_transition_with_several_targets_enters_each_of_them(tmp_path: Path) -> None:
    """`first` and `waits` are left in the tick of their entry, at 0."""
    more = """\
  one:   {event: op.left.first, at: 0 s}
  other: {event: op.right.waits, count: 1}
"""
    test = briefly(
        tmp_path, more, BRIEF.replace("op.left.first,", "[op.left.first, op.right.waits],")
    )
    assert [each.message for each in evaluate_test(test, simulate(test.system, test.scenario))] == [
        ""
    ] * 3
