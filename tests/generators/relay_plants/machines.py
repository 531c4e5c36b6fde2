"""The machines: draws of parameters, programs of the test engineer, naive specs and maps.

Sources: hybrid thermostat: Alur et al. 1995; lumped heat capacities: Incropera and DeWitt 2007;
asymmetric half bridge: Krishnan 2001; cascade of tanks: Johansson 2000 (Torricelli 1644).
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .kernel import BRIDGE, OVEN, TANK, Array

Rng = np.random.Generator
ZERO_DEGC = 273.15  # K


@dataclass(frozen=True)
class Column:
    """A signal of the spec in SI units, and its column in the recordings."""

    name: str
    header: str
    unit: str
    sd: float  # of the noise, SI
    step: float  # of the quantisation, SI; 0: none
    scale: float = 1.0  # SI units per unit of the column
    offset: float = 0.0  # SI value at 0 of the column
    hold: str = "previous"


@dataclass
class Case:
    """A drawn machine with its programs; quantities in SI units."""

    machine: str
    kind: int
    rate: float  # Hz
    duration: float  # s
    exact: dict[str, float]
    nominal: dict[str, float]  # of the uncertain parameters, as in the spec
    base: dict[str, float]  # the true values of the same
    inputs: list[Column]
    outputs: list[Column]
    spans: list[float]  # usual size of inputs 0 and 1
    flows: list[float]  # usual size of the balances of the states
    levels: list[float]  # usual size of the states, of temperatures above ambient
    about: str = ""
    programs: list[Array] = field(default_factory=list)  # samples x (main, second, set-point)
    trains: int = 0  # so many programs, the first ones, are for training

    @property
    def switch_inside(self) -> bool:
        """True if the model itself switches the relay."""
        return "h_s" in self.base

    def kernel(self, base: dict[str, float]) -> dict[str, float]:
        """Translate parameters of the spec into those of the kernel."""
        v = {**self.exact, **base}
        p = {"KIND": float(self.kind), "HYST": v.get("h_s", 0.0), "N_EXP": 1.0, "N_REF": 1.0}
        match self.kind:
            case 0:
                p |= {"S0": v["C"], "S1": v["C_a"], "A0": v["G_a"], "A1": v["G_o"], "A2": v["R_h"]}
            case 1:
                p |= {"S0": v["L"], "S1": v["C"], "A0": v["R"], "A1": v["V_f"], "A2": v["R_s"]}
            case _:
                p |= {"S0": v["A_1"], "S1": v["A_2"], "A0": v["o_1"], "A1": v["o_2"]}
                p |= {"A2": v["Q_n"], "P_REF": v["p_n"]}
        return p

    def start(self, main: float, second: float) -> Array:
        """The states at rest before a recording, from the delivered inputs."""
        match self.kind:
            case 0:
                return np.array([second, second, 0.0])
            case 1:
                return np.array([0.0, second, 0.0])
            case _:
                return np.array([self.exact["h_10"], self.exact["h_20"], 0.0])

    def spec(self) -> str:
        """Text of the naive spec."""
        return _SPECS[self.machine](self)

    def map(self) -> str:
        """Text of the map of the columns."""
        lines = ["language: 1", f"map: {_automaton(self)}_columns"]
        lines += ["time: {column: t_s, unit: s}", "columns:"]
        for c in self.inputs:
            hold = "" if c.hold == "previous" else ", hold: linear"
            lines.append(f"  {c.header}: {{to: {c.name}, unit: {c.unit}{hold}}}")
        for c in self.outputs:
            lines.append(f"  {c.header}: {{compare: {c.name}, unit: {c.unit}}}")
        return "\n".join(lines) + "\n"


def draw(machine: str, rng: Rng) -> Case:
    """Draw a machine of this name with its programs."""
    return _DRAWS[machine](machine, rng)


def _between(rng: Rng, low: float, high: float) -> float:
    return float(rng.uniform(low, high))


def _spread(rng: Rng, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def _rounded(values: dict[str, float]) -> dict[str, float]:
    return {name: float(f"{value:.3g}") for name, value in values.items()}


def _true(rng: Rng, nominal: dict[str, float]) -> dict[str, float]:
    """True values, 5 to 20 % beside the nominal ones."""
    return {
        name: float(value * (1 + rng.choice((-1, 1)) * rng.uniform(0.05, 0.20)))
        for name, value in nominal.items()
    }


def _steps(rng: Rng, t: Array, low: float, high: float, shortest: float, longest: float) -> Array:
    """Random levels, each held for a time between `shortest` and `longest` [s]."""
    out, at = np.empty_like(t), t[0]
    while at <= t[-1]:
        out[t >= at] = rng.uniform(low, high)
        at += rng.uniform(shortest, longest)
    return out


def _schedule(rng: Rng, kind: int, t: Array, low: float, high: float) -> Array:
    """Set-points: constant, up and down a staircase, high then low, random steps."""
    s = t / t[-1]
    match kind % 4:
        case 0:
            return np.full_like(t, rng.uniform(0.6 * low + 0.4 * high, high))
        case 1:
            stairs: Array = 1 - np.abs(np.floor(s * 4.999) - 2) / 2
            return low + (high - low) * stairs
        case 2:
            first, then = rng.uniform(0.35, 0.6), rng.uniform(0.7, 0.9)
            return np.where(s < first, high, np.where(s < then, low, 0.5 * (low + high)))
        case _:
            return _steps(rng, t, low, high, 0.12 * t[-1], 0.35 * t[-1])


def _supply(rng: Rng, kind: int, t: Array, low: float, high: float) -> Array:
    """A supply that is constant, stepped, ramped or swung."""
    s = t / t[-1]
    a, b = rng.uniform(low, high, 2).tolist()
    match kind % 4:
        case 0:
            return np.full_like(t, 0.5 * (a + high))
        case 1:
            return _steps(rng, t, low, high, 0.06 * t[-1], 0.25 * t[-1])
        case 2:
            ramps: Array = np.interp(s, [0, 0.2, 0.55, 0.8, 1], rng.uniform(0, 1, 5))
            return low + (high - low) * ramps
        case _:
            turns = rng.uniform(2, 7)
            swing: Array = np.sin(2 * np.pi * turns * s)
            return np.asarray(0.5 * (low + high) + 0.45 * (b - a) * swing)


def _telegraph(rng: Rng, t: Array, longest: float, choices: tuple[float, ...] = (0.0,)) -> Array:
    """Alternate between 1 and one of the choices, each for at most `longest` [s]."""
    out, at, high = np.empty_like(t), 0.0, True
    while at <= t[-1]:
        out[t >= at] = 1.0 if high else rng.choice(choices)
        at += rng.uniform(0.15, 1.0) * longest
        high = not high
    return out


def _relay(rate: Callable[[Array, float, int], Array], x: Array, t: Array, aim: Array,
           half: float) -> Array:  # fmt: skip
    """Command of a two-point controller that acts on a nominal machine, decided at the samples."""
    out, on, dt = np.empty_like(t), 1.0, t[1] - t[0]
    for k in range(len(t)):
        on = 0.0 if x[0] > aim[k] + half else 1.0 if x[0] < aim[k] - half else on
        out[k] = on
        x = x + dt * rate(x, on, k)
    return out


def _times(rng: Rng, rate: float, duration: float) -> Array:
    """Sample times of one recording; the lengths differ."""
    return np.arange(int(rate * duration * rng.uniform(0.8, 1.0))) / rate


def _oven(machine: str, rng: Rng) -> Case:
    inside = machine == "oven_thermostat"
    rate = float(rng.choice([0.25, 0.4, 0.5, 1.0, 1.667, 2.0, 4.883]))
    duration = min(3600.0, 2990 / rate) * (1 if rate > 2 else rng.uniform(0.75, 1.0))
    volts = float(rng.choice([24.0, 48.0, 230.0, 400.0]))
    power, rise = _spread(rng, 150, 3000), _between(rng, 130, 240)
    share = _between(rng, 0.35, 0.6)  # of the rise that lies between air and ambient
    g_o, g_a = power / (share * rise), power / ((1 - share) * rise)
    nominal = _rounded({
        "C": duration * rng.uniform(0.16, 0.3) * power / rise,
        "C_a": duration * rng.uniform(0.02, 0.06) * (g_a + g_o),
        "G_a": g_a, "G_o": g_o,
    })  # fmt: skip
    half = _between(rng, 4.0, 8.0)
    if inside:
        nominal["h_s"] = float(f"{half:.2g}")
    exact = _rounded({"R_h": volts**2 / power} | ({} if inside else {"U_sw": 0.05 * volts}))
    sd = _between(rng, 0.08, 0.25)
    celsius: dict[str, Any] = {"unit": "degC", "offset": ZERO_DEGC}
    heater = Column("U_s" if inside else "U_h", "supply_V" if inside else "heater_V", "V",
                    1e-3 * volts, 5e-4 * volts)  # fmt: skip
    inputs = [heater, Column("T_amb", "ambient_degC", sd=0.04, step=0.02, hold="linear", **celsius)]
    if inside:
        inputs.append(Column("T_set", "setpoint_degC", sd=0.0, step=0.0, **celsius))
    case = Case(
        machine, OVEN, rate, duration, exact, nominal, _true(rng, nominal), inputs,
        [Column("T", "body_degC", sd=sd, step=0.1, **celsius),
         Column("T_a", "air_degC", sd=sd * rng.uniform(0.8, 1.5), step=0.1, **celsius)],
        [volts, 20.0], [power, power], [0.6 * rise, 0.4 * rise],
        "heated body in a case of air, switched by " + ("its thermostat" if inside else "a relay"),
    )  # fmt: skip
    case.trains = int(rng.integers(5, 9))
    ambient = ZERO_DEGC + rng.uniform(8, 28)

    def rates(x: Array, on: float, k: int) -> Array:
        flow = nominal["G_a"] * (x[0] - x[1])
        loss = nominal["G_o"] * (x[1] - cold[k])
        heat = on * supply[k] ** 2 / exact["R_h"]
        return np.array([(heat - flow) / nominal["C"], (flow - loss) / nominal["C_a"]])

    for j in rng.permutation(case.trains + 3):
        t = _times(rng, rate, duration)
        turns = 2 * np.pi * rng.uniform(1, 3)
        cold = ambient + rng.uniform(-3, 3) + 1.5 * np.sin(turns * t / t[-1])
        if j % 3 == 1:  # climate chamber
            middle, width = t[-1] * rng.uniform(0.3, 0.7), t[-1] * 0.05
            cold += rng.uniform(-15, 15) / (1 + np.exp(-(t - middle) / width))
        supply = _supply(rng, j, t, 0.75 * volts, 1.1 * volts)
        aim = _schedule(rng, j // 2, t, 0.25 * rise, rng.uniform(0.45, 0.6) * rise)
        aim = ZERO_DEGC + np.round(2 * (aim + cold[0] - ZERO_DEGC)) / 2
        main = supply
        if not inside:
            on = _relay(rates, np.full(2, cold[0]), t, aim, half)
            main = supply * (_telegraph(rng, t, 0.12 * t[-1]) if j % 4 == 3 else on)
        case.programs.append(np.column_stack([main, cold, aim]))
    return case


def _bridge(machine: str, rng: Rng) -> Case:
    rate = float(rng.choice([1000.0, 2000.0, 2441.4, 5000.0, 6097.0, 8000.0, 10000.0, 20000.0]))
    duration = min(2.0, max(0.2, 3000 / rate))
    volts = float(rng.choice([12.0, 24.0, 48.0, 80.0]))
    amps = _spread(rng, 2, 350)
    drop = rng.uniform(0.04, 0.1)
    ohms = 0.9 * volts / amps
    exact = _rounded({"R_s": drop * ohms})
    nominal = _rounded({
        "L": ohms * duration * rng.uniform(0.04, 0.08), "R": ohms, "V_f": rng.uniform(0.7, 1.1),
        "C": max(duration * rng.uniform(0.006, 0.012), 9 / rate) / exact["R_s"],
    })  # fmt: skip
    case = Case(
        machine, BRIDGE, rate, duration, exact, nominal, _true(rng, nominal),
        [Column("gate", "gate", "1", 0.0, 0.0),
         Column("U_s", "supply_V", "V", 1e-3 * volts, volts / 2000, hold="linear")],
        [Column("i", "winding_A", "A", amps * rng.uniform(0.003, 0.006), amps / 1500),
         Column("u", "link_V", "V", volts * rng.uniform(0.002, 0.004), volts / 1500)],
        [1.0, volts], [volts, amps], [amps, volts],
        "winding on an asymmetric half bridge that a source feeds through a cable and a capacitor",
    )  # fmt: skip
    case.trains = int(rng.integers(5, 9))
    tau = nominal["L"] / nominal["R"]

    def rates(x: Array, on: float, k: int) -> Array:
        across = on * source[k] - (1 - on) * nominal["V_f"]
        return np.array([(across - ohms * x[0]) / nominal["L"]])

    for j in rng.permutation(case.trains + 3):
        t = _times(rng, rate, duration)
        source = _supply(rng, j + 1, t, 0.55 * volts, 1.3 * volts)
        match j % 4:
            case 0:
                gate = _telegraph(rng, t, 4 * tau, (0.0, 0.0, -1.0))
            case 1:
                period = max(12 / rate, tau * rng.uniform(0.4, 0.8))
                duty = _schedule(rng, int(rng.integers(4)), t, 0.25, 0.85)
                gate = np.where((t / period) % 1 < duty, 1.0, 0.0)
            case 2:
                gate = _telegraph(rng, t, 1.5 * tau, (0.0, -1.0))
            case _:
                aim = _schedule(rng, int(rng.integers(1, 4)), t, 0.15 * amps, 0.5 * amps)
                gate = _relay(rates, np.zeros(1), t, aim, 0.05 * amps)
        case.programs.append(np.column_stack([gate, source, np.zeros_like(t)]))
    return case


def _tank(machine: str, rng: Rng) -> Case:
    inside = machine == "tank_level_switch"
    rate = float(rng.choice([1.0, 2.0, 5.0, 9.77, 20.0, 50.0]))
    duration = min(1800.0, 2990 / rate)
    height, tau = _between(rng, 0.4, 1.5), duration * rng.uniform(0.09, 0.14)
    area = 0.02 * (tau / 8) ** 0.8 * _spread(rng, 0.6, 2)
    flow = area * height / tau
    hole = flow / np.sqrt(2 * 9.81 * height)
    pressure = _between(rng, 1.5e5, 3.0e5)
    exact = {
        **_rounded({"A_1": area, "A_2": area * rng.uniform(0.6, 1.3), "p_n": 1e5}),
        "h_10": round(0.35 * height, 2), "h_20": round(0.3 * height, 2),
    }  # fmt: skip
    nominal = _rounded({
        "Q_n": flow / np.sqrt(pressure / 1e5), "o_1": hole, "o_2": hole * rng.uniform(0.9, 1.25),
    })  # fmt: skip
    half = height * _between(rng, 0.04, 0.08)
    if inside:
        nominal["h_s"] = float(f"{half:.2g}")
    valve = Column("y_v", "valve_open", "1", 0.0, 0.0)
    supply_column = Column("p_s", "supply_bar", "bar", 400.0, 200.0, 1e5, hold="linear")
    inputs = [valve, supply_column]
    if inside:
        inputs = [supply_column, Column("h_set", "setpoint_mm", "mm", 0.0, 0.0, 1e-3)]
    sd = height * _between(rng, 0.003, 0.008)
    case = Case(
        machine, TANK, rate, duration, exact, nominal, _true(rng, nominal), inputs,
        [Column("h_1", "upper_mm", "mm", sd, height / 1000, 1e-3),
         Column("h_2", "lower_mm", "mm", sd * rng.uniform(0.8, 1.3), height / 1000, 1e-3)],
        [1.0, pressure], [flow, flow], [0.5 * height, 0.5 * height],
        "upper tank that drains into a lower one, filled through a valve by "
        + ("its level switch" if inside else "command"),
    )  # fmt: skip
    case.trains = int(rng.integers(5, 9))

    def rates(x: Array, on: float, k: int) -> Array:
        x = np.maximum(x, 0.0)
        q = nominal["o_1"] * np.sqrt(2 * 9.81 * x[0])
        q_in = on * nominal["Q_n"] * np.sqrt(supply[k] / 1e5)
        out = nominal["o_2"] * np.sqrt(2 * 9.81 * x[1])
        return np.array([(q_in - q) / exact["A_1"], (q - out) / exact["A_2"]])

    for j in rng.permutation(case.trains + 3):
        t = _times(rng, rate, duration)
        supply = _supply(rng, j + 1, t, 0.55 * pressure, 1.3 * pressure)
        aim = _schedule(rng, j // 2, t, 0.22 * height, rng.uniform(0.45, 0.55) * height)
        main = np.ones_like(t)
        if not inside:
            main = _relay(rates, np.array([exact["h_10"], exact["h_20"]]), t, aim, half)
            if j % 4 == 3:
                main = _telegraph(rng, t, 0.6 * tau)
        case.programs.append(np.column_stack([main, supply, np.round(aim, 3)]))
    return case


_DRAWS = {
    "oven_relay": _oven, "oven_thermostat": _oven, "bridge": _bridge,
    "tank_valve": _tank, "tank_level_switch": _tank,
}  # fmt: skip
MACHINES = tuple(_DRAWS)


def _automaton(case: Case) -> str:
    return {OVEN: "oven", BRIDGE: "bridge", TANK: "tanks"}[case.kind]


def _decimal(value: float, digits: int = 4) -> str:
    """Format a number as the language reads it: a mantissa with a point and a plain exponent."""
    text = f"{value:.{digits}g}"
    if "e" not in text:
        return text
    mantissa, exponent = text.split("e")
    return f"{mantissa if '.' in mantissa else mantissa + '.0'}e{int(exponent)}"


def _head(case: Case, unit: dict[str, str], note: dict[str, str], step: float) -> str:
    lines = ["language: 1", f"automaton: {_automaton(case)}", f"about: {case.about}"]
    lines += [f"step: {_decimal(step, 2)} s"]
    lines.append("parameters:          # those with a range are uncertain, the others measured")
    for name, value in {**case.exact, **case.nominal}.items():
        bounds = ""
        if name in case.nominal:
            bounds = f", range: [{_decimal(0.65 * value)}, {_decimal(1.35 * value)}]"
        about = f', about: "{note[name]}"' if name in note else ""
        number = f"{_decimal(value)} {unit[name]}"
        lines.append(f"  {name}: {{value: {number}{bounds}{about}}}")
    return "\n".join(lines) + "\n"


def _oven_spec(case: Case) -> str:
    unit = {"R_h": "ohm", "U_sw": "V", "C": "J/K", "C_a": "J/K", "G_a": "W/K", "G_o": "W/K",
            "h_s": "K"}  # fmt: skip
    note = {"R_h": "heating element", "C": "body", "C_a": "air and case", "G_a": "body to air",
            "G_o": "air to ambient", "h_s": "half of the hysteresis"}  # fmt: skip
    u = case.inputs[0].name
    if case.switch_inside:
        on, off, first = "T < T_set - h_s", "T > T_set + h_s", "heating"
    else:
        on, off, first = f"{u} > U_sw", f"{u} < U_sw", "resting"
    inputs = f"  {u}: {{unit: V}}\n  T_amb: {{unit: K}}\n"
    inputs += "  T_set: {unit: K}\n" if case.switch_inside else ""
    return f"""{_head(case, unit, note, 0.5 / case.rate)}inputs:
{inputs}states:
  T:   {{unit: K, initial: T_amb}}
  T_a: {{unit: K, initial: T_amb}}
