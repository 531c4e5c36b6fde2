"""Transition data for engine and C: number, names, wait, timer and events of each transition."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from itertools import accumulate

from language.ir.analysis_cache import cache_on_owner
from language.ir.ops import (
    Assign,
    Expr,
    Op,
    Ref,
    RunBlock,
    integer,
)
from language.ir.program import TransitionInfo
from language.lowering.constants import wait_seconds
from language.lowering.event_tolerance import is_instantaneous
from language.lowering.guard_variable_names import guard_slot
from language.lowering.tick_history import rollbacks_of
from language.lowering.wait_ticks import (
    MAX_WAIT_TICKS,
    seconds_to_ticks,
    tunable_wait,
    wait_range_in_ticks,
)
from language.model.automaton import Automaton, Mode, Transition
from language.text.diagnostic import Problems


def transition_infos(automaton: Automaton, problems: Problems) -> tuple[TransitionInfo, ...]:
    """Return the data of all transitions, numbered from 1 in the order of the file.

    A timer `timer.<mode>_<transition>` is given if the wait has at least one tick or is tunable; in
    a continuous automaton, if it is longer than the tolerance of rule 10. A wait that is negative,
    longer than MAX_WAIT_TICKS or not constant is reported.
    """
    found: list[TransitionInfo] = []
    back = {rollback.transition.key: rollback.max_ticks for rollback in rollbacks_of(automaton)}
    for mode in automaton.all_modes:
        for k, transition in enumerate(mode.transitions):
            wait = Fraction(0)
            with problems.collect_errors():
                wait = wait_seconds(transition, automaton)
            ticks = seconds_to_ticks(automaton, wait) if automaton.period else 0
            tunable = tunable_wait(automaton, transition.wait)
            if transition.wait and wait < 0:
                problems.error("wait", transition.wait.span, "a wait is not negative")
            if transition.wait and ticks > MAX_WAIT_TICKS:
                label = f"a wait of {ticks} ticks is longer than {MAX_WAIT_TICKS}"
                problems.error("wait", transition.wait.span, label)
            is_timed = not is_instantaneous(automaton, wait)
            if automaton.period:
                is_timed = ticks > 0 or tunable is not None
            target = 0 if automaton.statechart else automaton.target_mode(transition).number
            found.append(
                TransitionInfo(
                    number=len(found) + 1,
                    name=transition.name,
                    source=mode.number,
                    target=target,
                    wait=wait,
                    ticks=ticks,
                    timer=f"timer.{mode.label}_{transition.name}" if is_timed else None,
                    key=f"{automaton.name} {transition.key}",
                    region=mode.region,
                    slot=guard_slot(mode.region, k),
                    rewind_ticks=back.get(transition.key, 0),
                    chart_endpoints=_chart_endpoints(automaton, transition),
                    tunable_wait=f"calibration.{tunable}" if tunable else None,
                    max_ticks=_max_ticks(automaton, tunable) if tunable else 0,
                )
            )
    return tuple(found)


def _max_ticks(automaton: Automaton, tunable: str) -> int:
    """Return the end of the range of a tunable wait in ticks."""
    return int(wait_range_in_ticks(automaton, automaton.parameters[tunable])[1])


def wait_ticks(info: TransitionInfo) -> Expr:
    """Return the ticks of a wait: a literal, or the calibration parameter of a tunable wait."""
    return Ref(info.tunable_wait, is_integer=True) if info.tunable_wait else integer(info.ticks)


def _chart_endpoints(automaton: Automaton, transition: Transition) -> tuple[str, str] | None:
    """Return the paths of source and targets in a chart with nested modes; None without one.

    Several targets are separated by commas; an internal transition has an empty target.
    """
    if automaton.statechart is None:
        return None
    chart_transition, nodes = (
        automaton.statechart.transitions[transition.key],
        automaton.statechart.nodes,
    )
    source = nodes[chart_transition.source].path
    return source, ", ".join(nodes[target].path for target in chart_transition.targets)


def infos_of_mode(
    automaton: Automaton, mode: Mode, infos: tuple[TransitionInfo, ...]
) -> tuple[TransitionInfo, ...]:
    """Return those of `infos` whose transitions leave a mode, in the order of the file.

    `infos` are the data of all transitions of the automaton.
    """
    first = _first_index_by_mode(automaton)[mode.key]
    return infos[first : first + len(mode.transitions)]


@cache_on_owner
def _first_index_by_mode(automaton: Automaton) -> Mapping[str, int]:
    """Return the number of transitions that leave earlier modes, by the key path of a mode."""
    modes = automaton.all_modes
    counts = accumulate((len(mode.transitions) for mode in modes), initial=0)
    return dict(zip((mode.key for mode in modes), counts, strict=False))


def start_run(automaton: Automaton, target: Mode) -> list[Op]:
    """Return the operations on entry of a mode that start its run and its observer's covariance.

    They run `entry_covariance_<mode>` for a recursive observer with `covariance: steady`, and set
    `memory.run_mode` to the mode of the run. The list is empty for a mode with neither.
    """
    ops: list[Op] = []
    observer = target.observer
    if observer and observer.gain == "recursive" and observer.covariance == "steady":
        ops.append(RunBlock(f"entry_covariance_{target.name}"))
    if target.run is None or automaton.model is None:
        return ops
    number = automaton.model.modes[target.run.mode].number
    ops.append(Assign("memory.run_mode", integer(number), f"{automaton.name} {target.run.key}"))
    return ops
