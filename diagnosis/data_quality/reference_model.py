"""Reference model: the automaton with which recordings are checked,
simulated under their inputs.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property

from diagnosis.data_quality.output_comparison import (
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
"""Longest major step [s], and the margin to the largest stable step."""


@dataclass(frozen=True)
class ReferenceModel:
    """An automaton with its recording map; `run_programs` executes its Programs."""

    automaton: Automaton
    mapping: RecordingMap
    run_programs: RunFunction = run_interpreter
    _programs: ProgramCache = field(default_factory=dict, repr=False)

    @cached_property
    def coarse_automaton(self) -> Automaton:
        """The automaton with the longest stable step that resolves motion of 4 Hz.

        The step of an automaton without stability limits is unchanged.
        """
        motion = program_of(self.automaton).integration
        limits = [limit.step for limit in motion.stability_limits] if motion else []
        if not limits:
            return self.automaton
        most = min(MAX_STEP, min(limits) / STABILITY_MARGIN)
        step = max(self.automaton.step, Fraction(round(most * 1e6), 10**6))
        return dataclasses.replace(self.automaton, step=step)

    def simulate(self, recording: Recording) -> FreeRun:
        """Return a free run of the coarse automaton; SpecError as in `simulate_free_run`."""
        return simulate_free_run(
            self.coarse_automaton, recording, self.mapping, self.run_programs, self._programs
        )


_cache: list[ReferenceModel] = []


def cached_reference(
    automaton: Automaton, mapping: RecordingMap, run_programs: RunFunction
) -> ReferenceModel:
    """Return the reference model; the latest one is reused for identical arguments."""
    if _cache:
        latest = _cache[0]
        same = latest.automaton is automaton and latest.mapping is mapping
        if same and latest.run_programs is run_programs:
            return latest
    _cache[:] = [ReferenceModel(automaton, mapping, run_programs)]
    return _cache[0]
