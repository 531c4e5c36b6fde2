"""Chart transitions: resolution of targets, and the node that each transition exits."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from language.model.automaton import Mode, Transition
from language.model.chart_paths import resolve_target, target_names
from language.model.statechart import ROOT, Chart, ChartNode, ChartTransition
from language.text.diagnostic import Problems, suggest_name


def resolve_transitions(
    chart: Chart, modes: Mapping[int, Mode], problems: Problems
) -> dict[str, ChartTransition]:
    """Return the resolved transitions of modes, by the key path of the transition.

    `modes` are the modes by the index of their node. An unknown target is reported and left out.
    Also reported, without effect on the result: a transition with both an event and a wait, targets
    that are not in different regions of one parallel mode, an internal transition that leaves its
    source or whose source is parallel, and a target in another region of the root.
    """
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
    """Return one resolved transition; targets that do not exist or do not fit are reported."""
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
    """Return a hint for an unknown target.

    It is `to: []` for words like `none`, the paths of modes that have this name elsewhere in the
    tree, or a similar name.
    """
    if name in ("none", "null", "self", "stay"):
        return "`to: []` for no target"
    paths = [node.path for node in chart.nodes[ROOT + 1 :] if node.name == name]
    if paths:
        return f"it is in another mode: write {' or '.join(f'`to: {path}`' for path in paths)}"
    return suggest_name(name, target_names(chart))


def _check_orthogonal_targets(
    chart: Chart, transition: Transition, targets: Sequence[ChartNode], problems: Problems
) -> None:
    """Report pairs of targets that are not in different regions of one parallel mode."""
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
    """Report an internal transition whose targets are not descendants of its source.

    An internal transition of a parallel mode must not have targets.
    """
    if not transition.internal:
        return
    if any(not source.contains(t.index) or t.index == source.index for t in targets):
        label = f"an internal transition leads to a mode inside `{source.path}`"
        problems.error("target", transition.span, label, "`to: []` where nothing is entered")
    elif targets and source.kind == "parallel":
        label = f"`{source.path}` has regions: no transition of its own is internal"
        hint = "give it to the modes of one region; without `internal` all regions are left"
        problems.error("target", transition.span, label, hint)
