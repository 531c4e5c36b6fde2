"""Coverage measurement: run tests with instrumented Programs to find modes, transitions,
conditions.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass

from engine.execution.transition_events import fired_transitions
from engine.interpreter.interpreter import Interpreter
from engine.simulation.instance_programs import automata_of
from engine.simulation.simulate import simulate
from engine.simulation.stimuli import resolve_recording
from expectation.expectations import Test
from expectation.instrumentation import GUARD_READ_BLOCK, instrument, reached_array
from expectation.mcdc import COVERED, ConditionCoverage, Decision, decision_of
from language.ir.program import Program
from language.ir.root_region import CHART
from language.loading.load import lower_automaton
from language.model.automaton import Automaton
from language.passes.pass_list import run_passes

STRUCTURE_KEYS = ("modes", "regions", "transitions")
"""The words of a key path that are not names."""


@dataclass(frozen=True)
class Coverage:
    """The coverage of one automaton: reached modes and transitions by key path.

    `combinations` holds, for each decision, the observed values of its conditions as bit patterns.
    `unmeasured` are decisions with too many conditions.
    """

    automaton: Automaton
    decisions: tuple[Decision, ...]
    modes: frozenset[str] = frozenset()
    transitions: frozenset[str] = frozenset()
    combinations: Mapping[str, frozenset[int]] = dataclasses.field(default_factory=dict)
    unmeasured: frozenset[str] = frozenset()

    @property
    def name(self) -> str:
        """The name of the automaton."""
        return self.automaton.name

    @property
    def all_modes(self) -> tuple[str, ...]:
        """The key paths of all modes including superstates, innermost modes first."""
        return tuple(mode.key for mode in self.automaton.all_modes if is_mode_key(mode.key))

    def condition_coverage(self, decision: Decision) -> tuple[ConditionCoverage, ...]:
        """Return the MC/DC coverage of each condition of a decision, in their order.

        A decision without observed combinations counts as never evaluated.
        """
        return decision.condition_coverage(self.combinations.get(decision.key, frozenset()))

    def count(self) -> dict[str, tuple[int, int]]:
        """Return (reached, total) of modes, transitions, outcomes and conditions.

        The keys are `modes`, `transitions`, `outcomes` and `conditions`. Outcomes are those of
        guards: a decision has two, without conditions one. A condition is reached if its coverage
        is one of COVERED.
        """
        outcomes = [d.outcomes(self.combinations.get(d.key, frozenset())) for d in self.decisions]
        conditions = [each for d in self.decisions for each in self.condition_coverage(d)]
        return {
            "modes": (len(self.modes), len(self.all_modes)),
            "transitions": (len(self.transitions), len(self.decisions)),
            "outcomes": (sum(map(len, outcomes)), sum(map(_possible_outcomes, self.decisions))),
            "conditions": (sum(each in COVERED for each in conditions), len(conditions)),
        }

    def list_missed(self) -> list[str]:
        """Return one line of text for each mode, transition and condition that is not covered.

        Modes come first, then the decisions in their order. A decision that was never read or is
        not measured has one line for all its conditions.
        """
        lines = [
            f"mode `{'.'.join(names_of(key.removeprefix(f'regions.{CHART}.')))}` was not entered"
            for key in self.all_modes
            if key not in self.modes
        ]
        for decision in self.decisions:
            if decision.key not in self.transitions:
                lines.append(f"`{decision.key}` was not taken")
            lines += self._missed_conditions(decision)
        return lines

    def _missed_conditions(self, decision: Decision) -> list[str]:
        """Return one line for each condition of a decision that is not covered."""
        if decision.key in self.unmeasured:
            return [f"`{decision.key}.when` is not measured: {len(decision.conditions)} conditions"]
        if decision.key not in self.combinations:
            return [f"`{decision.key}.when` was never read"] if decision.conditions else []
        words = {"always true": "was never false", "always false": "was never true"}
        return [
            f"`{decision.key}.when`: `{text}` {words.get(shown, 'was not shown to matter')}"
            for text, shown in zip(
                decision.conditions, self.condition_coverage(decision), strict=True
            )
            if shown not in COVERED
        ]


def measure_coverage(test: Test) -> list[Coverage]:
    """Return the coverage of each instance in a test, in the order of the instances.

    The scenario of the test is simulated once by the interpreter, with instrumented Programs. Modes
    include those that were active within a tick only. Expectations are not evaluated.
    """
    scenario = resolve_recording(test.scenario)
    decisions, programs, arrays = instrument_programs(automata_of(test.system, scenario))
    steppers: list[_CoverageInterpreter] = []

    def build(program: Program) -> _CoverageInterpreter:
        steppers.append(_CoverageInterpreter(program))
        return steppers[-1]

    simulate(test.system, scenario, build, programs=programs)
    made = []
    for name, program in programs.items():
        stepper = next(each for each in steppers if each.program is program)
        automaton = test.system.instances[name].automaton
        seen = {
            key: frozenset(k for k, was in enumerate(stepper.get(array)) if was)
            for key, array in arrays[name].items()
        }
        made.append(
            Coverage(
                automaton,
                decisions[name],
                _entered_modes(automaton, stepper.all_active_modes()),
                frozenset(stepper.fired),
                {key: combinations for key, combinations in seen.items() if combinations},
                frozenset(d.key for d in decisions[name] if d.key not in arrays[name]),
            )
        )
    return made


def _entered_modes(automaton: Automaton, active: Collection[tuple[str, int]]) -> frozenset[str]:
    """Return the key paths of the modes that were active, including enclosing superstates.

    `active` holds pairs of a region and the number of a mode.
    """
    modes = [mode for region in automaton.all_regions for mode in region.modes.values()]
    inner = {mode.key for mode in modes if (mode.region, mode.number) in active}
    outer = (mode.key for mode in automaton.superstates if is_mode_key(mode.key))
    return frozenset(inner.union(o for o in outer if any(i.startswith(f"{o}.") for i in inner)))


def is_mode_key(key: str) -> bool:
    """Tell whether a key path denotes a mode: the part before its last one is `modes`."""
    return key.split(".")[-2:-1] == ["modes"]


def names_of(key: str) -> tuple[str, ...]:
    """Return the names in a key path: `modes.a.transitions.b` gives ("a", "b").

    All parts equal to one of STRUCTURE_KEYS are left out.
    """
    return tuple(part for part in key.split(".") if part not in STRUCTURE_KEYS)


def instrument_programs(
    automata: Mapping[str, tuple[Automaton, list[str]]],
) -> tuple[dict[str, tuple[Decision, ...]], dict[str, Program], dict[str, Mapping[str, str]]]:
    """Return decisions, instrumented Programs and arrays of combinations, each by instance.

    `automata` holds each instance's automaton and the names of its varying parameters. Decisions
    are those of all transitions, mode by mode. The arrays are names of variables by key path of the
    decision; a decision with too many conditions has none.
    """
    decisions, programs, arrays = {}, {}, {}
    for name, (automaton, varying) in automata.items():
        decisions[name] = tuple(map(decision_of, automaton.all_transitions))
        instrumented = instrument(lower_automaton(automaton, varying), decisions[name])
        programs[name], arrays[name] = run_passes(instrumented.program), instrumented.arrays
    return decisions, programs, arrays


def merge_coverages(parts: Iterable[Coverage]) -> list[Coverage]:
    """Return the union of coverages, one for each automaton name, in order of first occurrence.

    Decisions and `unmeasured` are those of the first part with that name.
    """
    merged: dict[str, Coverage] = {}
    for part in parts:
        before = merged.get(part.name)
        merged[part.name] = _merge_two(before, part) if before else part
    return list(merged.values())


def _merge_two(first: Coverage, second: Coverage) -> Coverage:
    """Return the union of two coverages of the same automaton."""
    none: frozenset[int] = frozenset()
    keys = {**first.combinations, **second.combinations}
    return dataclasses.replace(
        first,
        modes=first.modes | second.modes,
        transitions=first.transitions | second.transitions,
        combinations={
            key: first.combinations.get(key, none) | second.combinations.get(key, none)
            for key in keys
        },
    )


class _CoverageInterpreter(Interpreter):
    """Interpreter that evaluates guards at each output instant and records transitions and
    modes.
    """

    def __init__(self, program: Program) -> None:
        super().__init__(program)
        self.fired: set[str] = set()
        self._modes = program.mode_variables()
        self._active = set(self._active_modes())
        self._has_guard_reads = GUARD_READ_BLOCK in program.blocks

    def all_active_modes(self) -> set[tuple[str, int]]:
        """Return (region, mode number) of all modes that were active, also within a tick."""
        arrays = [(region, reached_array(region)) for region in self._modes]
        kept = [(region, self.get(array)) for region, array in arrays if self.has(array)]
        inside = ((region, k) for region, array in kept for k, was in enumerate(array) if was)
        return self._active.union(inside)

    def run(self, block: str) -> None:
        """Run a block, and record fired transitions and active modes after it."""
        if block == "equations" and self._has_guard_reads:
            super().run(GUARD_READ_BLOCK)
        super().run(block)
        if block in ("step", "jump"):
            self.fired |= {
                info.key.partition(" ")[2] for info in fired_transitions(self.program, self)
            }
        if block in ("step", "jump", "equations"):
            self._active.update(self._active_modes())

    def _active_modes(self) -> Iterator[tuple[str, int]]:
        """Yield (region, number of the active mode) for each region."""
        return ((region, self.get(name)) for region, name in self._modes.items())


def _possible_outcomes(decision: Decision) -> int:
    """Return the number of possible outcomes of a decision: 1 without conditions, else 2."""
    return 2 if decision.conditions else 1
