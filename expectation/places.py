"""Places: the modes of a system by name, superstates too, and which signals tell of charts."""

from __future__ import annotations

from expectation.expected import Place, Stay
from language.event_name import EventName
from language.experiment import System
from language.model import CHART, Automaton
from language.problem import Problems, Span


def stays(system: System) -> dict[str, Stay]:
    """Return every mode by `instance.mode`, alone for the one instance of an automaton."""
    found: dict[str, Stay] = {}
    for name, instance in system.instances.items():
        for (region, path), inside in modes_inside(instance.automaton).items():
            stay = Stay((name, region), inside)
            found[f"{name}.{path}"] = stay
            if region == CHART:
                found.setdefault(f"{name}.{CHART}.{path}", stay)
            if system.alone:
                found[path] = stay
    return found


def modes_inside(automaton: Automaton) -> dict[tuple[str, str], frozenset[str]]:
    """Return the innermost modes of its region inside each mode, by region and path."""
    found: dict[tuple[str, str], frozenset[str]] = {}
    for region in automaton.all_regions:
        for mode in region.modes.values():
            found[region.name, path_of(region.name, mode.name)] = frozenset([mode.name])
    for mode in automaton.superstates:
        if mode.key.split(".")[-2:-1] == ["modes"]:
            others = automaton.region(mode.region).modes.values()
            inside = (other.name for other in others if other.key.startswith(f"{mode.key}."))
            found[mode.region, path_of(mode.region, mode.name)] = frozenset(inside)
    return found


def path_of(region: str, mode: str) -> str:
    """Return the path of a mode from the root."""
    return mode if region == CHART else f"{region}.{mode}"


def inside(system: System, event: EventName) -> frozenset[str]:
    """Return the innermost modes inside the one that an event enters."""
    automaton = system.instances[event.instance].automaton
    return modes_inside(automaton)[event.region, path_of(event.region, event.target)]


def is_chart(system: System, instance: str) -> bool:
    """Tell whether an instance has modes inside modes, or several micro-steps in a tick."""
    return system.instances[instance].automaton.tree is not None


def mode_signals(system: System, instance: str) -> dict[str, Place]:
    """Return the signals that hold the modes of an instance, with their regions."""
    found = {}
    for region in system.instances[instance].automaton.all_regions:
        signal = "mode" if region.name == CHART else region.name.replace(".", "_")
        found[f"{instance}.{signal}"] = (instance, region.name)
    return found


def require_mode_output(system: System, instance: str, at: Span, problems: Problems) -> None:
    """Report a chart whose modes a run does not tell."""
    outputs = system.instances[instance].automaton.outputs
    if is_chart(system, instance) and "mode" not in outputs:
        label = f"`{instance}` is a chart: its modes are known by its output `mode`"
        problems.error("missing", at, label, "add `mode` to its `outputs`")


def unknown_output(system: System, name: str) -> str:
    """Return what makes a signal of what an instance keeps to itself; empty where it has none."""
    head, _, own = name.rpartition(".")
    instance = system.instances.get(head or system.alone or "")
    automaton = instance.automaton if instance else None
    if automaton is None:
        return ""
    computed = {part for mode in automaton.modes.values() for part in mode.equations}
    is_its_own = own in computed or own in automaton.carried
    return f"add `{own}` to the `outputs` of `{automaton.name}`" if is_its_own else ""
