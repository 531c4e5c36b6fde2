"""The true effects: what acts between recorded input and machine, in a balance, in a sensor.

An effect has one size, which the strength multiplies; its other parameters are drawn once.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from .kernel import BRIDGE, OVEN, TANK, Array
from .machines import ZERO_DEGC, Case, Rng

SIGMA = 5.670374e-8  # W/(m^2*K^4)
TIMED = ("actuator_lag", "actuator_delay", "torque_rate_limit")
Sensor = Callable[[Array, Array], Array]


@dataclass
class Plant:
    """One recording of the true machine on its grid, before it is integrated; effects edit it."""

    index: int
    t: Array  # of the nodes [s]
    step: float
    left: Array
    right: Array
    parameters: dict[str, float]
    sensors: dict[int, list[Sensor]] = field(default_factory=dict)

    def replace_input(self, channel: int, nodes: Array) -> None:
        """Let an input run linearly through the values at the nodes."""
        self.left[:, channel], self.right[:, channel] = nodes[:-1], nodes[1:]


@dataclass
class Effect:
    """An effect at its place: bounds of the size, its action and its label for a size."""

    id: str
    place: str
    low: float
    high: float
    act: Callable[[Plant, float], None]
    label: Callable[[float], dict[str, object]]


def choices(case: Case) -> list[tuple[str, str]]:
    """All effects with their places that make sense on this machine."""
    first, second = case.inputs[0].name, case.inputs[1].name
    x, y = (column.name for column in case.outputs)
    pairs = [("sensor_offset", x), ("sensor_offset", y), ("sensor_lag", x), ("sensor_lag", y)]
    pairs += [("sensor_delay", x), ("sensor_delay", y)]
    pairs += [("sensor_quantisation", x), ("sensor_quantisation", y)]
    found = [(id_, f"outputs.{name}") for id_, name in pairs]
    both = (f"flow.{x}", f"flow.{y}")
    found += [("added_inertia", place) for place in both]
    if case.kind == OVEN:
        if not case.switch_inside:
            found += [(id_, f"inputs.{first}") for id_ in TIMED]
        found += [(id_, f"inputs.{first}") for id_ in ("torque_derating", "torque_drift")]
        found += [("torque_offset", f"inputs.{second}"), ("viscous_friction", both[0])]
        found += [(id_, place) for id_ in ("quadratic_drag", "unknown_input") for place in both]
        return found
    found += [("sensor_scale", f"outputs.{name}") for name in (x, y)]
    shared = ("actuator_lag", "torque_derating", "torque_drift", "torque_offset")
    supply = "U_s" if case.kind == BRIDGE else "p_s"
    found += [(id_, f"inputs.{supply}") for id_ in shared]
    if case.kind == BRIDGE:
        found += [("actuator_delay", f"inputs.{first}"), ("torque_rate_limit", "inputs.U_s")]
        found += [("torque_gain", "inputs.U_s")]
        found += [(id_, both[1]) for id_ in ("viscous_friction", "quadratic_drag", "unknown_input")]
        return found
    if not case.switch_inside:
        found += [(id_, f"inputs.{first}") for id_ in TIMED]
    losses = ("viscous_friction", "quadratic_drag", "unknown_input")
    found += [(id_, place) for id_ in losses for place in both]
    return found


def build(case: Case, id_: str, place: str, rng: Rng) -> Effect:
    """Draw the parameters of an effect at a place, all but its size."""
    kind, name = place.split(".")
    if kind == "inputs":
        return _at_input(case, id_, place, _channel(case, name), rng)
    names = [column.name for column in case.outputs]
    if kind == "flow":
        return _in_balance(case, id_, place, names.index(name), rng)
    return _in_sensor(case, id_, place, names.index(name), rng)


def _channel(case: Case, name: str) -> int:
    """Channel of the kernel that an input of the spec feeds."""
    return {"U_h": 0, "gate": 0, "y_v": 0, "T_amb": 1, "p_s": 1}.get(
        name, 0 if case.kind == OVEN else 1
    )


def lagged(step: float, left: Array, right: Array, tau: float) -> Array:
    """Response of tau*y' + y = u at the nodes, exact for u that is linear in each interval."""
    decay = np.exp(-step / tau)
    slope = (right - left) / step
    y = np.empty(len(left) + 1)
    y[0] = left[0]
    gain = (left - slope * tau) * (1 - decay) + slope * step
    for k in range(len(left)):
        y[k + 1] = decay * y[k] + gain[k]
    return y


def _limited(step: float, left: Array, right: Array, rate: float) -> Array:
    """Follow the input no faster than `rate` (per second)."""
    y = np.empty(len(left) + 1)
    y[0] = left[0]
    most = rate * step
    for k in range(len(left)):
        y[k + 1] = y[k] + min(max(right[k] - y[k], -most), most)
    return y


