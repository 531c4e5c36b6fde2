"""Machines drawn at random, their naive specs and maps, and the sensors."""

from dataclasses import dataclass
from math import ceil, pi, sqrt

import numpy as np

from .simulation import Array, vector

RATES = (250.0, 400.0, 500.0, 609.7, 800.0, 1000.0, 1250.0, 1628.3, 2000.0, 4000.0)  # Hz
LARGEST_STEP = 2e-4  # s, of the truth
EXACT = {"M_c": "M2", "r": ""}  # known to the engineer: weighed, from the drawing


@dataclass(frozen=True)
class Machine:
    """A drawn machine in SI units: metres and newtons (belt) or radians and newton metres."""

    kind: str  # "belt" or "rotary"
    rate: float  # Hz, of the controller and of the recording
    nominal: dict[str, float]  # of the spec; those in `base` are uncertain
    base: dict[str, float]  # true values
    v_max: float
    a_max: float
    half: float  # half of the travel
    f_max: float  # limit of the command
    w_loop: float  # rad/s, bandwidth of the speed loop
    w_high: float  # rad/s, resonance of the belt, or upper end of the excitation
    pulley: float  # m, radius; 1 for the table
    scale: float  # N/A or N*m/A, of the recorded current command
    lsb: float  # step of the command
    noise: tuple[float, ...]  # standard deviation of each signal
    quantum: tuple[float, ...]  # quantisation of each signal

    @property
    def signals(self) -> tuple[str, ...]:
        """Names of the outputs of the spec."""
        return ("v_m", "v_c") if self.kind == "belt" else ("w",)

    @property
    def inertia(self) -> float:
        """True mass or inertia that the motor moves [kg or kg*m^2]."""
        return self.base["M_m"] + self.nominal["M_c"] if self.kind == "belt" else self.base["J"]

    @property
    def load(self) -> float:
        """Mass or inertia of the body that carries the load."""
        return self.nominal["M_c"] if self.kind == "belt" else self.base["J"]

    @property
    def substeps(self) -> int:
        """Integration steps of the truth per sample."""
        return ceil(1 / self.rate / LARGEST_STEP)

    def mechanics(self, base: dict[str, float] | None = None) -> dict[str, float]:
        """Slots of the machine with these base parameters, the true ones by default."""
        b = base or self.base
        if self.kind == "rotary":
            return {"ROTARY": 1.0, "M1": b["J"], "B1": b["b"]}
        names = {"M1": "M_m", "B1": "b_m", "B2": "b_c", "K": "k", "C": "c"}
        return {"M2": self.nominal["M_c"]} | {slot: b[name] for slot, name in names.items()}

    def slots(self) -> dict[str, float]:
        """Slots of the true machine without an effect, with its controller."""
        gain = self.inertia * self.w_loop
        quantum = {f"QUANT{i}": q for i, q in enumerate(self.quantum)}
        control = {"KP": self.w_loop / 4, "KV": gain, "KI": gain * self.w_loop / 6}
        control |= {"MFF": 0.9 * self.inertia, "FMAX": self.f_max, "LSB": self.lsb}
        return self.mechanics() | control | quantum

    def parameters(self, effect: dict[str, float] | None = None) -> Array:
        """The parameter vector of the truth with the slots of an effect."""
        return vector(self.slots() | (effect or {}))


def rounded(value: float, digits: int = 3) -> float:
    """The value with so many significant digits, as a data sheet states it."""
    return float(f"{value:.{digits - 1}e}")


def _truth(rng: np.random.Generator, nominal: dict[str, float]) -> dict[str, float]:
    uncertain = [name for name in nominal if name not in EXACT]
    sign = rng.choice([-1.0, 1.0], len(uncertain))
    wrong = 1 + sign * rng.uniform(0.05, 0.2, len(uncertain))
    return {name: nominal[name] * float(f) for name, f in zip(uncertain, wrong, strict=True)}


def draw_machine(rng: np.random.Generator, kind: str) -> Machine:
    """A machine of this kind, of a random size."""
    return _draw_belt(rng) if kind == "belt" else _draw_table(rng)


