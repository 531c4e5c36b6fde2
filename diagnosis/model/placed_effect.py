"""Placed effects: effects and disturbances applied to the automaton under diagnosis.

A disturbance (a drift in file names) is a slow unknown load at one place, an Ornstein-Uhlenbeck
process. With it an observer follows what the model omits; the place that needs it is where physics
is missing (Kristensen, Madsen, Jorgensen 2004).
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from importlib import resources
from pathlib import Path

from diagnosis.data.sampled_recording import has_feedthrough
from diagnosis.data.time_resolution import time_resolution
from language.expressions.units import parse_unit
from language.ir.program import Program
from language.loading.load import automaton_of, program_of
from language.lowering.delay_buffers import memory_calls_by_key, uses_function
from language.model.automaton import Automaton
from language.overlays.apply_effect import apply_effect
from language.overlays.effect_place import PlaceMismatch, find_effect_place
from language.overlays.effect_reader import Effect, EffectApplication, added_names, read_effect
from language.overlays.expand_document import Project, read_document
from language.overlays.name_types import formula_entries
from language.text.diagnostic import Problems, Source, Span
from language.text.document import Document

DISTURBANCE_STATE = "drift"

TIME_DIMENSION = parse_unit("s").dimension.powers

PLACE_KIND_BY_SECTION = {
    "flow": "balance",
    "inputs": "input",
    "elements": "element",
    "outputs": "output",
}
"""The kind of place that the names of a section denote."""
SECTION_BY_PLACE_KIND = {kind: section for section, kind in PLACE_KIND_BY_SECTION.items()}

MAX_STEP = Fraction(5, 1000)
"""Longest major step [s] of a prediction; events inside a step are located."""

PARAMETER_FACTOR = Fraction(4)
"""Factor by which an effect's parameter may change in a fit, for the choice of a stable step."""

MIN_DELAY_STEPS = 4
"""Fewest major steps between samples of a model with a delay, which is at least one step long."""

MAX_ANGLE_STEP = Fraction(1, 1000)
"""Longest major step [s] of a model with an effect at an input that depends on an angle.

An order of 12 periods a turn at 100 rad/s then has five steps a period.
"""

MAX_STEPS = 40
"""Most major steps between two samples."""


