"""Free run: a simulation of an automaton under recorded inputs, compared with recorded outputs."""

from __future__ import annotations

import dataclasses
from bisect import bisect_left, bisect_right
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property

import numpy as np

from diagnosis.data.array_types import Reals
from engine.recordings.recording import Channel, Recording
from engine.results.trajectory import Trajectory
from engine.simulation.instance_programs import programs_of
from engine.simulation.simulate import simulate
from engine.simulation.stimuli import stimulus_of
from language.expressions.syntax_tree import Name
from language.ir.program import Program
from language.loading.load import program_of
from language.loading.system_reader import single_instance_system
from language.model.automaton import Automaton
from language.model.declaration import Formula, Input
from language.model.system import RecordingMap, Scenario, Stimulus, StimulusPiece, System
from language.text.diagnostic import Problem, SpecError

INITIAL_INPUT_NAME = "recorded_start_of_{}"
"""Name of the input that gives the initial value of a state."""


@dataclass(frozen=True)
class OutputComparison:
    """A recorded output and the simulated one at its time stamps [s], in SI, (samples,) each."""

    times: Reals
    measured: Reals
    simulated: Reals


@dataclass(frozen=True)
class FreeRun:
    """A simulation under the inputs of a recording, and its comparison by column name."""

    trajectory: Trajectory
    comparisons: Mapping[str, OutputComparison]


ProgramCache = dict[tuple[tuple[str, ...], ...], Mapping[str, Program]]
"""Programs of free runs, by the names of the inputs and the names of those that vary."""


RunFunction = Callable[[System, Scenario, Mapping[str, Program]], Trajectory]
"""A function that executes Programs under a scenario."""


def run_interpreter(
    system: System, scenario: Scenario, programs: Mapping[str, Program]
) -> Trajectory:
    """Return the trajectory of Programs under a scenario, run by the interpreter."""
    return simulate(system, scenario, programs=programs)


def simulate_free_run(
    automaton: Automaton,
    recording: Recording,
    mapping: RecordingMap,
    run_program: RunFunction = run_interpreter,
    programs: ProgramCache | None = None,
) -> FreeRun:
    """Return a simulation under recorded inputs from the first measured states, without feedback.

    It begins when every recorded input has a value. An input without a channel has the constant of
    the map, else its default, else 0. `programs` is a cache for other recordings of the same
    automaton. Raises SpecError if the recording ends before every input has a value.
    """
    input_channels = [c for c in recording.channels.values() if c.column.to in automaton.inputs]
    outputs = [c for c in recording.channels.values() if c.column.compare in automaton.outputs]
    start = max((c.times[0] for c in input_channels), default=recording.start)
    end = max(c.times[-1] for c in (*input_channels, *outputs))
    if end <= start:
        label = f"recording `{recording.name}` ends before every input has a value"
        raise SpecError([Problem("range", recording.place or mapping.span, label)])
    initial_values = {  # the latest value at the start, else the first one
        source: Fraction(channel.values[max(0, bisect_right(channel.times, start) - 1)])
        for channel in outputs
        if (source := automaton.output_source(channel.column.compare or "")) in automaton.states
    }
    initial_inputs = {
        INITIAL_INPUT_NAME.format(name): Stimulus((StimulusPiece(Fraction(0), value),))
        for name, value in initial_values.items()
    }
    scenario = Scenario(
        name=recording.name,
        of=automaton.name,
        horizon=end - start,
        initial={},
        inputs={**_recorded_inputs(automaton, input_channels, mapping, start), **initial_inputs},
        every=automaton.step,
        span=mapping.span,
    )
    system = single_instance_system(_with_initial_state_inputs(automaton, initial_values))
    varying = [name for name, stimulus in scenario.inputs.items() if stimulus.varies]
    kind = (tuple(scenario.inputs), tuple(varying))
    programs = {} if programs is None else programs
    if kind not in programs:
        programs[kind] = programs_of(system, scenario)
    trajectory = run_program(system, scenario, programs[kind])
    compared = {
        channel.column.name: _compare_output(automaton, channel, trajectory, start)
        for channel in outputs
    }
    return FreeRun(trajectory, compared)


def _with_initial_state_inputs(automaton: Automaton, names: Collection[str]) -> Automaton:
    """Return an automaton in which the named states start at the value of an additional input."""
    inputs, states = dict(automaton.inputs), dict(automaton.states)
    for name in names:
        state, own = states[name], INITIAL_INPUT_NAME.format(name)
        key = f"states.{name}.initial"
        inputs[own] = Input(own, state.unit, "real", None, None, key, state.span)
        formula = Formula(Name(own, state.span), key)
        states[name] = dataclasses.replace(state, initial=formula)
    return dataclasses.replace(automaton, inputs=inputs, states=states)


def _recorded_inputs(
    automaton: Automaton, input_channels: list[Channel], mapping: RecordingMap, start: Fraction
) -> dict[str, Stimulus]:
    """Return the stimulus of each input: recorded, constant of the map, default, or 0."""
    found = {}
    for name, thing in automaton.inputs.items():
        value = thing.default if thing.default is not None else Fraction(0)
        if name in mapping.constants:
            value = mapping.constants[name][0]
        found[name] = Stimulus((StimulusPiece(Fraction(0), value),), is_bool=thing.is_bool)
    for channel in input_channels:
        name = channel.column.to or ""
        found[name] = stimulus_of(channel, start, automaton.inputs[name].is_bool)
    return found


def _compare_output(
    automaton: Automaton, channel: Channel, trajectory: Trajectory, start: Fraction
) -> OutputComparison:
    """Return a recorded output with the simulated one from `start` to the end of the trajectory."""
    output = channel.column.compare or ""
    first = bisect_left(channel.times, start)
    times = channel.seconds[first:] - float(start)
    until = int(np.searchsorted(times, trajectory.times[-1], side="right"))
    signal = trajectory.signals[f"{automaton.name}.{output}"]
    return OutputComparison(
        times[:until] + float(start),
        np.array(channel.values[first : first + until]),
        np.interp(times[:until], trajectory.times, signal),
    )


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
