"""The true effects: what each does to the machine, as a function of one size.

At size 0 an effect is absent, and strength multiplies the size. F stands for the force [N] of the
belt axis or the torque [N*m] of the rotary table, v for its speed [m/s or rad/s].
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import pi
from typing import Any

import numpy as np

from .machines import Machine
from .manoeuvres import Plan
from .simulation import Array

Slots = dict[str, float]


@dataclass(frozen=True)
class Context:
    """What the draw of an effect may use; the peaks are those of the clean runs."""

    rng: np.random.Generator
    machine: Machine
    place: str
    f_peak: float  # of the command
    f_rms: float
    p_peak: float  # largest product of command and motor speed
    plans: list[Plan]

    def uniform(self, low: float, high: float) -> float:
        """A number between the limits."""
        return float(self.rng.uniform(low, high))


@dataclass(frozen=True)
class Draw:
    """An effect with all but its size drawn."""

    typical: float  # first guess of the size
    largest: float  # what the machine can physically have
    slots: Callable[[float], Slots]
    label: Callable[[float], dict[str, Any]]
    shapes: list[Array] | None = None  # per plan: the disturbance of size 1


@dataclass(frozen=True)
class Effect:
    """An effect of the list: its places per kind of machine, and how it is drawn."""

    places: dict[str, str]
    draw: Callable[[Context], Draw]


EFFECTS: dict[str, Effect] = {}
Drawer = Callable[[Context], Draw]


def effect(name: str, belt: str = "", rotary: str = "") -> Callable[[Drawer], Drawer]:
    """Register an effect at these places of the two machines."""
    places = {kind: place for kind, place in (("belt", belt), ("rotary", rotary)) if place}

    def register(draw: Drawer) -> Drawer:
        EFFECTS[name] = Effect(places, draw)
        return draw

    return register


def _simple(typical: float, largest: float, slot: str, name: str, **more: float) -> Draw:
    """An effect whose size is one slot; `more` are further slots, also in the label."""
    return Draw(
        typical,
        largest,
        lambda s: {slot: s} | more if s else {},
        lambda s: {name: s} | {k.lower(): v for k, v in more.items() if k != "S_WHICH"},
    )


# Between the recorded command and the machine.


@effect("actuator_lag", "inputs.F_m", "inputs.T_m")
def _lag(c: Context) -> Draw:
    """First-order lag of the closed current loop: Leonhard 2001, Control of Electrical Drives."""
    return _simple(2e-3, 0.5 / c.machine.w_loop, "U_LAG", "tau_s")


@effect("actuator_delay", "inputs.F_m", "inputs.T_m")
def _delay(c: Context) -> Draw:
    """Transport delay of bus, computation and PWM: Buso, Mattavelli 2006."""
    return _simple(2e-3, 0.5 / c.machine.w_loop, "U_DELAY", "delay_s")


@effect("torque_rate_limit", "inputs.F_m", "inputs.T_m")
def _rate(c: Context) -> Draw:
    """The slope of the current is limited by voltage over inductance: Leonhard 2001."""
    return Draw(
        0.02,
        3.0 / c.machine.w_loop,
        lambda s: {"U_RATE": c.f_peak / s} if s else {},
        lambda s: {"rate_per_s": c.f_peak / s if s else None, "time_to_peak_s": s},
    )


@effect("torque_derating", "inputs.F_m", "inputs.T_m")
def _derating(c: Context) -> Draw:
    """Limits of current, of power (field weakening) or after heating (i2t): Leonhard 2001."""
    kind = str(c.rng.choice(["magnitude", "power", "temperature"]))
    tau, peak = c.uniform(1.0, 3.0), c.f_peak
    heat = {"HEAT_TAU": tau, "HEAT_REF": c.f_rms, "HEAT_ON": 0.3, "HEAT_FULL": 0.9}

    def slots(s: float) -> Slots:
        if not s:
            return {}
        if kind == "magnitude":
            return {"U_LIMIT": peak * (1 - s)}
        if kind == "power":
            return {"U_POWER": c.p_peak * (1 - s)}
        return heat | {"HEAT_LIMIT": s, "HEAT_PEAK": peak}

    return Draw(0.3, 0.85, slots, lambda s: {"kind": kind, "reduction": s, "peak": peak})


@effect("torque_drift", "inputs.F_m", "inputs.T_m")
def _drift(c: Context) -> Draw:
    """Magnets and copper warm up, the torque constant falls: Sebastian 1995."""
    tau, start = c.uniform(2.0, 6.0), c.uniform(0, 0.2)
    more = {"HEAT_TAU": tau, "HEAT_REF": c.f_rms, "HEAT_START": start}
    draw = _simple(0.05, 0.5, "HEAT_GAIN", "loss_of_gain", **more)
    filled = {"HEAT_ON": 0.0, "HEAT_FULL": 1.0}
    return Draw(draw.typical, draw.largest, lambda s: draw.slots(s) | filled, draw.label)


@effect("torque_gain", "inputs.F_m")
def _gain(c: Context) -> Draw:
    """A wrong drive constant; the weighed carriage fixes it: Gautier, Briot 2014."""
    sign = float(c.rng.choice([-1, 1]))
    return Draw(0.1, 0.4, lambda s: {"U_GAIN": sign * s}, lambda s: {"gain": 1 + sign * s})


@effect("torque_offset", "inputs.F_m", "inputs.T_m")
def _offset(c: Context) -> Draw:
    """Offset of the current measurement: Holtz, Springob 1996."""
    sign = float(c.rng.choice([-1, 1]))
    size = 0.3 * c.f_peak
    return Draw(
        0.01 * c.f_peak, size, lambda s: {"U_OFFSET": sign * s}, lambda s: {"offset": sign * s}
    )


@effect("torque_ripple", "inputs.F_m", "inputs.T_m")
def _ripple(c: Context) -> Draw:
    """Cogging, two harmonics of the slots per turn: Jahns, Soong 1996."""
    per_turn = float(c.rng.choice([4, 6, 8, 12]))
    return _simple(
        0.03 * c.f_peak,
        0.4 * c.f_peak,
        "RIPPLE",
        "amplitude",
        RIPPLE_N=per_turn / c.machine.pulley,
        RIPPLE_PHASE=c.uniform(0, 2 * pi),
        RIPPLE_SECOND=c.uniform(0.1, 0.4),
    )


# In the balances.


@effect("coulomb_friction", "flow.v_c", "flow.w")
def _coulomb(c: Context) -> Draw:
    """Dry friction with presliding, no Stribeck effect: Canudas de Wit et al. 1995."""
    return _friction(c, 1.0)


@effect("stribeck_friction", "flow.v_c", "flow.w")
def _stribeck(c: Context) -> Draw:
    """Dry friction that falls with speed: Armstrong et al. 1994, Canudas de Wit et al. 1995."""
    return _friction(c, c.uniform(1.7, 3.0))


def _friction(c: Context, rise: float) -> Draw:
    m = c.machine
    v_s = m.v_max * c.uniform(0.04, 0.12)
    z = m.v_max * 10 ** c.uniform(-4.7, -4.2)

    def slots(s: float) -> Slots:
        return {"FRIC_C": s, "FRIC_S": s * rise, "FRIC_VS": v_s, "FRIC_Z": z} if s else {}

    def label(s: float) -> dict[str, Any]:
        speed = {"breakaway": s * rise, "stribeck_speed": v_s} if rise > 1 else {}
        return {"coulomb": s, "presliding": z} | speed

    return Draw(0.02 * c.f_peak, 0.3 * c.f_peak, slots, label)


@effect("quadratic_drag", "flow.v_c", "flow.w")
def _quadratic(c: Context) -> Draw:
    """Windage of a disk or air pushed through a bellows: Schlichting 1979."""
    size = c.f_peak / c.machine.v_max**2
    return _simple(0.05 * size, 0.5 * size, "QUAD", "per_square_speed")


@effect("load_dependent_loss", "flow.v_m")
def _load_loss(c: Context) -> Draw:
    """Friction of the tooth mesh grows with the belt force: Hamon, Gautier, Garrec 2010."""
    return _simple(0.05, 0.5, "LOAD_MU", "mu", LOAD_V=0.004 * c.machine.v_max)


@effect("road_grade", "flow.v_c")
def _grade(c: Context) -> Draw:
    """A constant load, as of a tilted rail or a cable chain, different in each recording."""
    forces = c.rng.uniform(0.4, 1.4, len(c.plans)) * c.rng.choice([-1, 1], len(c.plans))
    shapes = [np.full(plan.n, f) for plan, f in zip(c.plans, forces, strict=True)]
    return Draw(
        0.02 * c.f_peak,
        0.3 * c.f_peak,
        lambda s: {},
        lambda s: {"force_per_recording": [s * float(f) for f in forces]},
        shapes,
    )


@effect("unknown_input", "flow.v_c", "flow.w")
def _unknown(c: Context) -> Draw:
    """Somebody or some process pushes for 0.1 to 0.8 s, in most recordings once or twice."""
    shapes, windows = [], []
    for i, plan in enumerate(c.plans):
        t = np.arange(plan.n) / c.machine.rate
        shape, found = np.zeros(plan.n), []
        for _ in range(int(c.rng.integers(1 if i < 3 else 0, 3))):
            start = c.uniform(0.3, t[-1] - 1.0)
            late = (t - start) / c.uniform(0.1, 0.8)
            sign = c.uniform(0.6, 1.4) * float(c.rng.choice([-1, 1]))
            shape += sign * np.clip(5 * np.minimum(late, 1 - late), 0, 1)
            inside = t[(late > 0) & (late < 1)]
            found.append([float(inside[0]), float(inside[-1])])
        shapes.append(shape)
        windows.append(found)
    return Draw(
        0.05 * c.f_peak,
        0.8 * c.f_peak,
        lambda s: {},
        lambda s: {"peak": s, "windows_s": windows},
        shapes,
    )


# In the elements.


@effect("backlash", "elements.belt")
def _backlash(c: Context) -> Draw:
    """Play of the teeth in the pulley, damping only in contact: Nordin, Gutman 2002."""
    stretch = _stretch(c)
    return _simple(0.5 * stretch, 20 * stretch, "GAP", "half_gap_m")


def _stretch(c: Context) -> float:
    """Stretch of the belt under the root mean square of the command [m]."""
    return c.f_rms / c.machine.base["k"]


@effect("compliance", "elements.carriage", "elements.table")
def _compliance(c: Context) -> Draw:
    """A part of the load sits on a spring: Spong 1987. The sensor is on the near side."""
    m = c.machine
    mass = m.load * c.uniform(0.25, 0.6)
    near = mass * (m.load - mass) / m.load
    zeta = c.uniform(0.02, 0.06)

    def slots(s: float) -> Slots:  # size: inverse square of its resonance in rad/s
        if not s:
            return {}
        k = near / s
        return {"FLEX_M": mass, "FLEX_K": k, "FLEX_C": 2 * zeta * (k * near) ** 0.5}

    return Draw(
        1 / (2 * m.w_high) ** 2,
        1 / (0.3 * m.w_high) ** 2,
        slots,
        lambda s: {"far_part": mass / m.load, "stiffness": near / s if s else None, "zeta": zeta},
    )


@effect("stiffness_nonlinear", "elements.belt")
def _cubic(c: Context) -> Draw:
    """A belt that hardens with its stretch, cubic: Kovacic, Brennan 2011."""
    square = _stretch(c) ** 2
    return _simple(0.1 / square, 1.5 / square, "CUBIC", "relative_per_m2")


@effect("stiffness_hysteresis", "elements.belt")
def _hysteresis(c: Context) -> Draw:
    """Rate-independent loss of cords and rubber, sliding elements: Iwan 1966."""
    limit = _stretch(c) * c.uniform(0.5, 1.5)
    return _simple(0.3, 2.5, "HYST", "relative_stiffness", HYST_YIELD=limit)


@effect("position_dependent_stiffness", "elements.belt")
def _position(c: Context) -> Draw:
    """The free spans change with the place of the carriage: Hace, Jezernik, Sabanovic 2007."""
    return _simple(0.5, 0.95, "POS", "span_change", POS_HALF=c.machine.half)


@effect("added_inertia", "flow.v_c", "flow.w")
def _added(c: Context) -> Draw:
    """A mass coupled by a viscous film, as a Lanchester damper or a liquid: Den Hartog 1956."""
    tau = 0.02 * 20 ** c.uniform(0, 1)
    load = c.machine.load
    return Draw(
        0.1 * load,
        1.0 * load,
        lambda s: {"ADD_M": s, "ADD_D": s / tau},
        lambda s: {"inertia": s, "time_constant_s": tau},
    )


# In the sensors.


def _sensor(c: Context) -> dict[str, float]:
    return {"S_WHICH": float(c.machine.signals.index(c.place.removeprefix("outputs.")))}


def _on_sensor(c: Context, typical: float, largest: float, slot: str, sign: float = 1) -> Draw:
    which, name = _sensor(c), slot.removeprefix("S_").lower()
    return Draw(typical, largest, lambda s: which | {slot: sign * s}, lambda s: {name: sign * s})


@effect("sensor_delay", "outputs.v_m|outputs.v_c")
def _sensor_delay(c: Context) -> Draw:
    """A speed that the interface hands on late [s]: Ohmae et al. 1982."""
    return _on_sensor(c, 2e-3, 0.4 / c.machine.w_loop, "S_DELAY")


@effect("sensor_lag", "outputs.v_m|outputs.v_c")
def _sensor_lag(c: Context) -> Draw:
    """A low-pass filter of first order [s] of the speed: Ohmae et al. 1982."""
    return _on_sensor(c, 2e-3, 0.4 / c.machine.w_loop, "S_LAG")


@effect("sensor_scale", "outputs.v_m|outputs.v_c")
def _sensor_scale(c: Context) -> Draw:
    """A wrong scale (relative error): Doebelin 2003, Measurement Systems."""
    return _on_sensor(c, 0.05, 0.4, "S_GAIN", float(c.rng.choice([-1, 1])))


@effect("sensor_offset", "outputs.v_m|outputs.v_c", "outputs.w")
def _sensor_offset(c: Context) -> Draw:
    """A zero error, in the unit of the signal: Doebelin 2003."""
    v = c.machine.v_max
    return _on_sensor(c, 0.03 * v, 0.8 * v, "S_OFFSET", float(c.rng.choice([-1, 1])))


@effect("sensor_eccentricity", "outputs.v_m", "outputs.w")
def _eccentricity(c: Context) -> Draw:
    """An eccentric disk of the encoder, once per turn: Merry et al. 2013."""
    turn, phase = 1 / c.machine.pulley, c.uniform(0, 2 * pi)
    more = {"S_ECC_N": turn, "S_ECC_PHASE": phase}
    return _simple(0.05, 0.6, "S_ECC", "relative", **_sensor(c), **more)


@effect("sensor_quantisation", "outputs.v_m|outputs.v_c", "outputs.w")
def _quantisation(c: Context) -> Draw:
    """A coarse step of the signal, in its unit: Widrow, Kollar 2008."""
    v = c.machine.v_max
    return _on_sensor(c, 0.05 * v, 0.8 * v, "S_QUANT")