equations:
  q_a: G_a * (T - T_a)
  q_o: G_o * (T_a - T_amb)
flow:
  T:   C * der(T) = P_h - q_a
  T_a: C_a * der(T_a) = q_a - q_o
initial: {first}
modes:
  heating:
    number: 1
    equations: {{P_h: {u} * {u} / R_h}}
    transitions: {{resting: {{when: {off}}}}}
  resting:
    number: 0
    equations: {{P_h: 0 W}}
    transitions: {{heating: {{when: {on}}}}}
outputs: [T, T_a]
"""


def _bridge_spec(case: Case) -> str:
    unit = {"R_s": "ohm", "L": "H", "R": "ohm", "V_f": "V", "C": "F"}
    note = {"R_s": "source and cable", "L": "winding", "V_f": "diode", "C": "link capacitor"}
    return f"""{_head(case, unit, note, 0.5 / case.rate)}inputs:
  gate: {{unit: 1, about: "1 drives, 0 freewheels, -1 returns the energy"}}
  U_s:  {{unit: V}}
states:
  i: {{unit: A, initial: 0 A}}
  u: {{unit: V, initial: U_s}}
flow:
  i: L * der(i) = u_w - R * i
  u: C * der(u) = (U_s - u) / R_s - i_l
initial: blocked
modes:
  drive:
    number: 1
    equations: {{u_w: u, i_l: i}}
    transitions:
      freewheel: {{when: gate < 0.5}}
  freewheel:
    number: 0
    equations: {{u_w: -V_f, i_l: 0 A}}
    transitions:
      drive: {{when: gate > 0.5, priority: 1}}
      blocked: {{when: i <= 0 A, priority: 2, reset: {{i: 0 A}}}}
      demagnetise: {{when: gate < -0.5, priority: 3}}
  demagnetise:
    number: -1
    equations: {{u_w: -u - 2 * V_f, i_l: -i}}
    transitions:
      freewheel: {{when: gate > -0.5, priority: 1}}
      blocked: {{when: i <= 0 A, priority: 2, reset: {{i: 0 A}}}}
  blocked:
    number: 2
    equations: {{u_w: R * i, i_l: 0 A}}
    transitions:
      drive: {{when: gate > 0.5}}
