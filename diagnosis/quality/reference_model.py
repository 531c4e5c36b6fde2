"""Reference: the automaton that recordings are checked against, alone under their inputs."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property

from diagnosis.quality.free_run import (
    FreeRun,
    ProgramCache,
    RunFunction,
    run_interpreter,
    simulate_free_run,
)
from engine.recordings.recording import Recording
from language.loading.load import program_of
from language.model.automaton import Automaton
from language.model.system import RecordingMap

MAX_STEP, STABILITY_MARGIN = 0.004, 3.0
"""Longest major step [s], and how far it stays below the largest stable one."""


@dataclass(frozen=True)
class ReferenceModel:
    """An automaton with the map of its recordings; `carry_out` runs its Programs."""

    automaton: Automaton
    mapping: RecordingMap
    run_programs: RunFunction = run_interpreter
    _programs: ProgramCache = field(default_factory=dict, repr=False)

    @cached_property
    def coarse_automaton(self) -> Automaton:
        """The automaton with as long a major step as is stable and sees motion of 4 Hz."""
        motion = program_of(self.automaton).integration
        limits = [limit.step for limit in motion.stability_limits] if motion else []
        if not limits:
            return self.automaton
        most = min(MAX_STEP, min(limits) / STABILITY_MARGIN)
        step = max(self.automaton.step, Fraction(round(most * 1e6), 10**6))
        return dataclasses.replace(self.automaton, step=step)

    def simulate(self, recording: Recording) -> FreeRun:
        """Simulate the coarse automaton under recorded inputs. Raises SpecError."""
        return simulate_free_run(
            self.coarse_automaton, recording, self.mapping, self.run_programs, self._programs
        )


_cache: list[ReferenceModel] = []


def cached_reference(
    automaton: Automaton, mapping: RecordingMap, run_programs: RunFunction
) -> ReferenceModel:
    """Return what recordings are checked against: the latest one, with the Programs that it has
    made, where it is asked for again of the same automaton and map.
    """
    if _cache:
        kept = _cache[0]
        same = kept.automaton is automaton and kept.mapping is mapping
        if same and kept.run_programs is run_programs:
            return kept
    _cache[:] = [ReferenceModel(automaton, mapping, run_programs)]
    return _cache[0]
