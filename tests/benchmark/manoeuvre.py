"""Manoeuvre: what is simulated - steady pull, then a step of the motor's torque."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction

NOMINAL = {
    "R": "8.1",
    "J_em": "0.05",
    "J_wh": "0.7",
    "m": "1250",
    "r_w": "0.29",
    "k_hs": "4800",
    "c_hs": "14",
    "alpha": "0.0256",
    "b_em": "0.002",
    "b_w": "0.2",
    "a_aer": "0.378",
    "C_0": "0.01",
    "C_1": "1e-5",
    "C_2": "1e-7",
    "g": "9.81",
}
"""As in spec/ev_driveline/plant.yaml [SI]."""


@dataclass(frozen=True, eq=False)
class Manoeuvre:
    """A step of torque [N*m] from steady pull at 40 km/h; `parameters` in SI."""

    name: str
    torques: tuple[int, int] = (30, -20)
    step_ms: int = 1000
    horizon_ms: int = 5000
    parameters: Mapping[str, str] = field(default_factory=lambda: NOMINAL)

    def values(self) -> dict[str, float]:
        """Return the parameters [SI]."""
        return {name: float(text) for name, text in self.parameters.items()}

    def start(self) -> tuple[Fraction, Fraction, Fraction, Fraction]:
        """Return w_em, w_w [rad/s], theta_d, theta_b [rad]: both sides accelerate alike."""
        p = {name: Fraction(text) for name, text in self.parameters.items()}
        w_w = Fraction(100, 9) / p["r_w"]
        w_em = p["R"] * w_w
        inertia = p["m"] * p["r_w"] ** 2 + 4 * p["J_wh"]
        rolling = p["C_0"] + p["C_1"] * w_w + p["C_2"] * w_w**2
        drag = p["a_aer"] * p["r_w"] ** 3 * w_w**2 + p["m"] * p["g"] * p["r_w"] * rolling
        load = drag + p["b_w"] * w_w
        motor = p["J_em"] * p["R"]
        push = (self.torques[0] - p["b_em"] * w_em) / motor + load / inertia
        torque = push / (1 / (motor * p["R"]) + 1 / inertia)
        return w_em, w_w, p["alpha"] + torque / p["k_hs"], p["alpha"]


TIP_OUT = Manoeuvre("tip_out_5s")
CHATTER = Manoeuvre("chatter_6s", (100, 1), horizon_ms=6000, parameters={**NOMINAL, "J_em": "0.2"})
"""A heavy motor damps lightly, and no torque holds the gap closed: it is crossed 20 times and more,
to and fro."""