outputs: [i, u]
"""


def _tank_spec(case: Case) -> str:
    unit = {"A_1": "m^2", "A_2": "m^2", "p_n": "Pa", "h_10": "m", "h_20": "m", "Q_n": "m^3/s",
            "o_1": "m^2", "o_2": "m^2", "h_s": "m"}  # fmt: skip
    note = {"Q_n": "valve at p_n", "o_1": "outlet of the upper tank, contracted jet",
            "o_2": "outlet of the lower tank", "h_10": "mark to which it is filled before a run",
            "h_s": "half of the hysteresis"}  # fmt: skip
    if case.switch_inside:
        on, off, first = "h_1 < h_set - h_s", "h_1 > h_set + h_s", "filling"
        inputs, opened = "  p_s: {unit: Pa}\n  h_set: {unit: m}\n", ""
    else:
        on, off, first = "y_v > 0.02", "y_v < 0.02", "holding"
        inputs = '  y_v: {unit: 1, about: "commanded opening, 0 or 1"}\n  p_s: {unit: Pa}\n'
        opened = "y_v * "
    head = _head(case, unit, note, 0.5 / case.rate)
    q_in = f'"{opened}Q_n * sqrt(max(p_s, 0 Pa) / p_n)"'
    return f"""{head}  g: {{value: 9.81 m/s^2}}
inputs:
{inputs}states:
  h_1: {{unit: m, initial: h_10}}
  h_2: {{unit: m, initial: h_20}}
equations:
  q_1: "o_1 * sqrt(2 * g * max(h_1, 0 m))"
  q_2: "o_2 * sqrt(2 * g * max(h_2, 0 m))"
flow:
  h_1: A_1 * der(h_1) = q_in - q_1
  h_2: A_2 * der(h_2) = q_1 - q_2
initial: {first}
modes:
  filling:
    number: 1
    equations: {{q_in: {q_in}}}
    transitions: {{holding: {{when: {off}}}}}
  holding:
    number: 0
    equations: {{q_in: 0 m^3/s}}
    transitions: {{filling: {{when: {on}}}}}
outputs: [h_1, h_2]
"""


_SPECS = {
    "oven_relay": _oven_spec, "oven_thermostat": _oven_spec, "bridge": _bridge_spec,
    "tank_valve": _tank_spec, "tank_level_switch": _tank_spec,
}  # fmt: skip
