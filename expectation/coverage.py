"""Coverage: which modes, transitions and conditions of specs tests have reached."""

from __future__ import annotations

import dataclasses
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass

from engine.firing import fired
from engine.interpreter import Interpreter
from engine.simulate import simulate
from engine.starting import automata_of
from engine.stimulus import resolved
from expectation.decision import SHOWN, Decision, Shown, decision_of
from expectation.expected import Test
from expectation.probe import LOOK, probed, reached_array
from language.hoist import hoisted
from language.load import lowered
from language.model import CHART, Automaton
from language.program import Program

STRUCTURE = ("modes", "regions", "transitions")
"""Words of a key path that are no names."""


@dataclass(frozen=True)
class Coverage:
    """What has been reached of an automaton: modes and transitions by key path, combinations."""

    automaton: Automaton
    decisions: tuple[Decision, ...]
    modes: frozenset[str] = frozenset()
    transitions: frozenset[str] = frozenset()
    seen: Mapping[str, frozenset[int]] = dataclasses.field(default_factory=dict)
    unmeasured: frozenset[str] = frozenset()

    @property
    def name(self) -> str:
        """The name of the automaton."""
        return self.automaton.name

    @property
    def all_modes(self) -> tuple[str, ...]:
        """All modes by key path, innermost ones first; superstates too."""
        return tuple(mode.key for mode in self.automaton.all_modes if is_mode(mode.key))

    def shown(self, decision: Decision) -> tuple[Shown, ...]:
        """Return of each condition of a guard whether it was shown to matter."""
        return decision.shown(self.seen.get(decision.key, frozenset()))

    def count(self) -> dict[str, tuple[int, int]]:
        """Return how many modes, transitions, outcomes of guards and conditions were reached."""
        outcomes = [d.outcomes(self.seen.get(d.key, frozenset())) for d in self.decisions]
        conditions = [each for d in self.decisions for each in self.shown(d)]
        return {
            "modes": (len(self.modes), len(self.all_modes)),
            "transitions": (len(self.transitions), len(self.decisions)),
            "outcomes": (sum(map(len, outcomes)), sum(map(_possible, self.decisions))),
            "conditions": (sum(each in SHOWN for each in conditions), len(conditions)),
        }

    def missed(self) -> list[str]:
        """Return what was not reached, one line each."""
        lines = [
            f"mode `{'.'.join(names_of(key.removeprefix(f'regions.{CHART}.')))}` was not entered"
            for key in self.all_modes
            if key not in self.modes
        ]
        for decision in self.decisions:
            if decision.key not in self.transitions:
                lines.append(f"`{decision.key}` was not taken")
            lines += self._conditions(decision)
        return lines

    def _conditions(self, decision: Decision) -> list[str]:
        if decision.key in self.unmeasured:
            return [f"`{decision.key}.when` is not measured: {len(decision.conditions)} conditions"]
        if decision.key not in self.seen:
            return [f"`{decision.key}.when` was never read"] if decision.conditions else []
        words = {"always true": "was never false", "always false": "was never true"}
        return [
            f"`{decision.key}.when`: `{text}` {words.get(shown, 'was not shown to matter')}"
            for text, shown in zip(decision.conditions, self.shown(decision), strict=True)
            if shown not in SHOWN
        ]


def coverage(test: Test) -> list[Coverage]:
    """Return what a test reaches of each automaton: a run of the interpreter with probes."""
    scenario = resolved(test.system, test.scenario)
    decisions, programs, arrays = probed_programs(automata_of(test.system, scenario))
    steppers: dict[int, _Looking] = {}

    def build(program: Program) -> _Looking:
        return steppers.setdefault(id(program), _Looking(program))

    simulate(test.system, scenario, build, programs=programs)
    made = []
    for name, program in programs.items():
        stepper, automaton = steppers[id(program)], test.system.instances[name].automaton
        seen = {
            key: frozenset(k for k, was in enumerate(stepper.get(array)) if was)
            for key, array in arrays[name].items()
        }
        made.append(
            Coverage(
                automaton,
                decisions[name],
                _entered(automaton, stepper.all_active()),
                frozenset(stepper.taken),
                {key: combinations for key, combinations in seen.items() if combinations},
                frozenset(d.key for d in decisions[name] if d.key not in arrays[name]),
            )
        )
    return made


