"""Name resolution: find modes, superstates, mode signals and fault bits of a system by name."""

from __future__ import annotations

from collections.abc import Iterable

from expectation.expectations import ModePredicate, RegionRef
from language.ir.analysis_cache import cache_on_owner
from language.ir.root_region import CHART
from language.loading.load import lower_automaton
from language.loading.mode_entry_event import ModeEntryEvent
from language.model.automaton import Automaton
from language.model.system import System
from language.text.diagnostic import Problems, Span, suggest_name


def mode_predicates(system: System) -> dict[str, ModePredicate]:
    """Return the predicate of each mode and superstate by `instance.mode`.

    A mode of a parallel region is `instance.region.mode`; one of the main region also has that
    form, unless the name is taken. In a system with a single instance, all paths are known without
    it too.
    """
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
    """Return the leaf modes inside each mode and superstate, by region and `path_of_mode`.

    A leaf mode has only itself.
    """
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
    """Return the path of a mode: its name in the main region (CHART), else `region.mode`."""
    return mode if region == CHART else f"{region}.{mode}"


def format_region(region_ref: RegionRef) -> str:
    """Return the name of a region: `est` for the main region, else `est.gap`."""
    instance, region = region_ref
    return instance if region == CHART else f"{instance}.{region}"


def suggest_mode(name: str, region_ref: RegionRef, system: System) -> str:
    """Return a hint with the mode of a region that the name probably means; may be empty.

    Prefixes of the instance and region are ignored. A mode with that name comes first, then the
    first one whose last part it is, then the most similar one (`suggest_name`).
    """
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
    """Return a hint with the shortest known path that ends with `.` and the name.

    Otherwise the hint is that of `suggest_name`, which may be empty.
    """
    known = list(known)
    ends = [path for path in known if path.endswith(f".{name}")]
    return f"did you mean `{min(ends, key=len)}`?" if ends else suggest_name(name, known)


def leaf_modes_entered(system: System, event: ModeEntryEvent) -> frozenset[str]:
    """Return the names of the leaf modes inside the target mode of an event.

    Raises KeyError for an unknown instance or mode.
    """
    automaton = system.instances[event.instance].automaton
    return leaf_modes_by_path(automaton)[event.region, path_of_mode(event.region, event.target)]


def is_chart(system: System, instance: str) -> bool:
    """Tell whether the automaton of an instance is a chart.

    A chart has nested modes or several micro-steps: its `statechart` is not None.
    """
    return system.instances[instance].automaton.statechart is not None


def mode_signals(system: System, instance: str) -> dict[str, RegionRef]:
    """Return the regions of an instance by the signal that holds their mode.

    The signal is `instance.mode` for the main region, else `instance.<region>` with underscores for
    dots. It need not be an output.
    """
    found = {}
    for region in system.instances[instance].automaton.all_regions:
        signal = "mode" if region.name == CHART else region.name.replace(".", "_")
        found[f"{instance}.{signal}"] = (instance, region.name)
    return found


def fault_words(system: System) -> dict[str, str]:
    """Return the instances by the signals that hold their fault words.

    These are outputs `instance.output` whose source is `faults`, then outputs of the system that
    are such a signal. An instance without such an output is absent.
    """
    found = {
        f"{name}.{output}": name
        for name, instance in system.instances.items()
        for output in instance.automaton.outputs
        if instance.automaton.output_source(output) == "faults"
    }
    outer = {name: found[of] for name, of in system.outputs.items() if of in found}
    return found | outer


def fault_bits(system: System, instance: str) -> dict[str, int]:
    """Return the index of the bit of each fault of an instance, by name, in the order of the bits.

    Empty if the instance is not sampled or does not exist.
    """
    found = system.instances.get(instance)
    return _fault_bits_of(found.automaton) if found and found.automaton.is_sampled else {}


@cache_on_owner
def _fault_bits_of(automaton: Automaton) -> dict[str, int]:
    """Return the bit of each fault of an automaton; cached with the automaton."""
    return {name: bit for bit, name in enumerate(lower_automaton(automaton).faults)}


def require_mode_output(system: System, instance: str, at: Span, problems: Problems) -> None:
    """Report an error `missing` at a place for a chart that does not have `mode` as an output."""
    outputs = system.instances[instance].automaton.outputs
    if is_chart(system, instance) and "mode" not in outputs:
        label = f"`{instance}` is a chart: its modes are known by its output `mode`"
        problems.error("missing", at, label, "add `mode` to its `outputs`")


def suggest_output(system: System, name: str) -> str:
    """Return the hint to make an internal variable of an instance an output.

    `name` is `instance.variable`, or `variable` with a single instance. The result is empty unless
    it is a state, an equation of some mode or the `faults` of a sampled instance.
    """
    head, _, own = name.rpartition(".")
    instance = system.instances.get(head or system.sole_instance or "")
    automaton = instance.automaton if instance else None
    if automaton is None:
        return ""
    computed = {part for mode in automaton.modes.values() for part in mode.equations}
    is_its_own = own in computed or own in automaton.state_variables
    is_its_own = is_its_own or (own == "faults" and automaton.is_sampled)
    return f"add `{own}` to the `outputs` of `{automaton.name}`" if is_its_own else ""
