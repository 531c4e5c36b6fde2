"""Formula: terms with coefficients as an effect of the language, and as a line for a reader."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from diagnosis.bench import Bench
from diagnosis.layers import Layer
from diagnosis.probe import torques_of
from diagnosis.scale import unit_of
from diagnosis.term import Term
from diagnosis.verdict import Quantity
from language.document import Document, Scalar
from language.effect import foreign_names, read_effect
from language.finding import document_of
from language.known import Known, unit_text
from language.problem import Problems, Source, Span
from language.units import Dimension, parse_unit, product

Reals = NDArray[np.float64]
WIDE = 10.0
"""A coefficient may become this many times what the regression says."""


@dataclass(frozen=True)
class Formula:
    """An effect made of terms: `layer` can be laid, `text` is its file, `start` where a fit begins.

    `phases` are those of the recordings, by parameter.
    """

    layer: Layer
    text: str = field(repr=False)
    terms: tuple[Term, ...] = field(repr=False)
    start: Mapping[str, float] = field(repr=False)
    phases: Mapping[str, tuple[float, ...]] = field(repr=False)

    def told(self, values: Mapping[str, Quantity], fitted: Sequence[Mapping[str, float]]) -> str:
        """Return the formula with fitted values: `12.3 N*m * sin(3 * angle of w_w + 0.4)`."""
        return " + ".join(
            _told(term, k, values, [{n: v for n, v in one.items()} for one in fitted], self.layer)
            for k, term in enumerate(self.terms, 1)
        )


def formula_of(
    bench: Bench,
    section: str,
    place: str,
    terms: Sequence[Term],
    weights: Sequence[Reals],
    number: int = 1,
) -> Formula:
    """Return terms with coefficients (recordings, waves) as an effect. Raises SpecError.

    Its name has a `number`: a bench knows candidates by the names of their effects.
    """
    made = [
        _part(bench, section, place, k, *pair)
        for k, pair in enumerate(zip(terms, weights, strict=True), 1)
    ]
    name = f"unknown_{number}_at_{place}"
    text = _reading(_text(bench, name, section, terms, made))
    problems = Problems()
    effect = read_effect(_document(name, text), problems)
    problems.stop_if_any()
    layer = Layer(effect, place, place)
    start, phases = {}, {}
    for part in made:
        start.update({layer.named(name): value for name, value in part.start.items()})
        phases.update({layer.named(name): value for name, value in part.phases.items()})
    return Formula(layer, text, tuple(terms), start, phases)


def _document(name: str, text: str) -> Document:
    return document_of(Source(f"{name}.yaml", tuple(text.splitlines())), text)


def _reading(text: str) -> str:
    """Return the text of an effect that says which names of the model it reads."""
    foreign = foreign_names(_document("formula", text).root)
    head, sign, rest = text.partition("\nat: ")
    place, _, more = rest.partition("\n")
    reads = f"\nreads: [{', '.join(foreign)}]" if foreign else ""
    return f"{head}{sign}{place}{reads}\n{more}"


@dataclass(frozen=True)
class _Part:
    """The lines of one term: by section, and its summand."""

    parameters: list[str]
    states: list[str]
    flow: list[str]
    equations: list[str]
    summand: str
    start: dict[str, float]
    phases: dict[str, tuple[float, ...]]


def _part(bench: Bench, section: str, place: str, k: int, term: Term, weights: Reals) -> _Part:
    a, turns, phase = f"a_{k}", f"turns_{k}", f"ph_{k}"
    unit = _unit(bench, section, place, term)
    size = float(np.sqrt(np.mean(np.sum(weights**2, axis=1)))) or 1e-6
    value = size if term.order or term.each else float(np.mean(weights[:, 0])) or 1e-6
    each = ", per: recording" if term.each else ""
    most = f"{WIDE * size:.3g}"
    parameters = [
        f"{a}: {{value: 0, unit: {unit}, range: [-{most}, {most}], neutral: 0, "
        f"starts: [{value:.4g}]{each}}}"
    ]
    own = {name: f"{name}_{k}" for name in term.states}
    summand = f"{a} * {_renamed(term.text, own)}" if term.text != "1" else a
    equations = []
    start, phases = {a: value}, {}
    if term.each:
        phases[a] = tuple(float(one) for one in weights[:, 0])
    if term.order:
        parameters.append(f"{phase}: {{value: 0 rad, range: [-3.2, 3.2], per: recording}}")
        equations.append(f"{turns}: ({term.order} * {own['th']} + {phase}) / 1 rev")
        summand += f" * sin(({turns} - floor({turns})) * 1 rev)"
        phases[phase] = tuple(float(np.arctan2(one[1], one[0])) for one in weights)
    states = [f"{own[n]}: {{unit: {unit}, initial: 0}}" for n, (unit, _) in term.states.items()]
    flow = [f"{own[n]}: {_renamed(text, own)}" for n, (_, text) in term.states.items()]
    return _Part(parameters, states, flow, equations, summand, start, phases)


def _renamed(text: str, own: Mapping[str, str]) -> str:
    for name, final in own.items():
        text = re.sub(rf"(?<![\w.]){name}(?![\w(])", final, text)
    return text


def _unit(bench: Bench, section: str, place: str, term: Term) -> str:
    """Return the unit of a coefficient: that of the place over that of the term."""
    whole = parse_unit(unit_of(bench, section, place) or "1").dimension
    kind = Known(bench.document.root).of(Scalar(term.like or term.text, Span(Source("term"), 1, 1)))
    return unit_text(product(whole, kind, -1)) if isinstance(kind, Dimension) else unit_text(whole)


def _text(
    bench: Bench, name: str, section: str, terms: Sequence[Term], parts: Sequence[_Part]
) -> str:
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
        f"about: what recordings of {bench.automaton.name} ask for beside its model, {names}",
        f"at: {{{fits[section]}}}",
    ]
    equations = [line for part in parts for line in part.equations]
    if section == "elements":
        for name in torques_of(bench.automaton):
            whole = re.sub(rf"\b{name}\b", "base", whole)
        equations.append(f"$torque: base + {whole}")
    if section == "outputs":
        equations.append(f"shown: $y + {whole}")
    for key in ("parameters", "states", "flow"):
        own = [line for part in parts for line in getattr(part, key)]
        lines += [f"{key}:", *(f"  {line}" for line in own)] if own else []
    lines += ["equations:", *(f"  {_quoted(line)}" for line in equations)] if equations else []
    if section == "flow":
        lines += ["terms:", f"  $x: {{unknown: {_flowed(whole)}}}"]
    if section == "outputs":
        lines.append("redirect: {outputs: {$y: shown}}")
    return "\n".join(lines) + "\n"


def _quoted(line: str) -> str:
    key, _, value = line.partition(": ")
    return f'{key}: "{value}"' if "," in value else line


def _flowed(text: str) -> str:
    return f'"{text}"' if "," in text else text


def _told(
    term: Term,
    k: int,
    values: Mapping[str, Quantity],
    fitted: Sequence[Mapping[str, float]],
    layer: Layer,
) -> str:
    amount = values[layer.named(f"a_{k}")]
    unit = "" if amount.unit == "1" else f" {amount.unit}"
    own = [one[layer.named(f"a_{k}")] for one in fitted]
    number = f"{amount.value:.4g}{unit}"
    if term.each:
        number = f"{{{', '.join(f'{one:.3g}' for one in own)}}}{unit}"
    factor = "" if term.text == "1" else f" * {term.text}"
    if not term.order:
        late = f" ({term.name})" if term.states else ""
        return number + factor + late
    rate = next(iter(term.states.values()))[1].split("= ")[1]
    phases = [one[layer.named(f"ph_{k}")] for one in fitted]
    phase = f"{phases[0]:.2f}" if len(phases) == 1 else "phase"
    return f"{number}{factor} * sin({term.order} * angle of {rate} + {phase})"
