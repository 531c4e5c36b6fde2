"""Chart way: the transitions of a chart with their targets found, and what they leave."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from language.model.automaton import Mode, Transition
from language.model.chart_paths import resolve_target, target_names
from language.model.statechart import ROOT, Chart, ChartNode, ChartTransition
from language.text.diagnostic import Problems, suggest_name


def resolve_transitions(
    chart: Chart, modes: Mapping[int, Mode], problems: Problems
) -> dict[str, ChartTransition]:
    """Return the ways of the modes of some nodes by their key path; wrong targets are reported."""
    result: dict[str, ChartTransition] = {}
    for index, mode in modes.items():
        for transition in mode.transitions:
            result[transition.key] = _resolve_transition(
                chart, chart.nodes[index], transition, problems
            )
    return result


def _resolve_transition(
    chart: Chart, source: ChartNode, transition: Transition, problems: Problems
) -> ChartTransition:
    targets: list[ChartNode] = []
    for name in transition.targets:
        hit = resolve_target(chart, source, name)
        if hit is None:
            label = f"there is no mode `{name}`"
            hint = _target_hint(chart, name)
            problems.error("name", transition.span, label, hint)
        else:
            targets.append(hit)
    if transition.events and transition.wait:
        label = "an event is an instant: it cannot hold for a wait"
        problems.error("wait", transition.wait.span, label)
    _check_orthogonal_targets(chart, transition, targets, problems)
    _check_internal(source, transition, targets, problems)
    domain = chart.domain(source, targets, transition.internal)
    if domain == ROOT and targets:
        label = f"`{targets[0].path}` is in another region of the root"
        hint = "regions of the root are never left"
        problems.error("target", transition.span, label, hint)
    return ChartTransition(source.index, tuple(target.index for target in targets), domain)


def _target_hint(chart: Chart, name: str) -> str:
    """Return where a mode stands that is no target by its own name, else the nearest name."""
    if name in ("none", "null", "self", "stay"):
        return "`to: []` for no target"
    paths = [node.path for node in chart.nodes[ROOT + 1 :] if node.name == name]
    if paths:
        return f"it stands in another mode: write {' or '.join(f'`to: {path}`' for path in paths)}"
    return suggest_name(name, target_names(chart))


def _check_orthogonal_targets(
    chart: Chart, transition: Transition, targets: Sequence[ChartNode], problems: Problems
) -> None:
    """Several targets lie in different regions of one mode."""
    for number, target in enumerate(targets):
        for other in targets[:number]:
            shared = [node for node in chart.ancestors(target) if node.contains(other.index)]
            apart = bool(shared) and shared[0].kind == "parallel"
            if not apart or chart.are_nested(target.index, other.index):
                label = f"`{other.path}` and `{target.path}` are never active together"
                hint = "several targets lie in different regions of one mode"
                problems.error("target", transition.span, label, hint)


def _check_internal(
    source: ChartNode, transition: Transition, targets: Sequence[ChartNode], problems: Problems
) -> None:
    if not transition.internal:
        return
    if any(not source.contains(t.index) or t.index == source.index for t in targets):
        label = f"an internal transition leads to what is inside `{source.path}`"
        problems.error("target", transition.span, label, "`to: []` where nothing is entered")
    elif targets and source.kind == "parallel":
        label = f"`{source.path}` has regions: no transition of its own is internal"
        hint = "give it to the modes of one region; without `internal` all regions are left"
        problems.error("target", transition.span, label, hint)
