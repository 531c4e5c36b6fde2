"""Models: a small fixed set that random sampled automata run and observe."""

from __future__ import annotations

from dataclasses import dataclass
from random import Random

MASS = """\
language: 1
automaton: mass
parameters: {k_w: {value: 40 1/s^2}, c: {value: 2 1/s}, e: {value: 0.7}}
inputs: {push: {unit: m/s^2, default: 0 m/s^2, range: [-90, 90]}}
states:
  pos: {unit: m, initial: 0 m, range: [-5, 5]}
  vel: {unit: m/s, initial: 0 m/s, range: [-60, 60]}
flow: {pos: der(pos) = vel}
initial: free
modes:
  free:
    number: 0
    flow: {vel: der(vel) = push - c * vel}
    transitions: {wall: {when: pos >= 0.2 m and vel > 0 m/s}}
  wall:
    number: 1
    flow: {vel: der(vel) = push - c * vel - k_w * (pos - 0.2 m)}
    transitions: {free: {when: pos <= 0.2 m and vel < 0 m/s, reset: {vel: e * vel}}}
outputs: [pos, vel, mode]
"""
SWING = """\
language: 1
automaton: swing
parameters: {g: {value: 30 1/s^2}, c: {value: 1.5 1/s}}
inputs: {twist: {unit: rad/s^2, default: 0 rad/s^2, range: [-90, 90]}}
states:
  ang: {unit: rad, initial: 0.1 rad, range: [-4, 4]}
  rate: {unit: rad/s, initial: 0 rad/s, range: [-60, 60]}
flow: {ang: der(ang) = rate}
initial: left
modes:
  left:
    number: 0
    flow: {rate: der(rate) = twist - c * rate - g * 1 rad * sin(ang)}
    transitions: {right: {when: ang > 0.3 rad and rate > 0 rad/s, reset: {rate: -0.5 * rate}}}
  right:
    number: 1
    flow: {rate: der(rate) = twist - c * rate - g * ang}
    transitions: {left: {when: ang < 0.1 rad and rate < 0 rad/s}}
outputs: [ang, rate, mode]
"""
METHODS = ("euler", "midpoint", "midpoint", "rk4", "exact", "exponential")


@dataclass(frozen=True)
class PlantModel:
    """A model: names and units of its two states and its input, its modes, what may run it."""

    name: str
    text: str
    states: tuple[tuple[str, str, int], ...]
    force: tuple[str, str]
    modes: tuple[str, str]
    methods: tuple[str, ...]


PLANT_MODELS = (
    PlantModel(
        "mass",
        MASS,
        (("pos", "m", 5), ("vel", "m/s", 60)),
        ("push", "m/s^2"),
        ("free", "wall"),
        METHODS,
    ),
    PlantModel(
        "swing",
        SWING,
        (("ang", "rad", 4), ("rate", "rad/s", 60)),
        ("twist", "rad/s^2"),
        ("left", "right"),
        ("euler", "midpoint", "rk4", "exponential"),
    ),
)


def method_of(draw: Random, model: PlantModel) -> str:
    """Return the method and the number of substeps of all runs of an automaton."""
    return f"{draw.choice(model.methods)}, substeps: {draw.randint(1, 2)}"


def advance(draw: Random, model: PlantModel, method: str) -> tuple[list[str], str]:
    """Return the lines of a mode that say who carries the states, and a guard on the run or ''."""
    mode = draw.choice(model.modes)
    if draw.random() < 0.6:
        follow = draw.random() < 0.8
        run = f"of: {model.name}.{mode}, method: {method}"
        run += f", events: {draw.randint(1, 4)}" if follow else ", follow: false"
        guard = f"in({model.name}.{draw.choice(model.modes)})" if follow else ""
        return [f"    runs: {{{run}}}"], guard
    (first, unit, _), (second, _, _) = model.states
    gain = draw.choice(("steady", "recursive"))
    more = f", covariance: {draw.choice(('keep', 'steady'))}" if gain == "recursive" else ""
    lines = [
        "    observer:",
        f"      of: {model.name}.{mode}",
        f"      kalman: {{states: [{first}, {second}], gain: {gain}{more}}}",
        f"      measures: {{y_p: {first}}}",
        f"      process_noise: {{{first}: 0.001 {unit}^2/s, {second}: q}}",
        "      measurement_noise: {y_p: r}",
    ]
    if model.name == "swing":
        lines.insert(3, f"      at: {{{first}: 0.05 {unit}}}")
    if gain == "recursive" and draw.random() < 0.5:
        lines.append("      correct: go")
    return lines, ""
