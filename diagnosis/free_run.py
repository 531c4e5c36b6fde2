"""Free run: an automaton alone under the recorded inputs, sampled where its outputs were."""

from __future__ import annotations

import dataclasses
from bisect import bisect_left, bisect_right
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from engine.recording import Channel, Recording
from engine.simulate import simulate
from engine.starting import programs_of
from engine.stimulus import stimulus_of
from engine.trajectory import Trajectory
from language.declaration import Formula, Input
from language.experiment import RecordingMap, Scenario, System
from language.model import Automaton
from language.problem import Problems, SpecError
from language.program import Program
from language.signal import Piece, Stimulus
from language.syntax import Name
from language.system import around

Values = NDArray[np.float64]
START = "recorded_start_of_{}"
"""The input at whose value a state starts."""


@dataclass(frozen=True)
class Compared:
    """A recorded output and the simulated one at its stamps [s], in SI, all (n_samples,)."""

    output: str
    times: Values
    measured: Values
    simulated: Values

    @property
    def rms(self) -> float:
        """Root mean square of measured minus simulated."""
        return float(np.sqrt(np.mean((self.measured - self.simulated) ** 2)))

    @property
    def nrmse(self) -> float:
        """`rms` over the standard deviation of what was measured."""
        return self.rms / float(np.std(self.measured))


@dataclass(frozen=True)
class FreeRun:
    """A simulation from `start` [s] of the recording on, and what it is compared with."""

    trajectory: Trajectory
    start: Fraction
    compared: Mapping[str, Compared]


Programs = dict[tuple[tuple[str, ...], ...], Mapping[str, Program]]
"""Programs made for free runs, by the inputs, those of start values as well, and which vary."""


Run = Callable[[System, Scenario, Mapping[str, Program]], Trajectory]
"""What carries out a run of Programs."""


def interpreted(system: System, scenario: Scenario, programs: Mapping[str, Program]) -> Trajectory:
    """Return a run by the interpreter."""
    return simulate(system, scenario, programs=programs)


def free_run(
    automaton: Automaton,
    recording: Recording,
    mapping: RecordingMap,
    run: Run = interpreted,
    made: Programs | None = None,
) -> FreeRun:
    """Simulate from the first measured values of the states on, with nothing fed back.

    The simulation's rows are one major step apart; between them it is taken as linear. Programs
    `made` for other recordings of the same automaton are not made again.
    """
    fed = [c for c in recording.channels.values() if c.column.to in automaton.inputs]
    outputs = [c for c in recording.channels.values() if c.column.compare in automaton.outputs]
    start = max((c.times[0] for c in fed), default=recording.start)
    end = max(c.times[-1] for c in (*fed, *outputs))
    if end <= start:
        problems = Problems()
        label = f"recording `{recording.name}` ends before every input has a value"
        problems.error("range", mapping.span, label)
        raise SpecError(problems.found)
    known = {
        source: _value_at(channel, start)
        for channel in outputs
        if (source := automaton.source_of(channel.column.compare or "")) in automaton.states
    }
    begins = {START.format(name): Stimulus((Piece(Fraction(0), known[name]),)) for name in known}
    scenario = Scenario(
        name=recording.name,
        of=automaton.name,
        horizon=end - start,
        initial={},
        inputs={**_inputs(automaton, fed, mapping, start), **begins},
        every=automaton.step,
        span=mapping.span,
    )
    trajectory = _simulated(_startable(automaton, known), scenario, run, made)
    compared = {
        channel.column.name: _compared(automaton, channel, trajectory, start) for channel in outputs
    }
    return FreeRun(trajectory, start, compared)


def _simulated(
    automaton: Automaton,
    scenario: Scenario,
    run: Run,
    made: Programs | None,
) -> Trajectory:
    """Return what an automaton does, by Programs that were `made` before if there are such."""
    system = around(automaton)
    varying = [name for name, stimulus in scenario.inputs.items() if stimulus.varies]
    kind = (tuple(automaton.inputs), tuple(varying))
    made = {} if made is None else made
    if kind not in made:
        made[kind] = programs_of(system, scenario)
    return run(system, scenario, made[kind])


def _startable(automaton: Automaton, names: Collection[str]) -> Automaton:
    """Return an automaton some states of which start at the value of an input of their own."""
    inputs, states = dict(automaton.inputs), dict(automaton.states)
    for name in names:
        state, own = states[name], START.format(name)
        key = f"states.{name}.initial"
        inputs[own] = Input(own, state.unit, "real", None, None, key, state.span)
        formula = Formula(Name(own, state.span), key)
        states[name] = dataclasses.replace(state, initial=formula)
    return dataclasses.replace(automaton, inputs=inputs, states=states)


def _inputs(
    automaton: Automaton, fed: list[Channel], mapping: RecordingMap, start: Fraction
) -> dict[str, Stimulus]:
    found = {}
    for name, thing in automaton.inputs.items():
        value = thing.default if thing.default is not None else Fraction(0)
        if name in mapping.constants:
            value = mapping.constants[name][0]
        found[name] = Stimulus((Piece(Fraction(0), value),), truth=thing.truth)
    for channel in fed:
        name = channel.column.to or ""
        found[name] = stimulus_of(channel, start, automaton.inputs[name].truth)
    return found


def _value_at(channel: Channel, start: Fraction) -> Fraction:
    return Fraction(channel.values[max(0, bisect_right(channel.times, start) - 1)])


def _compared(
    automaton: Automaton, channel: Channel, trajectory: Trajectory, start: Fraction
) -> Compared:
    output = channel.column.compare or ""
    first = bisect_left(channel.times, start)
    times = channel.seconds[first:] - float(start)
    until = int(np.searchsorted(times, trajectory.times[-1], side="right"))
    signal = trajectory.signals[f"{automaton.name}.{output}"]
    return Compared(
        output,
        times[:until] + float(start),
        np.array(channel.values[first : first + until]),
        np.interp(times[:until], trajectory.times, signal),
    )
