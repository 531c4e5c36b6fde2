"""Rig: a model with effects laid, run through steps of its inputs."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import modewright as mw
from tests.language.spec_builders import project_of

ROTOR = """language: 1
automaton: rotor
about: one inertia, driven and loaded
parameters: {J: {value: 2 kg*m^2}, w_t: {value: 10 rad/s}, G: {value: 30 N*m}}
inputs: {T: {unit: N*m}, T_b: {unit: N*m, default: 0 N*m}}
states: {w: {unit: rad/s, initial: 0 rad/s}, x: {unit: rad, initial: 0 rad}}
equations: {T_l: G * 0, rate: w + 0 rad/s}
flow:
  w: J * der(w) = T - T_l
  x: der(x) = rate
modes: {only: {}}
elements: {body: {kind: inertia, speed: w, inertia: J, far: [T_l]}}
places: {w: {weight: G, load: T, brake: T_b}, T: {angle_rate: w_t}}
outputs: [w, x, T_l]
"""
SHAFT = """language: 1
automaton: shaft
about: a spring and damper, twisted at a given rate
parameters: {k: {value: 400 N*m/rad}, c: {value: 20 N*m*s/rad}, w_t: {value: 10 rad/s}}
inputs: {v: {unit: rad/s}}
states: {x: {unit: rad, initial: 0 rad}}
equations: {rate: v + 0 rad/s, T_s: k * x + c * rate}
flow: {x: der(x) = rate}
modes: {only: {}}
elements:
  spring:
    {kind: elastic, twist: x, rate: rate, torque: T_s, stiffness: k, damping: c, angle_rate: w_t}
outputs: [x, T_s, rate]
"""
BASES = {"rotor": ROTOR, "shaft": SHAFT}


def run_with_effects(
    folder: Path,
    base: str,
    effects: str,
    inputs: Mapping[str, str],
    *,
    horizon: str = "1 s",
    initial: str = "{}",
    more: str = "",
) -> mw.Trajectory:
    """Return the trajectory of a base (`rotor`, `shaft` or one that is shipped) with effects.

    `inputs` are stimuli as a scenario has them, `more` is a body of the variant.
    """
    names = "\n".join(f"  {name}: {{unit: {_unit(name)}}}" for name in inputs)
    wires = "\n".join(f"  plant.{name}: {name}" for name in inputs)
    given = "\n".join(f"  {name}: {value}" for name, value in inputs.items())
    texts = {
        **BASES,
        "laid": f"language: 1\nvariant: laid\nextends: {base}\n{more}\neffects: {effects}\n",
        "rig": f"language: 1\nsystem: rig\ninputs:\n{names}\n"
        f"instances: {{plant: {{of: laid}}}}\nconnections:\n{wires}\n",
        "run": f"language: 1\nscenario: run\nof: rig\nhorizon: {horizon}\ninitial: {initial}\n"
        f"inputs:\n{given}\nrecord: {{every: 10 ms}}\n",
    }
    project_of(folder, **texts)
    return mw.simulate("rig", "run", root=folder)


def _unit(name: str) -> str:
    return "rad/s" if name == "v" else "N*m"