def _at_input(case: Case, id_: str, place: str, c: int, rng: Rng) -> Effect:
    span, dt, run = case.spans[c], 1 / case.rate, case.duration
    sign = float(rng.choice((-1, 1)))

    def lag(plant: Plant, size: float) -> None:
        """Soft start, line filter or hose: first order (Åström and Murray 2008)."""
        plant.replace_input(c, lagged(plant.step, plant.left[:, c], plant.right[:, c], size))

    def delay(plant: Plant, size: float) -> None:
        """Pull-in time of a contactor or solenoid valve (Topçu et al. 2006), in grid steps."""
        shift = min(round(size / plant.step), len(plant.left) - 1)
        for side in (plant.left, plant.right):
            side[shift:, c] = side[: len(side) - shift, c].copy()
            side[:shift, c] = side[0, c]

    def rate_limit(plant: Plant, size: float) -> None:
        """Ramp of a power controller, programmable source or motor valve (Rundqwist 1990)."""
        rate = span / size
        plant.replace_input(c, _limited(plant.step, plant.left[:, c], plant.right[:, c], rate))

    def drift(plant: Plant, size: float) -> None:
        """Slow wander of the gain: ageing contact, sagging source, clogging strainer."""
        s, (a, b, phase) = plant.t / plant.t[-1], wander[plant.index]
        gain = 1 + size * (a * s + 0.4 * b * (np.sin(4 * s + phase) - np.sin(phase)))
        plant.left[:, c] *= gain[:-1]
        plant.right[:, c] *= gain[1:]

    def gain(plant: Plant, size: float) -> None:
        plant.left[:, c] *= 1 + sign * size
        plant.right[:, c] *= 1 + sign * size

    def offset(plant: Plant, size: float) -> None:
        plant.left[:, c] += sign * size
        plant.right[:, c] += sign * size

    def droop(plant: Plant, size: float) -> None:
        """Regulator or folding source that gives less above a limit (Horowitz and Hill 2015)."""
        for side in (plant.left, plant.right):
            side[:, c] -= size * np.maximum(side[:, c] - limit, 0)

    def ptc(plant: Plant, size: float) -> None:
        """Heater whose resistance rises above a temperature (Moulson and Herbert 2003)."""
        plant.parameters |= {"DERATE": size, "DERATE_AT": hot}

    wander = rng.uniform(0.4, 1, (len(case.programs), 3)) * (1, 1, 6)
    wander[:, :2] *= rng.choice((-1, 1), (len(case.programs), 2))
    tops = [program[:, c].max() for program in case.programs]
    limit = float(np.max(tops) * rng.uniform(0.6, 0.75))
    hot = ZERO_DEGC + 20 + case.levels[0] * rng.uniform(0.4, 0.7)
    largest = {OVEN: 8.0, BRIDGE: 0.25 * span, TANK: 0.4 * span}[case.kind]
    table: dict[str, tuple[float, float, Callable[[Plant, float], None], str]] = {
        "actuator_lag": (0.15 * dt, 0.06 * run, lag, "tau"),
        "actuator_delay": (0.12 * dt, 0.04 * run, delay, "delay"),
        "torque_rate_limit": (0.3 * dt, 0.2 * run, rate_limit, "time_per_span"),
        "torque_drift": (0.001, 0.3, drift, "relative_drift"),
        "torque_gain": (0.001, 0.25, gain, "relative"),
        "torque_offset": (0.001 * largest, largest, offset, "offset"),
        "torque_derating": (0.005, 0.9, droop, "fraction_removed"),
    }
    low, high, act, key = table[id_]
    fixed: dict[str, object] = {}
    if id_ == "torque_derating":
        fixed = {"limit": limit}
        if case.kind == OVEN:
            low, high, act, key, fixed = 5e-5, 0.05, ptc, "per_kelvin", {"above": hot}
    if id_ in ("torque_gain", "torque_offset"):
        return Effect(id_, place, low, high, act, lambda size: {key: sign * size})
    if id_ == "torque_rate_limit":
        return Effect(id_, place, low, high, act, lambda size: {key: size, "rate": span / size})
    return Effect(id_, place, low, high, act, lambda size: {key: size, **fixed})