def round_scale(value: float) -> Fraction:
    """Return 1 or 3 times the power of ten that is nearest to a positive value in its logarithm."""
    half_decades = round(2.0 * math.log10(value))
    return Fraction(10) ** (half_decades // 2) * (3 if half_decades % 2 else 1)


@dataclass(frozen=True)
class PlacedEffect:
    """An effect at a place; names that it adds to the automaton end with `_` and `suffix`.

    `scales` are the magnitudes of the place [SI], of which its parameters may be multiples.
    """

    effect: Effect
    place: str
    suffix: str
    scales: Mapping[str, Fraction] = field(default_factory=dict, compare=False)

    @property
    def id(self) -> str:
        """The identifier `effect@place`, as in a variant file."""
        return f"{self.effect.name}@{self.place}"

    def qualified_name(self, name: str) -> str:
        """Return the name in the automaton of a name of the effect: `<name>_<suffix>`."""
        return f"{name}_{self.suffix}"


def read_effects(folder: Path) -> tuple[Effect, ...]:
    """Return the effects in the files `*.yaml` directly in a folder; may raise SpecError."""
    problems = Problems()
    found = [read_effect(read_document(path), problems) for path in sorted(folder.glob("*.yaml"))]
    problems.raise_if_errors()
    return tuple(found)


def shipped_effects() -> tuple[Effect, ...]:
    """Return the effects of the shipped library, sorted by file name."""
    return read_effects(Path(str(resources.files("spec"))) / "effects")


def disturbance_effect(kind: str, place: str) -> PlacedEffect:
    """Return the disturbance at a place; `kind` is "balance", "element" or "output"."""
    path = Path(str(resources.files("diagnosis.model"))) / "disturbances" / f"drift_of_{kind}.yaml"
    return PlacedEffect(read_effect(read_document(path), Problems()), place, f"{kind}_{place}")


def find_placements(document: Document, effect: Effect) -> tuple[PlacedEffect, ...]:
    """Return an effect at every place of an expanded automaton that matches its patterns."""
    root, kinds = document.root, {fit.kind for fit in effect.place_patterns}
    return tuple(
        PlacedEffect(effect, name, name)
        for name, own in _place_kinds(document).items()
        if own & kinds and not isinstance(find_effect_place(root, effect, name), PlaceMismatch)
    )


def overlay_effects(document: Document, placed_effects: Sequence[PlacedEffect]) -> Document:
    """Return an expanded document with effects applied in order; SpecError if one cannot be."""
    problems = Problems()
    root = document.root
    span = Span(Source("diagnosis"), 1, 1)
    for placed_effect in placed_effects:
        names = placed_effect.effect, placed_effect.place, placed_effect.suffix
        application = EffectApplication(*names, {}, {}, span, placed_effect.scales)
        root = apply_effect(root, application, problems)
        problems.raise_if_errors()
    return dataclasses.replace(document, root=root)


def automaton_with_effects(
    document: Document, project: Project, placed_effects: Sequence[PlacedEffect]
) -> Automaton:
    """Return the automaton of a document with effects; SpecError if that is invalid."""
    return automaton_of(overlay_effects(document, placed_effects), project)


def lower_tunable_program(
    automaton: Automaton,
    names: Sequence[str],
    effect_parameters: Sequence[str],
    period: Fraction,
    min_substeps: int = 1,
) -> tuple[Program, int]:
    """Return the Program in which `names` are tunable, and the major steps in a period [s].

    The step divides the period into `min_substeps` to `MAX_STEPS` (40) parts. It is at most
    `MAX_STEP` or the period, and the `time_resolution` with `effect_parameters` at a quarter and
    four times their values, and any nonzero time among these: the eigenvalue of a limited rate is
    not known beforehand.
    """
    scaled = [
        _scale_parameters(automaton, effect_parameters, factor)
        for factor in (PARAMETER_FACTOR, 1 / PARAMETER_FACTOR)
    ]
    variants = [one for one in scaled if one.parameters != automaton.parameters]
    slowest = max(MAX_STEP, period)
    accurate = [time_resolution(one, slowest) for one in (automaton, *variants)]
    longest = min(*accurate, *_time_values(automaton, effect_parameters), slowest)
    substeps = min(max(min_substeps, -(-period // longest)), MAX_STEPS)
    parameters = {
        name: dataclasses.replace(parameter, kind="tunable") if name in names else parameter
        for name, parameter in automaton.parameters.items()
    }
    with_tunables = dataclasses.replace(automaton, parameters=parameters, step=period / substeps)
    return program_of(with_tunables), int(substeps)


def _time_values(automaton: Automaton, names: Sequence[str]) -> list[Fraction]:
    """Return the nonzero values [s] of the named parameters whose unit is a time."""
    known = [automaton.parameters[name] for name in names if name in automaton.parameters]
    return [
        parameter.value
        for parameter in known
        if parameter.value and parameter.unit.dimension.powers == TIME_DIMENSION
    ]


def minimum_substeps(
    automaton: Automaton,
    placed_effects: Sequence[PlacedEffect],
    output_names: Sequence[str],
    period: Fraction,
) -> int:
    """Return the fewest major steps in a sample period [s] for a model with effects.

    Steps are at most `MAX_ANGLE_STEP` (1 ms) for an effect at an input that depends on an angle;
    there are `MIN_DELAY_STEPS` (4) with a delay or direct feed-through (an output is constant
    within a step).
    """
    is_at_input = any(one.effect.place_patterns[0].kind == "input" for one in placed_effects)
    if is_at_input and uses_function(automaton, "floor"):
        return int(-(-period // MAX_ANGLE_STEP))
    has_delay = bool(memory_calls_by_key(automaton, ("delay",)))
    return MIN_DELAY_STEPS if has_delay or has_feedthrough(automaton, output_names) else 1


def _scale_parameters(automaton: Automaton, names: Sequence[str], factor: Fraction) -> Automaton:
    """Return an automaton with some real parameters multiplied by `factor`, within their ranges."""
    parameters = dict(automaton.parameters)
    for name in names:
        parameter = parameters.get(name)
        if parameter and parameter.range and parameter.value and parameter.type == "real":
            low, high = parameter.range
            value = min(max(parameter.value * factor, low), high)
            parameters[name] = dataclasses.replace(parameter, value=value)
    return dataclasses.replace(automaton, parameters=parameters)


def _place_kinds(document: Document) -> dict[str, set[str]]:
    """Return the possible kinds of place of each name in a document."""
    found: dict[str, set[str]] = {}
    for section, kind in PLACE_KIND_BY_SECTION.items():
        node = document.root.get(section)
        names = [entry.key for entry in getattr(node, "entries", {}).values()]
        names += [item.text for item in getattr(node, "nodes", ()) if hasattr(item, "text")]
        for name in names:
            found.setdefault(name, set()).add(kind)
    for name, _ in formula_entries(document.root, "flow"):
        found.get(name, set()).add("balance")
    return found


def place_path(placed_effect: PlacedEffect) -> str:
    """Return `section.name` of the place of an effect, by its first place pattern."""
    kind = placed_effect.effect.place_patterns[0].kind
    return f"{SECTION_BY_PLACE_KIND[kind]}.{placed_effect.place}"


def effect_names(placed_effect: PlacedEffect) -> dict[str, str]:
    """Return the names that an effect adds to the automaton, mapped to their names in its file."""
    names = added_names(placed_effect.effect.body)
    return {placed_effect.qualified_name(name): name for name in names}