def _entered(automaton: Automaton, active: Collection[tuple[str, int]]) -> frozenset[str]:
    """Return the key paths of the modes that were active, and of all that hold them.

    `active` are regions with numbers of modes.
    """
    modes = [mode for region in automaton.all_regions for mode in region.modes.values()]
    inner = {mode.key for mode in modes if (mode.region, mode.number) in active}
    outer = (mode.key for mode in automaton.superstates if is_mode(mode.key))
    return frozenset(inner.union(o for o in outer if any(i.startswith(f"{o}.") for i in inner)))


def is_mode(key: str) -> bool:
    """Tell whether a key path is that of a mode, and not of a region."""
    return key.split(".")[-2:-1] == ["modes"]


def names_of(key: str) -> tuple[str, ...]:
    """Return the names of a key path: `modes.a.transitions.b` is (a, b)."""
    return tuple(part for part in key.split(".") if part not in STRUCTURE)


def probed_programs(
    automata: Mapping[str, tuple[Automaton, list[str]]],
) -> tuple[dict[str, tuple[Decision, ...]], dict[str, Program], dict[str, Mapping[str, str]]]:
    """Return the decisions of instances, their Programs with probes, and where these write."""
    decisions, programs, arrays = {}, {}, {}
    for name, (automaton, varying) in automata.items():
        ways = [way for mode in automaton.all_modes for way in mode.transitions]
        decisions[name] = tuple(decision_of(way) for way in ways)
        made = probed(lowered(automaton, varying), decisions[name])
        programs[name], arrays[name] = hoisted(made.program), made.arrays
    return decisions, programs, arrays


def together(parts: Iterable[Coverage]) -> list[Coverage]:
    """Return what several tests and instances have reached, one for each automaton by name."""
    found: dict[str, Coverage] = {}
    for part in parts:
        before = found.get(part.name)
        found[part.name] = _joined(before, part) if before else part
    return list(found.values())


def _joined(one: Coverage, other: Coverage) -> Coverage:
    none: frozenset[int] = frozenset()
    keys = {**one.seen, **other.seen}
    return dataclasses.replace(
        one,
        modes=one.modes | other.modes,
        transitions=one.transitions | other.transitions,
        seen={key: one.seen.get(key, none) | other.seen.get(key, none) for key in keys},
    )


class _Looking(Interpreter):
    """An interpreter that reads guards wherever outputs are read, and notes what fires."""

    def __init__(self, program: Program) -> None:
        super().__init__(program)
        self.taken: set[str] = set()
        self._modes = program.mode_variables()
        self._active = set(self._now())
        self._looks = LOOK in program.blocks

    def all_active(self) -> set[tuple[str, int]]:
        """Return the regions with the numbers of the modes that were active, however shortly."""
        arrays = [(region, reached_array(region)) for region in self._modes]
        kept = [(region, self.get(array)) for region, array in arrays if self.has(array)]
        inside = ((region, k) for region, array in kept for k, was in enumerate(array) if was)
        return self._active.union(inside)

    def run(self, block: str) -> None:
        if block == "equations" and self._looks:
            super().run(LOOK)
        super().run(block)
        if block in ("step", "jump"):
            self.taken |= {info.key.partition(" ")[2] for info in fired(self.program, self)}
        if block in ("step", "jump", "equations"):
            self._active.update(self._now())

    def _now(self) -> Iterator[tuple[str, int]]:
        return ((region, self.get(name)) for region, name in self._modes.items())


def _possible(decision: Decision) -> int:
    return 2 if decision.conditions else 1