def _draw_belt(rng: np.random.Generator) -> Machine:
    rate = float(rng.choice(RATES))
    carriage = rounded(0.3 * (400 / 0.3) ** rng.uniform())
    motor = carriage * rng.uniform(0.35, 1.0)
    anti = 2 * pi * 22 * carriage**-0.1 * rng.uniform(0.65, 1.35)  # rad/s, sqrt(k / M_c)
    anti = min(anti, 2 * pi * rate / 11)
    drag = (motor + carriage) / rng.uniform(0.5, 2.0)
    share = rng.uniform(0.35, 0.6)
    nominal = {
        "M_m": motor,
        "M_c": carriage,
        "b_m": drag * share,
        "b_c": drag * (1 - share),
        "k": carriage * anti**2,
        "c": 2 * rng.uniform(0.02, 0.06) * carriage * anti,
    }
    nominal = {name: rounded(value) for name, value in nominal.items()}
    base = _truth(rng, nominal)
    total = base["M_m"] + carriage
    v_max = rng.uniform(0.6, 2.5)
    a_max = min(v_max * rng.uniform(5, 12), 5500 / total)
    f_max = 1.6 * total * a_max + drag * v_max
    r = rounded(0.012 * (total / 0.4) ** 0.2 * rng.uniform(0.8, 1.3))
    noise = (v_max * rng.uniform(0.0006, 0.0016), v_max * rng.uniform(0.0006, 0.002))
    lsb, scale = _current(rng, f_max)
    return Machine(
        kind="belt",
        rate=rate,
        nominal=nominal | {"r": r},
        base=base,
        v_max=v_max,
        a_max=a_max,
        half=v_max * rng.uniform(0.35, 0.6),
        f_max=f_max,
        w_loop=min(0.4 * anti, rate / 12),
        w_high=anti * sqrt(1 + carriage / motor),
        pulley=r,
        scale=scale,
        lsb=lsb,
        noise=noise,
        quantum=tuple(s * float(rng.uniform(0.1, 0.6)) for s in noise),
    )


def _draw_table(rng: np.random.Generator) -> Machine:
    rate = float(rng.choice(RATES))
    inertia = rounded(4e-5 * 8 ** rng.uniform())
    torque = 0.03 * 4 ** rng.uniform()
    nominal = {"J": inertia, "b": rounded(inertia / rng.uniform(0.4, 1.5))}
    a_max = 0.6 * torque / inertia
    v_max = min(a_max * rng.uniform(0.08, 0.15), 0.3 * torque / nominal["b"])
    noise = (v_max * rng.uniform(0.001, 0.004),)
    lsb, scale = _current(rng, torque)
    return Machine(
        kind="rotary",
        rate=rate,
        nominal=nominal,
        base=_truth(rng, nominal),
        v_max=v_max,
        a_max=a_max,
        half=v_max * rng.uniform(0.4, 0.8),
        f_max=torque,
        w_loop=min(rng.uniform(30, 80), rate / 12),
        w_high=2 * pi * rng.uniform(25, 45),
        pulley=1.0,
        scale=scale,
        lsb=lsb,
        noise=noise,
        quantum=(noise[0] * float(rng.uniform(0.1, 0.6)),),
    )


def _current(rng: np.random.Generator, f_max: float) -> tuple[float, float]:
    """Step of the command [N or N*m] and the drive constant [N/A or N*m/A]."""
    scale = rounded(f_max / (2.0 * 15 ** rng.uniform()), 4)
    return scale * round(f_max / scale / 2 ** int(rng.integers(13, 16)), 6), scale


def _number(value: float) -> str:
    text = f"{value:.6g}"
    if "e" in text:
        mantissa, exponent = text.split("e")
        text = f"{mantissa if '.' in mantissa else mantissa + '.0'}e{int(exponent)}"
    return text


def spec_text(machine: Machine) -> str:
    """The naive spec of this machine."""
    n = {name: _number(value) for name, value in machine.nominal.items()}
    for name in machine.base:
        low, high = (_number(rounded(machine.nominal[name] * f)) for f in (0.65, 1.5))
        n[f"{name}_range"] = f"[{low}, {high}]"
    step = "0.5 ms" if machine.rate <= 1000 else "0.25 ms"
    weight = _number(rounded(machine.load * 9.81))
    return (BELT if machine.kind == "belt" else TABLE).format(step=step, weight=weight, **n)


