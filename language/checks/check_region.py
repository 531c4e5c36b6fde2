"""Check of parallel regions: complete equations and flows, disjoint writers (rule 14)."""

from __future__ import annotations

from collections.abc import Iterator

from language.model.automaton import Automaton, Mode, Region
from language.model.region_queries import region_equations
from language.text.diagnostic import Problems, Span


def check_regions(automaton: Automaton, problems: Problems) -> None:
    """Report modes of equal label, incomplete modes of parallel regions, and shared writes.

    A mode of a parallel region needs each equation and balance that another mode of its region has,
    and has no observer or run. No two regions may define, balance or assign one name (rule 14);
    assignments in a chart are left to `check_chart`.
    """
    labels: dict[str, Span] = {}
    for mode in automaton.all_modes:
        if mode.label in labels:
            hint = f"it is given first at {labels[mode.label]}"
            problems.error("duplicate", mode.span, f"two modes are called `{mode.label}`", hint)
        labels.setdefault(mode.label, mode.span)
    for region in automaton.regions:
        for mode in region.modes.values():
            _check_mode(region, mode, problems)
    _check_writers(automaton, problems)


def _check_mode(region: Region, mode: Mode, problems: Problems) -> None:
    """Report an observer or run of a parallel mode, and missing equations and balances.

    A mode needs every equation and balance that another mode of its region has.
    """
    if region.inactive is not None and mode.equations:
        return  # check_chart.py reports these equations
    for what, thing in (("observer", mode.observer), ("runs", mode.run)):
        if thing is not None:
            label = f"`{what}` belongs to a mode of the chart, not to one of region `{region.name}`"
            problems.error("form", thing.span, label)
    for name in region_equations(region):
        if name not in mode.equations:
            label = f"`{name}` has no equation in mode `{mode.name}` of region `{region.name}`"
            hint = "an equation stands at the root or in every mode of one region"
            problems.error("missing", mode.span, label, hint)
    flows = dict.fromkeys(name for other in region.modes.values() for name in other.flow)
    for name in flows:
        if name not in mode.flow:
            label = f"`{name}` has no balance in mode `{mode.name}` of region `{region.name}`"
            problems.error("missing", mode.span, label, f"`der({name}) = 0` keeps it")


def _check_writers(automaton: Automaton, problems: Problems) -> None:
    """Report names that two regions define, balance or assign.

    Assignments of a chart are checked in check_chart.py.
    """
    for what in ("equation", "balance", "assignment"):
        if automaton.statechart and what == "assignment":
            continue
        writers: dict[str, str] = {}
        for region in automaton.all_regions:
            for name, span in _written_names(region, what):
                first = writers.setdefault(name, region.name)
                if first != region.name:
                    a = "a" if what == "balance" else "an"
                    here = f"in region `{first}` and in region `{region.name}`"
                    label = f"`{name}` has {a} {what} {here}"
                    hint = "parallel regions write disjoint variables"
                    problems.error("writer", span, label, hint)


def _written_names(region: Region, what: str) -> Iterator[tuple[str, Span]]:
    """Yield the names that a region writes in one way, with their places.

    `what` is the way: `equation`, `balance` or `assignment`.
    """
    for mode in region.modes.values():
        if what == "equation":
            yield from ((name, formula.span) for name, formula in mode.equations.items())
        elif what == "balance":
            yield from ((name, balance.left.span) for name, balance in mode.flow.items())
        else:
            for formulas in (mode.update, *mode.jump_assignments):
                yield from ((name, formula.span) for name, formula in formulas.items())
