"""Signature: how an effect shows - a base and the same with the effect, under steps of an input."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from matplotlib.figure import Figure

from diagnosis.layers import Layer, automaton as laid_automaton
from diagnosis.naming import brought_by
from diagnosis.uncertain import uncertain_of
from engine.band import PALETTE
from engine.plot import Picture
from engine.simulate import simulate
from engine.trajectory import Trajectory
from language.document import Document
from language.finding import document_of
from language.known import unit_text
from language.model import Automaton
from language.problem import Source
from language.project import Project
from language.scenario import read_scenario
from language.system import around

HORIZON = 4
"""Time of the manoeuvre [s]: forwards, from 1 s backwards, from 2.5 s forwards again."""
USUAL = {"N*m": "40", "N": "100"}
"""Height of the steps by the unit of the input, 1 for others."""
MOST_OUTPUTS = 4
BLUE, RED, *_ = PALETTE


@dataclass(frozen=True)
class Signature:
    """Runs of a base without and with an effect; `values` are its parameters, with units."""

    layer: Layer
    stepped: str
    values: Mapping[str, str]
    without: Trajectory
    with_it: Trajectory


def signature(
    document: Document, project: Project, layer: Layer, step: tuple[str, str] | None = None
) -> Signature:
    """Return an effect's signature over an expanded base; `step` is an input and its height.

    Raises SpecError, ValueError.
    """
    base = laid_automaton(document, project, ())
    name, height = step or _usual_step(base, layer)
    if name not in base.inputs:
        raise ValueError(f"`{base.name}` has no input `{name}`: {', '.join(base.inputs)}")
    whole, values = _visible(laid_automaton(document, project, (layer,)), layer)
    text = _scenario(base, name, height)
    runs = [_run(one, project, text) for one in (base, whole)]
    return Signature(layer, f"{name} = {height}", values, *runs)


def _usual_step(base: Automaton, layer: Layer) -> tuple[str, str]:
    """Return the input that the effect is laid on, else the first one that has no default."""
    if not base.inputs:
        raise ValueError(f"`{base.name}` has no input to step")
    free = [name for name, one in base.inputs.items() if one.default is None]
    name = layer.place if layer.place in base.inputs else next(iter([*free, *base.inputs]))
    unit = unit_text(base.inputs[name].unit.dimension)
    return name, f"{USUAL.get(unit, '1')} {unit}"


def _visible(whole: Automaton, layer: Layer) -> tuple[Automaton, dict[str, str]]:
    """Return an automaton in which the effect's parameters are away from where it vanishes."""
    brought = brought_by(layer)
    parameters, values = dict(whole.parameters), dict[str, str]()
    for one in uncertain_of(whole, list(brought)):
        if one.name in brought:
            neutral = parameters[one.name].fitting.neutral
            is_neutral = neutral == parameters[one.name].value
            value = one.starts[-1] if one.starts and is_neutral else one.start
            exact = Fraction(repr(value))
            parameters[one.name] = dataclasses.replace(parameters[one.name], value=exact)
            unit = "" if one.unit == "1" else f" {one.unit}"
            values[one.name.removesuffix(f"_{layer.ending}")] = f"{value:.5g}{unit}"
    return dataclasses.replace(whole, parameters=parameters), values


def _scenario(base: Automaton, stepped: str, height: str) -> str:
    back = height.removeprefix("-") if height.startswith("-") else f"-{height}"
    lines = ["language: 1", "scenario: signature", f"of: {base.name}", f"horizon: {HORIZON} s"]
    lines.append("inputs:")
    for name, one in base.inputs.items():
        if name == stepped:
            lines.append(f"  {name}: {{start: {height}, steps: {{1 s: {back}, 2.5 s: {height}}}}}")
        elif one.default is None:
            lines.append(f"  {name}: 0 {unit_text(one.unit.dimension)}")
    return "\n".join([*lines, "record: {every: 5 ms}", ""])


def _run(automaton: Automaton, project: Project, text: str) -> Trajectory:
    system = around(automaton)
    document = document_of(Source("signature", tuple(text.splitlines())), text)
    return simulate(system, read_scenario(document, project, system))


def signature_picture(found: Signature) -> Picture:
    """Return both runs, output by output, and beneath each what the effect changes."""
    names = [name for name in found.without.signals if name not in found.without.modes]
    names = names[:MOST_OUTPUTS]
    figure = Figure(figsize=(8.5, 1.0 + 2.1 * len(names)), layout="constrained")
    rows = figure.subplots(
        2 * len(names), 1, sharex=True, squeeze=False, height_ratios=[1.7, 1.0] * len(names)
    )
    for k, name in enumerate(names):
        above, beneath = rows[2 * k][0], rows[2 * k + 1][0]
        one, other = found.without, found.with_it
        above.plot(one.times, one.signals[name], "--", color=RED, lw=1.2, label="without")
        above.plot(other.times, other.signals[name], color=BLUE, lw=1.2, label="with the effect")
        count = min(len(one.times), len(other.times))
        change = np.asarray(other.signals[name][:count], float) - one.signals[name][:count]
        beneath.plot(one.times[:count], change, color=BLUE, lw=1.1)
        beneath.axhline(0.0, color="black", lw=0.6)
        label = f"{name.partition('.')[2] or name} [{found.without.units[name]}]"
        above.set_ylabel(label, fontsize=9, parse_math=False)
        beneath.set_ylabel("change", fontsize=9)
        for axis in (above, beneath):
            axis.grid(alpha=0.3)
    rows[0][0].legend(loc="best", fontsize=8)
    values = ", ".join(f"{name} = {text}" for name, text in found.values.items())
    title = f"{found.layer.id}: {values or 'no parameter'}; steps of {found.stepped}"
    rows[0][0].set_title(title, loc="left", fontsize=11, parse_math=False)
    rows[-1][0].set_xlabel("time [s]")
    return Picture(figure)