def map_text(machine: Machine) -> str:
    """The map of the columns of this machine."""
    text = BELT_MAP if machine.kind == "belt" else TABLE_MAP
    return text.format(scale=_number(machine.scale), r=_number(machine.pulley))


def columns(machine: Machine, command: Array, measured: Array) -> dict[str, Array]:
    """The columns of a recording, in the units of the file."""
    time = np.arange(len(command)) / machine.rate
    if machine.kind == "rotary":
        speed = {"table_radps": measured[:, 0]}
    else:
        rpm = measured[:, 0] / machine.pulley * 30 / pi
        speed = {"motor_rpm": rpm, "carriage_mmps": measured[:, 1] * 1e3}
    return {"t_s": time, "iq_cmd_A": command / machine.scale} | speed


BELT = """\
language: 1
automaton: belt_axis
about: position servo axis, carriage on a rail driven by a toothed belt, seen at the pulley rim
step: {step}
parameters:                                  # those with a range are uncertain, the others exact
  M_m: {{value: {M_m} kg, range: {M_m_range}, about: "motor and pulley, reduced to the rim"}}
  M_c: {{value: {M_c} kg, about: "carriage with load, weighed"}}
  b_m: {{value: {b_m} N*s/m, range: {b_m_range}}}
  b_c: {{value: {b_c} N*s/m, range: {b_c_range}}}
  k:   {{value: {k} N/m, range: {k_range}, about: belt}}
  c:   {{value: {c} N*s/m, range: {c_range}}}
inputs:
  F_m: {{unit: N, about: current command times force constant}}
states:
  v_m: {{unit: m/s, initial: 0 m/s, about: pulley rim}}
  v_c: {{unit: m/s, initial: 0 m/s}}
  s:   {{unit: m, initial: 0 m, about: stretch of the belt}}
equations:
  v_d: v_m - v_c
  F_b: k * s + c * v_d
  F_r: b_c * v_c
flow:
  v_m: M_m * der(v_m) = F_m - F_b - b_m * v_m
  v_c: M_c * der(v_c) = F_b - F_r
  s:   der(s) = v_d
elements:
  belt:
    {{kind: elastic, twist: s, rate: v_d, torque: F_b, stiffness: k, damping: c, angle_rate: v_c}}
  carriage: {{kind: inertia, speed: v_c, inertia: M_c, far: [F_r]}}
places:
  v_m: {{load: F_b, angle_rate: v_m}}
  v_c: {{weight: {weight} N, angle_rate: v_c}}
  F_m: {{angle_rate: v_m}}
outputs: [v_m, v_c]
"""

TABLE = """\
language: 1
automaton: rotary_table
about: small rotary table on the shaft of its motor
step: {step}
parameters:
  J: {{value: {J} kg*m^2, range: {J_range}}}
  b: {{value: {b} N*m*s/rad, range: {b_range}}}
inputs:
  T_m: {{unit: N*m, about: current command times torque constant}}
states:
  w: {{unit: rad/s, initial: 0 rad/s}}
flow:
  w: J * der(w) = T_m - b * w
elements:
  table: {{kind: inertia, speed: w, inertia: J}}
places:
  w:   {{angle_rate: w}}
  T_m: {{angle_rate: w}}
outputs: [w]
"""

BELT_MAP = """\
language: 1
map: belt_axis_columns
about: current command of the drive, speed of the motor encoder, laser vibrometer on the carriage
time: {{column: t_s, unit: s}}
columns:
  iq_cmd_A:      {{to: F_m, unit: A, scale: {scale} N/A}}
  motor_rpm:     {{compare: v_m, unit: rpm, scale: {r} m/rad}}
  carriage_mmps: {{compare: v_c, unit: mm/s}}
"""

TABLE_MAP = """\
language: 1
map: rotary_table_columns
about: current command of the drive and speed of the table
time: {{column: t_s, unit: s}}
columns:
  iq_cmd_A:    {{to: T_m, unit: A, scale: {scale} N*m/A}}
  table_radps: {{compare: w, unit: rad/s}}
"""
