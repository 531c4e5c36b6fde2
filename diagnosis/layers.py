"""Layers: effects and drifts laid over the automaton under diagnosis, and its Program.

A drift is a slow unknown disturbance at one place (an Ornstein-Uhlenbeck process): with it an
observer follows what the model leaves out, and the place at which it is needed is where something
is missing (Kristensen, Madsen, Jorgensen 2004).
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from importlib import resources
from pathlib import Path

from diagnosis.series import shows_inputs
from language.continuous import step_limits
from language.document import Document, Scalar, Table
from language.effect import Effect, Laying, read_effect
from language.known import entries_of
from language.laying import lay_effect
from language.load import automaton_of, program_of
from language.memory import applications, applies
from language.model import Automaton
from language.place import Misfit, place_of
from language.problem import Problems, Source, Span
from language.program import Program
from language.project import Project, read_document
from language.units import parse_unit

DRIFT = "drift"
WALKS = ("constant_or_random_walk",)
"""Forms of an effect's parameter that may change along a recording."""
SECONDS = parse_unit("s").dimension.powers
KINDS = ("balance", "element", "output")
SECTIONS = {"flow": "balance", "inputs": "input", "elements": "element", "outputs": "output"}
"""The kind of place that the names of a section are."""
LONGEST_STEP = Fraction(5, 1000)
"""Longest major step [s] of a prediction; events inside it are located."""
STABLE_PART = Fraction(1, 2)
"""A step is at most this part of the largest stable one: parameters move while they are fitted."""
FAR = Fraction(4)
"""How far an effect's parameter may move while it is fitted, as a factor."""
DELAYED_STEPS = 4
"""Fewest major steps between two samples of a model with a delay: none is shorter than a step."""
TURNING_STEP = Fraction(1, 1000)
"""Longest major step [s] of one with an input that goes along with an angle: motors turn by much in
a sample. A tone of 12 periods a turn at 100 rad/s then has five steps a period."""
MOST_STEPS = 40
"""Most major steps between two samples."""


@dataclass(frozen=True)
class Layer:
    """An effect at a place; `ending` is what its names end with."""

    effect: Effect
    place: str
    ending: str

    @property
    def id(self) -> str:
        """`effect@place`, as it stands in a variant."""
        return f"{self.effect.name}@{self.place}"

    def named(self, name: str) -> str:
        """Return the name that one of the effect's own names has in the automaton."""
        return f"{name}_{self.ending}"


def has_parameters(layer: Layer) -> bool:
    """Tell whether an effect has numbers to fit; one that has none follows anything at all."""
    return layer.effect.body.get("parameters") is not None


def walks(layer: Layer) -> bool:
    """Tell whether a number of an effect may change slowly along a recording."""
    known = layer.effect.body.get("parameters")
    entries = known if isinstance(known, Table) else ()
    forms = [one.node.get("form") for one in entries if isinstance(one.node, Table)]
    return any(isinstance(one, Scalar) and one.text in WALKS for one in forms)


def effects_in(folder: Path) -> tuple[Effect, ...]:
    """Return the effects of a folder, by name. Raises SpecError."""
    problems = Problems()
    found = [read_effect(read_document(path), problems) for path in sorted(folder.glob("*.yaml"))]
    problems.stop_if_any()
    return tuple(found)


def shipped_effects() -> tuple[Effect, ...]:
    """Return the effects that come with the product."""
    return effects_in(Path(str(resources.files("spec"))) / "effects")


def drift(kind: str, place: str) -> Layer:
    """Return the drift of a balance, an element or an output."""
    path = Path(str(resources.files("diagnosis"))) / "drifts" / f"drift_of_{kind}.yaml"
    return Layer(read_effect(read_document(path), Problems()), place, f"{kind}_{place}")


def fitting(document: Document, effect: Effect) -> tuple[Layer, ...]:
    """Return an effect at every place of an automaton where it can be laid."""
    root, kinds = document.root, {fit.kind for fit in effect.fits}
    fits = [
        name
        for name, own in _places(document).items()
        if own & kinds and not isinstance(place_of(root, effect, name), Misfit)
    ]
    return tuple(Layer(effect, name, name) for name in fits)


