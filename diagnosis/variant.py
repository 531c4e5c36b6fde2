"""Variant: what a diagnosis has found, as a variant of the base that every command runs."""

from __future__ import annotations

import json
from collections.abc import Mapping
from fractions import Fraction

from codegen.rendering import version
from diagnosis.dossier import Dossier
from diagnosis.layers import automaton as laid_automaton
from diagnosis.naming import quantities_of
from diagnosis.search import Tried
from diagnosis.selection import Selection
from diagnosis.uncertain import si_unit
from diagnosis.verdict import Quantity
from diagnosis.wording import rounded
from language.declaration import Parameter
from language.effect import Effect, own_names
from language.model import Automaton
from language.project import read_document

ENDING = "_diagnosed"
LONGEST_NAME = 31
UNCHANGED = 1e-6
"""Relative change below which a parameter is not written down."""


def variant_name(base: str, ending: str = ENDING) -> str:
    """Return the name of the variant of a base, or of what goes with it."""
    return base[: LONGEST_NAME - len(ending)] + ending


def variant_text(dossier: Dossier, extends: str) -> str:
    """Return the variant as YAML: `extends` names the base, or its file.

    Values are in SI; standard deviations and what was declared stand beside them as comments.
    """
    lines = [
        "language: 1",
        f"variant: {variant_name(dossier.name)}",
        f"extends: {extends}",
        f"about: {json.dumps(_about(dossier), ensure_ascii=False)}",
    ]
    if dossier.diagnosis is None:
        return "\n".join(lines) + "\n"
    lines += [f"# {text}" for text in needed(dossier)]
    selection = dossier.diagnosis.selection
    fitted = quantities_of(selection.model)
    lines += _parameters(dossier.automaton, fitted)
    lines += _effects(dossier, selection, fitted)
    return "\n".join(lines) + "\n"


def needed(dossier: Dossier) -> list[str]:
    """Return what has to be done before the variant can be read: its effects found by name."""
    names = [effect.body.span.source.name for effect in missing(dossier)]
    return [f"{name} has to be below spec/: the variant lays this effect by name" for name in names]


def missing(dossier: Dossier) -> list[Effect]:
    """Return the accepted effects that the project does not have, or has with another text."""
    project = dossier.case.project
    accepted = dossier.diagnosis.selection.accepted if dossier.diagnosis else ()
    found = []
    for effect in (tried.layer.effect for tried in accepted):
        own = effect.body.span.source
        files = [read_document(path) for path in project.effects.get(effect.name, ())]
        if not any(file.source.lines == own.lines for file in files):
            found.append(effect)
    return found


def _about(dossier: Dossier) -> str:
    verdict = dossier.verdict
    found = [f"{one.id}@{one.place}" for one in verdict.effects]
    says = ", ".join([verdict.verdict, *found])
    files = ", ".join(f"{name} {digest}" for name, digest in verdict.inputs.items())
    return f"diagnosed by modewright {version()}: {says}; fitted to {files}"


def _parameters(automaton: Automaton, fitted: Mapping[str, Quantity]) -> list[str]:
    lines = []
    for name, quantity in fitted.items():
        parameter = automaton.parameters.get(name)
        if parameter is None or parameter.value is None:
            continue
        was = float(parameter.value)
        if abs(quantity.value - was) > UNCHANGED * abs(was):
            text = value_text(quantity.value, parameter)
            told = f"sd {rounded(quantity.std)}, declared {was:.6g}"
            lines.append(f"  {name}: {{value: {text}}}  # {told}")
    return ["parameters:", *lines] if lines else []


def _effects(dossier: Dossier, selection: Selection, fitted: Mapping[str, Quantity]) -> list[str]:
    if not selection.accepted:
        return []
    layers = selection.model.candidate.layers
    whole = laid_automaton(dossier.case.document, dossier.case.project, layers)
    lines = ["effects:"]
    for tried in selection.accepted:
        lines += _effect(tried, whole, selection, fitted)
    return lines


def _effect(
    tried: Tried, whole: Automaton, selection: Selection, fitted: Mapping[str, Quantity]
) -> list[str]:
    layer, brought = tried.layer, own_names(tried.layer.effect.body)
    lines = [f"  {layer.id}:  # {layer.effect.about}"]
    each = [selection.model.values(k) for k in range(len(selection.model.point.own))]
    values = []
    for final, quantity in fitted.items():
        own = final.removesuffix(f"_{layer.ending}")
        parameter = whole.parameters.get(final)
        if own not in brought or layer.named(own) != final or parameter is None:
            continue
        text = value_text(quantity.value, parameter)
        note = f"sd {rounded(quantity.std)}"
        if parameter.fitting.per == "recording":
            note = "mean of " + ", ".join(f"{one[final]:.4g}" for one in each)
        values.append(f"      {own}: {text}  # {note}")
    return [*lines, "    values:", *values] if values else [f"  {layer.id}: {{}}"]


def value_text(value: float, parameter: Parameter) -> str:
    """Return a value in SI with its unit, rounded, but not out of its range."""
    text = f"{value:.6g}"
    if parameter.range:
        low, high = parameter.range
        if not low <= Fraction(text) <= high:
            text = repr(min(max(value, float(low)), float(high)))
    unit = si_unit(parameter)
    return text if unit == "1" else f"{text} {unit}"
