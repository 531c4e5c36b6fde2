"""Check of writers and outputs: one writer for each state, outputs with a value in every mode."""

from __future__ import annotations

from collections.abc import Iterable

from language.model.automaton import Automaton, Mode, Transition
from language.model.region_queries import equation_formulas
from language.text.diagnostic import Problems, suggest_name


def check_writers(automaton: Automaton, mode: Mode, problems: Problems) -> None:
    """Report states of a mode with several writers, and keys of the other kind of automaton.

    Writers are the observer, the run and `update`; observer and run are allowed together only with
    `predict: runs`, which needs a run. A run needs every state of its model in the automaton.
    `flow` belongs to a continuous automaton, `update`, `observer` and `runs` to a sampled one.
    """
    if mode.observer and mode.run and not mode.observer.predicts_by_run:
        label = f"mode `{mode.name}` has both `observer` and `runs`: one carries the states"
        help = "or the run predicts for the observer: `predict: runs`"
        problems.error("writer", mode.span, label, help)
    if mode.observer and mode.observer.predicts_by_run and not mode.run:
        label = "`predict: runs` needs `runs:` in this mode"
        problems.error("observer", mode.observer.span, label)
    wrong = ("flow",) if automaton.is_sampled else ("update", "observer", "run")
    for what in wrong:
        if getattr(mode, what):
            other = "continuous" if automaton.is_sampled else "sampled"
            label = f"`{'runs' if what == 'run' else what}` belongs to a {other} automaton"
            problems.error("form", mode.span, label)
    writers: dict[str, str] = {}
    groups = (
        ("observer", mode.observer.states if mode.observer and not mode.run else ()),
        ("runs", tuple(automaton.model.states) if mode.run and automaton.model else ()),
        ("update", tuple(mode.update)),
    )
    for what, written in groups:
        for name in written:
            if name not in automaton.states and what == "runs":
                label = f"the run needs a state `{name}` here, as its model has"
                assert mode.run
                problems.error("run", mode.run.span, label)
            elif name in writers:
                label = f"`{name}` is written by `{writers[name]}` and by `{what}`"
                problems.error("writer", mode.span, label)
            writers[name] = what


def check_memory_continue(automaton: Automaton, transition: Transition, problems: Problems) -> None:
    """Report `memory: continue` to a mode without wait counters or in a continuous automaton.

    The caller has checked that the transition has this option. An unknown target is not reported.
    """
    modes = automaton.region(transition.region).modes
    target = modes.get(transition.target)
    if not automaton.is_sampled:
        label = "`memory: continue` belongs to a sampled automaton: a continuous wait is an event"
        problems.error("form", transition.span, label)
    elif target and not any(other.wait for other in target.transitions):
        label = f"`memory: continue` keeps wait counters: `{target.name}` has none"
        hint = "states belong to the automaton and keep their values anyway"
        problems.error("form", transition.span, label, hint)


def check_outputs(automaton: Automaton, problems: Problems) -> None:
    """Report outputs with an unknown name and outputs without a value in some mode.

    An output names a state, a discrete variable, an equation, a region, `mode` or, if the automaton
    is sampled, `faults`. An equation must be known in every mode of the chart; there is one problem
    for each mode that lacks it.
    """
    equations = equation_names_of(automaton.all_modes)
    for output, span in automaton.outputs.items():
        name = automaton.output_source(output)
        if name == "mode" or name in automaton.state_variables:
            continue
        if name == "faults" and automaton.is_sampled:
            continue
        if name in (region.name for region in automaton.all_regions):
            continue
        if name not in equations:
            hint = suggest_name(name, [*equations, *automaton.state_variables, "mode"])
            label = f"output `{name}` is not a state, an equation or `mode`"
            problems.error("name", span, label, hint)
            continue
        for mode in automaton.modes.values():
            if name not in equation_formulas(mode):
                label = f"output `{name}` has no value in mode `{mode.name}`"
                problems.error("missing", span, label)


def check_scaling_ranges(automaton: Automaton, problems: Problems) -> None:
    """Report states without a range if a method of integration scales the states by their ranges.

    The methods are `exponential` and `exact`: those of runs, and that of a continuous automaton.
    States of the model are examined, too.
    """
    used = {m.run.method for m in automaton.modes.values() if m.run}
    used |= set() if automaton.is_sampled else {automaton.method}
    scaling = next((name for name in ("exponential", "exact") if name in used), None)
    models = automaton.model.states if automaton.model else {}
    for state in (*automaton.states.values(), *models.values()):
        if scaling and state.range is None:
            label = f"state `{state.name}` needs a `range`: method `{scaling}` scales with it"
            problems.error("missing", state.span, label)


def equation_names_of(modes: Iterable[Mode]) -> list[str]:
    """Return the names of the equations of some modes, each once, in order of appearance.

    Only the own `equations` of each mode count, not those of parallel regions.
    """
    return list(dict.fromkeys(name for mode in modes for name in mode.equations))