def _in_balance(case: Case, id_: str, place: str, j: int, rng: Rng) -> Effect:
    flow, level = case.flows[j], case.levels[j]

    def linear(plant: Plant, size: float) -> None:
        """Thermal bridge, bleeder resistor or seepage (Darcy 1856)."""
        plant.parameters[f"LIN{j}"] = size

    def nonlinear(plant: Plant, size: float) -> None:
        """Radiation (Stefan 1879), varistor (Levinson and Philipp 1975), notch (Thomson 1861)."""
        plant.parameters |= {f"NON{j}": size, "N_REF": reference, "N_EXP": exponent}

    def storage(plant: Plant, size: float) -> None:
        """Load inside the body (Incropera and DeWitt 2007), eddy currents or side chamber."""
        own = plant.parameters[f"S{j}"]
        plant.parameters |= {"S2": size * own, "K2": size * own / tau, "PLACE": float(j)}

    def windows(plant: Plant, size: float) -> None:
        """Cold load or opened door, a load switched on, an opened tap."""
        for begin, end, height in events[plant.index]:
            inside = (plant.t[:-1] >= begin * plant.t[-1]) & (plant.t[:-1] < end * plant.t[-1])
            for side in (plant.left, plant.right):
                side[inside, 3 + j] += size * height

    if id_ == "viscous_friction":
        unit = flow / level
        return Effect(id_, place, 5e-4 * unit, 0.5 * unit, linear, lambda size: {"slope": size})
    if id_ == "quadratic_drag":
        exponent = {OVEN: 4.0, BRIDGE: float(rng.uniform(2, 4)), TANK: 2.5}[case.kind]
        reference = {OVEN: 1.0, BRIDGE: level, TANK: 0.35 * level}[case.kind]
        unit = {OVEN: SIGMA, BRIDGE: flow, TANK: flow / (0.8 * level) ** 2.5}[case.kind]
        low, high = (1e-4, 0.6) if case.kind != OVEN else (
            2e-4 * flow / (1e3 * SIGMA * 1e7), 0.6 * flow / (SIGMA * 1e10))  # fmt: skip
        note: dict[str, object] = {} if case.kind == OVEN else {"reference": reference}
        note["exponent"] = exponent
        act = nonlinear
        return Effect(id_, place, low * unit, high * unit, act,
                      lambda size: {"coefficient": size, **note})  # fmt: skip
    if id_ == "added_inertia":
        v = case.base
        if case.kind == OVEN:
            tau = case.duration * rng.uniform(0.02, 0.08)
        elif case.kind == BRIDGE:
            own = (v["L"] / v["R"], v["C"] * case.exact["R_s"])[j]
            tau = own * rng.uniform(0.3, 1.5)
        else:
            tau = case.duration * rng.uniform(0.02, 0.08)
        return Effect(id_, place, 1e-3, 1.5, storage,
                      lambda size: {"ratio": size, "tau": tau})  # fmt: skip
    multiplies = {OVEN: (1.0, level)[j], BRIDGE: level, TANK: np.sqrt(2 * 9.81 * level)}[case.kind]
    unit = float(flow / multiplies)
    events: list[list[tuple[float, float, float]]] = []
    for k in range(len(case.programs)):
        count = int(rng.integers(1, 4)) if k % 4 != 3 else 0
        begins = np.sort(rng.uniform(0.1, 0.85, count))
        events.append([(float(b), float(b + rng.uniform(0.03, 0.12)), float(rng.uniform(0.6, 1)))
                       for b in begins])  # fmt: skip
    return Effect(id_, place, 1e-3 * unit, 0.8 * unit, windows,
                  lambda size: {"size": size, "windows_as_fractions": events})  # fmt: skip


def _in_sensor(case: Case, id_: str, place: str, j: int, rng: Rng) -> Effect:
    column, dt, run = case.outputs[j], 1 / case.rate, case.duration
    sign = float(rng.choice((-1, 1)))
    low, high, key = {
        "sensor_offset": (0.5 * column.sd, 80 * column.sd, "offset"),
        "sensor_scale": (0.001, 0.2, "relative"),
        "sensor_lag": (0.15 * dt, 0.06 * run, "tau"),
        "sensor_delay": (0.15 * dt, 0.04 * run, "delay"),
        "sensor_quantisation": (4 * column.sd, 40 * column.sd, "step"),
    }[id_]

    def attach(plant: Plant, size: float) -> None:
        """Offset and scale (Fraden 2016), thermowell or filter, logger cycle, coarse converter."""

        def read(t: Array, y: Array) -> Array:
            match id_:
                case "sensor_offset":
                    return y + sign * size
                case "sensor_scale":
                    return y * (1 + sign * size)
                case "sensor_lag":
                    return lagged(plant.step, y[:-1], y[1:], size)
                case "sensor_delay":
                    return np.interp(t - size, t, y)
            return y  # the step acts on the noisy signal, see `coarse_step`

        plant.sensors.setdefault(j, []).append(read)

    signed = id_ in ("sensor_offset", "sensor_scale")
    return Effect(id_, place, low, high, attach, lambda size: {key: (sign if signed else 1) * size})


def coarse_step(case: Case, effects: list[Effect], sizes: list[float], j: int) -> float:
    """Step [SI] that `sensor_quantisation` gives output j, else 0."""
    place = f"outputs.{case.outputs[j].name}"
    for effect, size in zip(effects, sizes, strict=True):
        if effect.id == "sensor_quantisation" and effect.place == place:
            return size
    return 0.0
