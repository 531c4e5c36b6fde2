"""Mode entry event: the entry of a mode of an instance, from one mode or from any."""

from __future__ import annotations

from dataclasses import dataclass

from language.ir.root_region import CHART
from language.model.system import System
from language.text.diagnostic import Problems, suggest_name
from language.text.document import ScalarNode


@dataclass(frozen=True)
class ModeEntryEvent:
    """The entry of the mode `target`; if `source` is not empty, only from that mode."""

    instance: str
    region: str
    target: str
    source: str = ""


def read_event(scalar: ScalarNode, system: System, problems: Problems) -> ModeEntryEvent | None:
    """Return the event that a text like `plant.no_contact` or `plant.drive -> plant.coast` names.

    Names are those of `modes_by_name`; the name after `->` may lack the instance. Returns None with
    a problem reported if a mode does not exist, if both modes are not of one region, or if no
    transition (from the source, if given) enters the mode. The fault mode counts as entered from
    any mode. In a chart the transitions are not examined.
    """
    head, arrow, tail = (part.strip() for part in scalar.text.partition("->"))
    known = modes_by_name(system)
    place = known.get(head)
    if place is None:
        label = f"`{head}` is not a mode of an instance of `{system.name}`"
        problems.error("name", scalar.span, label, suggest_name(head, known))
        return None
    instance, region, mode = place
    automaton = system.instances[instance].automaton
    source = ""
    if arrow and automaton.statechart is not None:
        source, other = mode, known.get(tail) or known.get(f"{instance}.{tail}")
        if other is None or other[:2] != (instance, region):
            label = f"`{tail}` is not a mode beside `{source}`"
            problems.error("name", scalar.span, label, suggest_name(tail, known))
            return None
        mode = other[2]
    elif arrow:
        source, mode = mode, tail.rpartition(".")[2]
        if mode not in automaton.region(region).modes:
            label = f"`{tail}` is not a mode beside `{source}`"
            problems.error(
                "name", scalar.span, label, suggest_name(mode, automaton.region(region).modes)
            )
            return None
    if automaton.statechart is not None:
        return ModeEntryEvent(instance, region, mode, source)
    transitions = [
        (transition.source, transition.target)
        for other_mode in automaton.region(region).modes.values()
        for transition in other_mode.transitions
    ]
    transitions.append(("", automaton.fault_mode or ""))
    if not any(to == mode and source in ("", of) for of, to in transitions):
        label = f"no transition enters `{mode}`" + (f" from `{source}`" if source else "")
        problems.error("event", scalar.span, label, "an event is the entry of a mode")
        return None
    return ModeEntryEvent(instance, region, mode, source)


def modes_by_name(system: System) -> dict[str, tuple[str, str, str]]:
    """Return instance, region and mode by name: `instance.mode` or `instance.region.mode`.

    The region is left out for `chart`. Superstates are included, regions inside modes are not
    modes. In the system of a single automaton, names without the instance are included too.
    """
    modes = {}
    for name, instance in system.instances.items():
        for region in instance.automaton.all_regions:
            for mode in region.modes:
                place = (name, region.name, mode)
                inner = mode if region.name == CHART else f"{region.name}.{mode}"
                modes[f"{name}.{inner}"] = place
                if system.sole_instance:
                    modes[inner] = place
        for outer in instance.automaton.superstates:
            if outer.key.split(".")[-2:-1] == ["modes"]:
                path = outer.name if outer.region == CHART else f"{outer.region}.{outer.name}"
                place = (name, outer.region, outer.name)
                modes[f"{name}.{path}"] = place
                if system.sole_instance:
                    modes[path] = place
    return modes
