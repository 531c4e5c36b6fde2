"""Reference: the automaton that recordings are checked against, alone under their inputs."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property

from diagnosis.free_run import FreeRun, Programs, Run, free_run, interpreted
from engine.recording import Recording
from language.experiment import RecordingMap
from language.load import program_of
from language.model import Automaton

LONGEST_STEP, STABLE = 0.004, 3.0
"""Longest major step [s], and how far it stays below the largest stable one."""


@dataclass(frozen=True)
class Reference:
    """An automaton with the map of its recordings; `carry_out` runs its Programs."""

    automaton: Automaton
    mapping: RecordingMap
    carry_out: Run = interpreted
    _made: Programs = field(default_factory=dict, repr=False)

    @cached_property
    def coarse(self) -> Automaton:
        """The automaton with as long a major step as is stable and sees motion of 4 Hz."""
        motion = program_of(self.automaton).motion
        limits = [limit.step for limit in motion.limits] if motion else []
        if not limits:
            return self.automaton
        most = min(LONGEST_STEP, min(limits) / STABLE)
        step = max(self.automaton.step, Fraction(round(most * 1e6), 10**6))
        return dataclasses.replace(self.automaton, step=step)

    def run(self, recording: Recording) -> FreeRun:
        """Simulate the coarse automaton under recorded inputs. Raises SpecError."""
        return free_run(self.coarse, recording, self.mapping, self.carry_out, self._made)


_latest: list[Reference] = []


def reference_of(automaton: Automaton, mapping: RecordingMap, carry_out: Run) -> Reference:
    """Return what recordings are checked against: the latest one, with the Programs that it has
    made, where it is asked for again of the same automaton and map.
    """
    if _latest:
        kept = _latest[0]
        same = kept.automaton is automaton and kept.mapping is mapping
        if same and kept.carry_out is carry_out:
            return kept
    _latest[:] = [Reference(automaton, mapping, carry_out)]
    return _latest[0]
