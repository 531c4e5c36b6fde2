"""Check of rewinds: depth, flow of the source, condition `until` and run of the target."""

from __future__ import annotations

import math
from collections.abc import Mapping
from fractions import Fraction

from language.expressions.syntax_tree import MEMORY_FUNCTIONS, FunctionCall, SyntaxTree, walk
from language.lowering.constants import evaluate_exactly
from language.lowering.delay_buffers import MAX_REWIND
from language.model.automaton import Automaton, Mode, ModelRun, Rewind, Transition
from language.model.declaration import Formula
from language.model.region_queries import equation_closure, equation_formulas
from language.text.diagnostic import Problems


def check_rewind(automaton: Automaton, transition: Transition, problems: Problems) -> None:
    """Report why a transition cannot rewind; a transition without `rewind` has no problem.

    The automaton must be sampled, without parallel regions in it or its model. `until` must read a
    state or input and no function with memory. The source may have a run with one substep that
    cannot leave its flow, or an observer that takes its matrices from the model (`of`). The target
    must run the model with one substep. Neither may update a state of the model.
    """
    rewind = transition.rewind
    if rewind is None:
        return
    if not automaton.is_sampled:
        label = "`rewind` belongs to a sampled automaton: a continuous one locates its crossings"
        problems.error("form", rewind.span, label)
        return
    _check_no_regions(automaton, rewind, problems)
    region = automaton.region(transition.region)
    source, target = region.modes[transition.source], region.modes.get(transition.target)
    _check_until_varies(automaton, source, rewind, problems)
    _check_until_memory(source, rewind, problems)
    _check_source_flow(automaton, source, rewind, problems)
    if target is not None:
        _check_target_run(automaton, target, rewind, problems)


def check_rewind_depth(automaton: Automaton, problems: Problems) -> None:
    """Report rewinds whose `within` is not positive or longer than MAX_REWIND ticks (rounded up).

    Rewinds of a continuous automaton are skipped.
    """
    for mode in automaton.all_modes:
        for transition in mode.transitions:
            if transition.rewind and automaton.period is not None:
                with problems.collect_errors():
                    _check_depth(automaton, automaton.period, transition.rewind.within, problems)


def _check_depth(
    automaton: Automaton, period: Fraction, within: Formula, problems: Problems
) -> None:
    """Report a `within` that is not positive or longer than `MAX_REWIND` ticks."""
    time = evaluate_exactly(within, automaton)
    ticks = math.ceil(time / period)
    if time <= 0:
        problems.error("rewind", within.span, "`within` is above zero")
    elif ticks > MAX_REWIND:
        label = f"a rewind of {ticks} ticks: at most {MAX_REWIND} are kept"
        problems.error("rewind", within.span, label, "a smaller `within`")


def _check_no_regions(automaton: Automaton, rewind: Rewind, problems: Problems) -> None:
    """Report parallel regions of the automaton or its model.

    Their actions since the crossing cannot be rolled back.
    """
    for thing in (automaton, automaton.model):
        if thing and thing.regions:
            label = f"`{thing.name}` has parallel regions: what they did meanwhile stays done"
            problems.error("rewind", rewind.span, label, "a `wait` in place of `rewind`")


def _check_until_varies(
    automaton: Automaton, source: Mode, rewind: Rewind, problems: Problems
) -> None:
    """Report an `until` that reads parameters only, because it never becomes true."""
    read = {*rewind.until.reads, *equation_closure(source, rewind.until.reads)}
    if read <= set(automaton.parameters):
        label = "`until` never changes: it reads neither states nor inputs"
        problems.error("rewind", rewind.until.span, label)


def _check_until_memory(source: Mode, rewind: Rewind, problems: Problems) -> None:
    """Report a function with memory in `until`, directly or in the equations that it reads.

    `until` is evaluated on earlier ticks, for which the state of such functions is not stored.
    """
    trees: Mapping[str, tuple[SyntaxTree, ...]] = {
        name: tuple(formula.tree for formula in formulas)
        for name, formulas in equation_formulas(source).items()
    }
    read = [tree for name in equation_closure(source, rewind.until.reads) for tree in trees[name]]
    for tree in (rewind.until.tree, *read):
        for part in walk(tree):
            if isinstance(part, FunctionCall) and part.function in MEMORY_FUNCTIONS:
                label = f"`until` reads `{part.function}`: it is asked of states and inputs alone"
                problems.error("rewind", part.span, label)
                return


def _check_source_flow(
    automaton: Automaton, source: Mode, rewind: Rewind, problems: Problems
) -> None:
    """Report a source whose states cannot be followed backwards within a tick.

    Such sources are runs with several substeps or that may leave their flow, observers with written
    matrices, and updates of states of the model.
    """
    if source.run:
        _check_one_substep(source, rewind, problems)
        model = automaton.model
        own = model.modes.get(source.run.mode) if model else None
        if own and own.transitions and source.run.follow:
            label = f"the run of `{source.name}` may leave its flow: the way back would be another"
            hint = f"write `follow: false` in `runs` of `{source.name}`"
            problems.error("rewind", rewind.span, label, hint)
    elif source.observer and source.observer.of is None:
        label = f"the observer of `{source.name}` has written matrices: no flow leads back"
        hint = "`of: <model>.<mode>` takes them from a flow"
        problems.error("rewind", rewind.span, label, hint)
    _check_no_update(automaton, source, rewind, problems)


def _check_target_run(
    automaton: Automaton, target: Mode, rewind: Rewind, problems: Problems
) -> None:
    """Report a target without a run, with several substeps, or with updates of model states."""
    if target.run is None:
        label = f"mode `{target.name}` has no `runs`: nothing carries the states on from there"
        problems.error("rewind", rewind.span, label, "a `wait` in place of `rewind`")
        return
    _check_one_substep(target, rewind, problems)
    _check_no_update(automaton, target, rewind, problems)


def _check_one_substep(mode: Mode, rewind: Rewind, problems: Problems) -> None:
    """Report a run with more than one substep."""
    run: ModelRun | None = mode.run
    if run and run.substeps != 1:
        label = (
            f"the run of `{mode.name}` has {run.substeps} substeps: a rewind takes whole periods"
        )
        problems.error("rewind", rewind.span, label, "`substeps: 1` with a shorter `period`")


def _check_no_update(automaton: Automaton, mode: Mode, rewind: Rewind, problems: Problems) -> None:
    """Report an `update` that writes a state of the model, because it is not rolled back."""
    written = [name for name in mode.update if automaton.model and name in automaton.model.states]
    if written:
        label = f"`update` of mode `{mode.name}` writes `{written[0]}`: it is not taken back"
        problems.error("rewind", rewind.span, label, "let the run move it")
