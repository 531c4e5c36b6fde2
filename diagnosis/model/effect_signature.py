"""Effect signature: a simulation of a base with and without an effect, under steps of one input."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from matplotlib.figure import Figure

from diagnosis.model.parameter import declared_value, free_parameters_of
from diagnosis.model.placed_effect import (
    PlacedEffect,
    automaton_with_effects,
    effect_names,
    round_scale,
)
from engine.results.mode_band import PALETTE
from engine.results.plot import Picture
from engine.results.trajectory import Trajectory
from engine.simulation.simulate import simulate
from language.expressions.number_literal import parse_quantity_literal
from language.loading.scenario_reader import read_scenario
from language.loading.system_reader import single_instance_system
from language.model.automaton import Automaton
from language.overlays.effect_place import EffectPlace, find_effect_place
from language.overlays.expand_document import Project
from language.overlays.name_types import format_si_unit
from language.text.diagnostic import Source
from language.text.document import Document
from language.text.project_files import parse_document

HORIZON = 4
"""Duration [s] of the manoeuvre: a positive step, from 1 s a negative one, from 2.5 s positive."""
DEFAULT_STEP_HEIGHTS = {"N*m": "40", "N": "100"}
"""Step height by the SI unit of the input; 1 for other units."""
MAX_OUTPUTS = 4
BLUE, RED, *_ = PALETTE


@dataclass(frozen=True)
class Signature:
    """Simulations of a base without and with an effect, its parameters as text and the step."""

    placed_effect: PlacedEffect
    step: str
    values: Mapping[str, str]
    without_effect: Trajectory
    with_effect: Trajectory


def simulate_signature(
    document: Document,
    project: Project,
    placed_effect: PlacedEffect,
    step: tuple[str, str] | None = None,
) -> Signature:
    """Return the simulations of an expanded base with and without an effect, over `HORIZON` (4 s).

    `step` is an input and its height with unit (`_default_step`). It steps to the negative height
    at 1 s and back at 2.5 s. Raises SpecError, and ValueError if the base has no such input.
    """
    base = automaton_with_effects(document, project, ())
    name, height = step or _default_step(base, placed_effect)
    if name not in base.inputs:
        raise ValueError(f"`{base.name}` has no input `{name}`: {', '.join(base.inputs)}")
    text = _scenario_text(base, name, height)
    without = _simulate(base, project, text)
    size = abs(float(parse_quantity_literal(height.removeprefix("-"), base.span).value))
    scales = _place_scales(document, base, placed_effect, without, size)
    scaled = dataclasses.replace(placed_effect, scales=scales)
    whole, values = _with_visible_effect(
        automaton_with_effects(document, project, (scaled,)), placed_effect
    )
    return Signature(
        placed_effect, f"{name} = {height}", values, without, _simulate(whole, project, text)
    )


def _place_scales(
    document: Document, base: Automaton, placed_effect: PlacedEffect, run: Trajectory, step: float
) -> dict[str, Fraction]:
    """Return the magnitudes [SI] of a place: `step` is the load, states give rate and stretch."""
    place = find_effect_place(document.root, placed_effect.effect, placed_effect.place)
    holes = place.holes if isinstance(place, EffectPlace) else {}
    texts = {key: value for key, value in holes.items() if isinstance(value, str)}
    found = {"load": step, "level": step, "time": 1.0, "period": 0.005, "horizon": float(HORIZON)}
    states = {"rate": texts.get("x") or texts.get("speed") or texts.get("angle_rate", "")}
    states["stretch"] = texts.get("twist", "")
    for name, state in states.items():
        signal = run.signals.get(f"{base.name}.{state}")
        if signal is not None:
            found[name] = float(np.sqrt(np.mean(np.asarray(signal, float) ** 2)))
    found["inertia"] = declared_value(base, texts.get("inertia", "")) or 0.0
    return {name: round_scale(value) for name, value in found.items() if value > 0.0}


def _default_step(base: Automaton, placed_effect: PlacedEffect) -> tuple[str, str]:
    """Return the input to step and its height; ValueError without inputs.

    It is the place of the effect, else the first input without a default, else the first one.
    """
    if not base.inputs:
        raise ValueError(f"`{base.name}` has no input to step")
    free = [name for name, one in base.inputs.items() if one.default is None]
    is_input = placed_effect.place in base.inputs
    name = placed_effect.place if is_input else [*free, *base.inputs][0]
    unit = format_si_unit(base.inputs[name].unit.dimension)
    return name, f"{DEFAULT_STEP_HEIGHTS.get(unit, '1')} {unit}"


def _with_visible_effect(
    whole: Automaton, placed_effect: PlacedEffect
) -> tuple[Automaton, dict[str, str]]:
    """Return the automaton and values of the effect's parameters, none of them neutral."""
    brought = effect_names(placed_effect)
    parameters, values = dict(whole.parameters), dict[str, str]()
    for one in free_parameters_of(whole, list(brought)):
        if one.name in brought:
            neutral = parameters[one.name].fitting.neutral
            is_neutral = neutral == parameters[one.name].value
            value = one.starts[-1] if one.starts and is_neutral else one.start
            exact = Fraction(repr(value))
            parameters[one.name] = dataclasses.replace(parameters[one.name], value=exact)
            unit = "" if one.unit == "1" else f" {one.unit}"
            values[one.name.removesuffix(f"_{placed_effect.suffix}")] = f"{value:.5g}{unit}"
    return dataclasses.replace(whole, parameters=parameters), values


