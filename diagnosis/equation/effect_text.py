"""Effect text: terms with coefficients, written as an effect of the language and as a formula."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from diagnosis.data.array_types import Reals
from diagnosis.equation.disturbance_response import element_torques
from diagnosis.equation.term_library import LibraryTerm
from diagnosis.estimation.model_set import ModelSet
from diagnosis.estimation.place_magnitude import disturbance_unit
from diagnosis.estimation.quantity import Quantity
from diagnosis.model.placed_effect import PlacedEffect
from language.expressions.units import Dimension, dimension_product, parse_unit
from language.overlays.effect_reader import external_names, read_effect
from language.overlays.name_types import TreeTypes, format_si_unit
from language.text.diagnostic import Problems, Source, Span
from language.text.document import Document, ScalarNode
from language.text.project_files import parse_document

RANGE_FACTOR = 10.0
"""Range of a coefficient as a multiple of its value in the regression."""


@dataclass(frozen=True)
class FormulaEffect:
    """An effect made of terms; `phases` are start values of parameters per recording."""

    placed_effect: PlacedEffect
    text: str = field(repr=False)
    terms: tuple[LibraryTerm, ...] = field(repr=False)
    initial_values: Mapping[str, float] = field(repr=False)
    phases: Mapping[str, tuple[float, ...]] = field(repr=False)

    def format_fitted(
        self, values: Mapping[str, Quantity], fitted: Sequence[Mapping[str, float]]
    ) -> str:
        """Return the formula with fitted values, such as `12.3 N*m * sin(3 * angle of w_w + 0.40)`.

        `values` are quantities by qualified name, `fitted` the values [SI] of each recording.
        """
        name = self.placed_effect.qualified_name
        summands = []
        for k, term in enumerate(self.terms, 1):
            amount = values[name(f"a_{k}")]
            unit = "" if amount.unit == "1" else f" {amount.unit}"
            text = f"{amount.value:.4g}{unit}"
            if term.per_recording:
                own = ", ".join(f"{one[name(f'a_{k}')]:.3g}" for one in fitted)
                text = f"{{{own}}}{unit}"
            text += "" if term.text == "1" else f" * {term.text}"
            if term.order:
                rate = next(iter(term.states.values()))[1].split("= ")[1]
                phases = [one[name(f"ph_{k}")] for one in fitted]
                phase = f"{phases[0]:.2f}" if len(phases) == 1 else "phase"
                text += f" * sin({term.order} * angle of {rate} + {phase})"
            elif term.states:
                text += f" ({term.name})"
            summands.append(text)
        return " + ".join(summands)


def build_formula(
    model_set: ModelSet,
    section: str,
    place: str,
    terms: Sequence[LibraryTerm],
    weights: Sequence[Reals],
    number: int = 1,
) -> FormulaEffect:
    """Return the sum of terms as an effect `unknown_<number>_at_<place>`, with initial values.

    `weights` are the coefficients of each term, (recordings, waves). A model set identifies
    candidates by effect names, so `number` must be unique. Raises SpecError for an invalid text.
    """
    parts = [
        _term_text(model_set, section, place, k, *pair)
        for k, pair in enumerate(zip(terms, weights, strict=True), 1)
    ]
    name = f"unknown_{number}_at_{place}"
    draft = _effect_text(model_set, name, section, terms, parts, ())
    foreign = external_names(_parse_text(name, draft).root)
    text = _effect_text(model_set, name, section, terms, parts, foreign)
    problems = Problems()
    effect = read_effect(_parse_text(name, text), problems)
    problems.raise_if_errors()
    placed_effect = PlacedEffect(effect, place, place)
    full = placed_effect.qualified_name
    start = {full(name): one for part in parts for name, one in part.initial_values.items()}
    phases = {full(name): one for part in parts for name, one in part.phases.items()}
    return FormulaEffect(placed_effect, text, tuple(terms), start, phases)


def _parse_text(name: str, text: str) -> Document:
    """Return the document of an effect given as text."""
    return parse_document(Source(f"{name}.yaml", tuple(text.splitlines())), text)


@dataclass(frozen=True)
class _TermText:
    """The lines of one term for each section of an effect, and its summand."""

    parameters: list[str]
    states: list[str]
    flow: list[str]
    equations: list[str]
    summand: str
    initial_values: dict[str, float]
    phases: dict[str, tuple[float, ...]]


def _term_text(
    model_set: ModelSet, section: str, place: str, k: int, term: LibraryTerm, weights: Reals
) -> _TermText:
    """Return the lines of term number `k`; its names end with the number.

    The coefficient starts at the root mean square of `weights` over recordings for a sine, else at
    their mean; a sine has a phase per recording.
    """
    a, turns, phase = f"a_{k}", f"turns_{k}", f"ph_{k}"
    unit = _coefficient_unit(model_set, section, place, term)
    size = float(np.sqrt(np.mean(np.sum(weights**2, axis=1)))) or 1e-6
    value = size if term.order or term.per_recording else float(np.mean(weights[:, 0])) or 1e-6
    each = ", per: recording" if term.per_recording else ""
    most = f"{RANGE_FACTOR * size:.3g}"
    parameters = [
        f"{a}: {{value: 0, unit: {unit}, range: [-{most}, {most}], neutral: 0, "
        f"starts: [{value:.4g}]{each}}}"
    ]
    own = {name: f"{name}_{k}" for name in term.states}
    summand = f"{a} * {_rename_states(term.text, own)}" if term.text != "1" else a
    equations = []
    start, phases = {a: value}, {}
    if term.per_recording:
        phases[a] = tuple(float(one) for one in weights[:, 0])
    if term.order:
        parameters.append(f"{phase}: {{value: 0 rad, range: [-3.2, 3.2], per: recording}}")
        equations.append(f"{turns}: ({term.order} * {own['th']} + {phase}) / 1 rev")
        summand += f" * sin(({turns} - floor({turns})) * 1 rev)"
        phases[phase] = tuple(float(np.arctan2(one[1], one[0])) for one in weights)
    states = [f"{own[n]}: {{unit: {unit}, initial: 0}}" for n, (unit, _) in term.states.items()]
    flow = [f"{own[n]}: {_rename_states(text, own)}" for n, (_, text) in term.states.items()]
    return _TermText(parameters, states, flow, equations, summand, start, phases)


def _rename_states(text: str, final_names: Mapping[str, str]) -> str:
    """Return an expression with names of states replaced as whole words."""
    for name, final in final_names.items():
        text = re.sub(rf"(?<![\w.]){name}(?![\w(])", final, text)
    return text


def _coefficient_unit(model_set: ModelSet, section: str, place: str, term: LibraryTerm) -> str:
    """Return the unit of a coefficient: the unit at the place over that of the term."""
    whole = parse_unit(disturbance_unit(model_set, section, place) or "1").dimension
    scalar = ScalarNode(term.unit_expression or term.text, Span(Source("term"), 1, 1))
    kind = TreeTypes(model_set.document.root).type_of_formula(scalar)
    if isinstance(kind, Dimension):
        whole = dimension_product(whole, kind, -1)
    return format_si_unit(whole)


def _effect_text(
    model_set: ModelSet,
    name: str,
    section: str,
    terms: Sequence[LibraryTerm],
    parts: Sequence[_TermText],
    reads: Sequence[str],
) -> str:
    """Return the YAML text of an effect that adds the sum of the terms at a place of a section.

    `reads` are the names of the model that the terms use.
    """
    fits = {
        "flow": "balance: {of: rate}",
        "elements": "element: {kind: elastic}",
        "outputs": "output: {}",
    }
    whole = " + ".join(part.summand for part in parts)
    names = " and ".join(term.name for term in terms)
    lines = [
        "language: 1",
        f"effect: {name}",
        f"about: what recordings of {model_set.automaton.name} ask for beside its model, {names}",
        f"at: {{{fits[section]}}}",
        *([f"reads: [{', '.join(reads)}]"] if reads else []),
    ]
    equations = [line for part in parts for line in part.equations]
    if section == "elements":
        for name in element_torques(model_set.automaton):
            whole = re.sub(rf"\b{name}\b", "base", whole)
        equations.append(f"$torque: base + {whole}")
    if section == "outputs":
        equations.append(f"shown: $y + {whole}")
    for key in ("parameters", "states", "flow"):
        own = [line for part in parts for line in getattr(part, key)]
        lines += [f"{key}:", *(f"  {line}" for line in own)] if own else []
    lines += ["equations:", *(f"  {_quote_value(line)}" for line in equations)] if equations else []
    if section == "flow":
        lines += ["terms:", f"  $x: {{{_quote_value(f'unknown: {whole}')}}}"]
    if section == "outputs":
        lines.append("redirect: {outputs: {$y: shown}}")
    return "\n".join(lines) + "\n"


def _quote_value(line: str) -> str:
    """Return a line `key: value` with the value quoted if it contains a comma."""
    key, _, value = line.partition(": ")
    return f'{key}: "{value}"' if "," in value else line
