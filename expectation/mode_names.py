"""Places: the modes of a system by name, superstates too, and which signals tell of charts."""

from __future__ import annotations

from collections.abc import Iterable

from expectation.expectations import ModePredicate, RegionRef
from language.ir.regions import CHART
from language.loading.event_names import ModeEntryEvent
from language.loading.load import lower_automaton
from language.model.analysis_cache import cache_on_owner
from language.model.automaton import Automaton
from language.model.system import System
from language.text.diagnostic import Problems, Span, suggest_name


def mode_predicates(system: System) -> dict[str, ModePredicate]:
    """Return every mode by `instance.mode`, alone for the one instance of an automaton."""
    found: dict[str, ModePredicate] = {}
    for name, instance in system.instances.items():
        for (region, path), inside in leaf_modes_by_path(instance.automaton).items():
            stay = ModePredicate((name, region), inside)
            found[f"{name}.{path}"] = stay
            if region == CHART:
                found.setdefault(f"{name}.{CHART}.{path}", stay)
            if system.sole_instance:
                found[path] = stay
    return found


def leaf_modes_by_path(automaton: Automaton) -> dict[tuple[str, str], frozenset[str]]:
    """Return the innermost modes of its region inside each mode, by region and path."""
    found: dict[tuple[str, str], frozenset[str]] = {}
    for region in automaton.all_regions:
        for mode in region.modes.values():
            found[region.name, path_of_mode(region.name, mode.name)] = frozenset([mode.name])
    for mode in automaton.superstates:
        if mode.key.split(".")[-2:-1] == ["modes"]:
            others = automaton.region(mode.region).modes.values()
            inside = (other.name for other in others if other.key.startswith(f"{mode.key}."))
            found[mode.region, path_of_mode(mode.region, mode.name)] = frozenset(inside)
    return found


def path_of_mode(region: str, mode: str) -> str:
    """Return the path of a mode from the root."""
    return mode if region == CHART else f"{region}.{mode}"


def format_region(region_ref: RegionRef) -> str:
    """Return how a region is named: `est`, `est.gap`."""
    instance, region = region_ref
    return instance if region == CHART else f"{instance}.{region}"


def suggest_mode(name: str, region_ref: RegionRef, system: System) -> str:
    """Return which mode of a region may be meant, by the name it has beside that region."""
    instance, region = region_ref
    own = "" if region == CHART else f"{region}."
    paths = leaf_modes_by_path(system.instances[instance].automaton)
    known = [path.removeprefix(own) for of, path in paths if of == region]
    name = name.removeprefix(f"{instance}.").removeprefix(own)
    ends = [path for path in known if path.rpartition(".")[2] == name]
    if name in known or ends:
        return f"did you mean `{name if name in known else ends[0]}`?"
    return suggest_name(name, known)


def suggest_path(name: str, known: Iterable[str]) -> str:
    """Return which of some paths may be meant: one that ends so, else the nearest one."""
    known = list(known)
    ends = [path for path in known if path.endswith(f".{name}")]
    return f"did you mean `{min(ends, key=len)}`?" if ends else suggest_name(name, known)


def leaf_modes_entered(system: System, event: ModeEntryEvent) -> frozenset[str]:
    """Return the innermost modes inside the one that an event enters."""
    automaton = system.instances[event.instance].automaton
    return leaf_modes_by_path(automaton)[event.region, path_of_mode(event.region, event.target)]


def is_chart(system: System, instance: str) -> bool:
    """Tell whether an instance has modes inside modes, or several micro-steps in a tick."""
    return system.instances[instance].automaton.statechart is not None


def mode_signals(system: System, instance: str) -> dict[str, RegionRef]:
    """Return the signals that hold the modes of an instance, with their regions."""
    found = {}
    for region in system.instances[instance].automaton.all_regions:
        signal = "mode" if region.name == CHART else region.name.replace(".", "_")
        found[f"{instance}.{signal}"] = (instance, region.name)
    return found


def fault_words(system: System) -> dict[str, str]:
    """Return the signals that hold fault words, with their instances; those of instances first."""
    found = {
        f"{name}.{output}": name
        for name, instance in system.instances.items()
        for output in instance.automaton.outputs
        if instance.automaton.output_source(output) == "faults"
    }
    outer = {name: found[of] for name, of in system.outputs.items() if of in found}
    return found | outer


def fault_bits(system: System, instance: str) -> dict[str, int]:
    """Return the bits of an instance's fault word by name; none for one that has no such word."""
    found = system.instances.get(instance)
    return _fault_bits_of(found.automaton) if found and found.automaton.is_sampled else {}


@cache_on_owner
def _fault_bits_of(automaton: Automaton) -> dict[str, int]:
    return {name: bit for bit, name in enumerate(lower_automaton(automaton).faults)}


def require_mode_output(system: System, instance: str, at: Span, problems: Problems) -> None:
    """Report a chart whose modes a run does not tell."""
    outputs = system.instances[instance].automaton.outputs
    if is_chart(system, instance) and "mode" not in outputs:
        label = f"`{instance}` is a chart: its modes are known by its output `mode`"
        problems.error("missing", at, label, "add `mode` to its `outputs`")


def suggest_output(system: System, name: str) -> str:
    """Return what makes a signal of what an instance keeps to itself; empty where it has none."""
    head, _, own = name.rpartition(".")
    instance = system.instances.get(head or system.sole_instance or "")
    automaton = instance.automaton if instance else None
    if automaton is None:
        return ""
    computed = {part for mode in automaton.modes.values() for part in mode.equations}
    is_its_own = own in computed or own in automaton.state_variables
    is_its_own = is_its_own or (own == "faults" and automaton.is_sampled)
    return f"add `{own}` to the `outputs` of `{automaton.name}`" if is_its_own else ""