def laid(document: Document, layers: Sequence[Layer]) -> Document:
    """Return an expanded document with layers laid over it, in their order. Raises SpecError."""
    problems = Problems()
    root = document.root
    span = Span(Source("diagnosis"), 1, 1)
    for layer in layers:
        laying = Laying(layer.effect, layer.place, layer.ending, {}, {}, span)
        root = lay_effect(root, laying, problems)
        problems.stop_if_any()
    return dataclasses.replace(document, root=root)


def automaton(document: Document, project: Project, layers: Sequence[Layer]) -> Automaton:
    """Return the checked automaton with layers laid over it. Raises SpecError."""
    return automaton_of(laid(document, layers), project)


def stepped(
    given: Automaton,
    names: Sequence[str],
    brought: Sequence[str],
    period: Fraction,
    fewest: int = 1,
) -> tuple[Program, int]:
    """Return the Program in which `names` are tunable, and its steps in a period [s].

    The step is a whole part of the period, one of at least `fewest`; it is stable for parameters
    that effects `brought` at a quarter and at four times their value, and no longer than a time
    that they brought: where a rate is limited, stability is not known beforehand.
    """
    moved = [_scaled(given, brought, factor) for factor in (FAR, 1 / FAR)]
    others = [one for one in moved if one.parameters != given.parameters]
    stable = [_stable(one, LONGEST_STEP) for one in (given, *others)]
    longest = min(*stable, *_times(given, brought), LONGEST_STEP)
    substeps = min(max(fewest, -(-period // longest)), MOST_STEPS)
    parameters = {
        name: dataclasses.replace(parameter, kind="tunable") if name in names else parameter
        for name, parameter in given.parameters.items()
    }
    tuned = dataclasses.replace(given, parameters=parameters, step=period / substeps)
    return program_of(tuned), int(substeps)


def _times(given: Automaton, names: Sequence[str]) -> list[Fraction]:
    """Return the values [s] of those parameters that are times."""
    known = [given.parameters[name] for name in names if name in given.parameters]
    return [
        parameter.value
        for parameter in known
        if parameter.value and parameter.unit.dimension.powers == SECONDS
    ]


def fewest_steps(
    given: Automaton, layers: Sequence[Layer], seen: Sequence[str], period: Fraction
) -> int:
    """Return how many major steps there are to be in a period [s] between two samples at least.

    Several where what is `seen` shows an input at once as well: it is held within a step.
    """
    at_input = any(layer.effect.fits[0].kind == "input" for layer in layers)
    if at_input and applies(given, "floor"):
        return int(-(-period // TURNING_STEP))
    is_short = applications(given, ("delay",)) or shows_inputs(given, seen)
    return DELAYED_STEPS if is_short else 1


def _stable(given: Automaton, longest: Fraction) -> Fraction:
    for limit in () if given.is_sampled else step_limits(given):
        stable = Fraction(limit.step).limit_denominator(10**9) if limit.step < 1.0 else Fraction(1)
        longest = min(longest, STABLE_PART * stable)
    return max(longest, Fraction(1, 10**6))


def _scaled(given: Automaton, names: Sequence[str], factor: Fraction) -> Automaton:
    """Return an automaton with some parameters scaled, within their ranges."""
    parameters = dict(given.parameters)
    for name in names:
        parameter = parameters.get(name)
        if parameter and parameter.range and parameter.value and parameter.type == "real":
            low, high = parameter.range
            value = min(max(parameter.value * factor, low), high)
            parameters[name] = dataclasses.replace(parameter, value=value)
    return dataclasses.replace(given, parameters=parameters)


def _places(document: Document) -> dict[str, set[str]]:
    """Return what effects may be laid on, with the kinds of place that each could be."""
    found: dict[str, set[str]] = {}
    for section, kind in SECTIONS.items():
        node = document.root.get(section)
        names = [entry.key for entry in getattr(node, "entries", {}).values()]
        names += [item.text for item in getattr(node, "nodes", ()) if hasattr(item, "text")]
        for name in names:
            found.setdefault(name, set()).add(kind)
    for name, _ in entries_of(document.root, "flow"):
        found.get(name, set()).add("balance")
    return found
