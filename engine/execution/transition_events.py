"""Transition events: the transitions that a step has fired, as events with mode names."""

from __future__ import annotations

from engine.interpreter.interpreter import Stepper
from engine.results.sampled_run import Event
from language.ir.program import LOG_COUNT_VARIABLE, LOG_VARIABLE, Program, TransitionInfo
from language.ir.root_region import CHART


def fired_transitions(program: Program, stepper: Stepper) -> list[TransitionInfo]:
    """Return the transitions of the last micro-step, at most one for each region.

    If the Program logs its micro-steps (`has_log`), the transitions of all micro-steps of the last
    tick are returned in order.
    """
    return [info for _, info in fired_by_micro_step(program, stepper)]


def fired_by_micro_step(program: Program, stepper: Stepper) -> list[tuple[int, TransitionInfo]]:
    """Return the transitions of the last tick with the indices of their micro-steps, in order.

    Indices start at 0. Without a log (`has_log`) there is one micro-step, in the order of the
    regions.
    """
    if not program.has_log:
        numbers = [stepper.get(name) for name in program.fired_variables()]
        return [(0, program.transitions[number - 1]) for number in numbers if number]
    log, fired, micro_step = stepper.get(LOG_VARIABLE), [], 0
    for number in (log[k] for k in range(stepper.get(LOG_COUNT_VARIABLE))):
        if number:
            fired.append((micro_step, program.transitions[number - 1]))
        else:
            micro_step += 1
    return fired


def transition_event(
    name: str, program: Program, info: TransitionInfo, time: float, micro_step: int = 0
) -> Event:
    """Return the event of a transition of the instance `name` at a time [s].

    Source and target are mode names (`endpoint_names`), the region is that of the transition.
    """
    source, target = program.endpoint_names(info)
    return Event(time, micro_step, name, info.name, source, target, info.region)


def mode_names(program: Program, prefix: str = "") -> dict[str, dict[int, str]]:
    """Return the mode names by number of each region; keys are `prefix` and a signal name.

    The signal is `mode` for the chart, for other regions the name with `_` for dots.
    """
    return {
        f"{prefix}{'mode' if region == CHART else region.replace('.', '_')}": {
            mode.number: mode.name for mode in program.modes_of(region)
        }
        for region in program.mode_variables()
    }