def _scenario_text(base: Automaton, input_name: str, height: str) -> str:
    """Return the YAML scenario that steps one input and holds inputs without a default at 0."""
    back = height.removeprefix("-") if height.startswith("-") else f"-{height}"
    lines = ["language: 1", "scenario: signature", f"of: {base.name}", f"horizon: {HORIZON} s"]
    lines.append("inputs:")
    for name, one in base.inputs.items():
        if name == input_name:
            lines.append(f"  {name}: {{start: {height}, steps: {{1 s: {back}, 2.5 s: {height}}}}}")
        elif one.default is None:
            lines.append(f"  {name}: 0 {format_si_unit(one.unit.dimension)}")
    return "\n".join([*lines, "record: {every: 5 ms}", ""])


def _simulate(automaton: Automaton, project: Project, text: str) -> Trajectory:
    """Return the trajectory of a single automaton under a scenario given as text."""
    system = single_instance_system(automaton)
    document = parse_document(Source("signature", tuple(text.splitlines())), text)
    return simulate(system, read_scenario(document, project, system))


def draw_signature(signature: Signature) -> Picture:
    """Draw both simulations of the first `MAX_OUTPUTS` (4) signals with their difference below."""
    one, other = signature.without_effect, signature.with_effect
    names = [name for name in one.signals if name not in one.modes][:MAX_OUTPUTS]
    figure = Figure(figsize=(8.5, 1.0 + 2.1 * len(names)), layout="constrained")
    rows = figure.subplots(
        2 * len(names), 1, sharex=True, squeeze=False, height_ratios=[1.7, 1.0] * len(names)
    )
    for k, name in enumerate(names):
        above, beneath = rows[2 * k][0], rows[2 * k + 1][0]
        above.plot(one.times, one.signals[name], "--", color=RED, lw=1.2, label="without")
        above.plot(other.times, other.signals[name], color=BLUE, lw=1.2, label="with the effect")
        count = min(len(one.times), len(other.times))
        change = np.asarray(other.signals[name][:count], float) - one.signals[name][:count]
        beneath.plot(one.times[:count], change, color=BLUE, lw=1.1)
        beneath.axhline(0.0, color="black", lw=0.6)
        label = f"{name.partition('.')[2] or name} [{one.units[name]}]"
        above.set_ylabel(label, fontsize=9, parse_math=False)
        beneath.set_ylabel("change", fontsize=9)
        for axis in (above, beneath):
            axis.grid(alpha=0.3)
    rows[0][0].legend(loc="best", fontsize=8)
    values = ", ".join(f"{name} = {text}" for name, text in signature.values.items())
    title = f"{signature.placed_effect.id}: {values or 'no parameter'}; steps of {signature.step}"
    rows[0][0].set_title(title, loc="left", fontsize=11, parse_math=False)
    rows[-1][0].set_xlabel("time [s]")
    return Picture(figure)
