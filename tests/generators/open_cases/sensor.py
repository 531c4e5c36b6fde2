"""Effects of the wheel-speed sensor."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tests.generators.open_cases.actuator import apply_delay, apply_lag
from tests.generators.open_cases.effect import Effect, Parameters, Speeds, draw_sign

PLACE = "outputs.w_s"


def apply_sensor_filter(speeds: Speeds, tau: float) -> Speeds:
    """Return the speeds with the wheel speed after the sensor's own filter [s]."""
    return replace(speeds, w_w=apply_lag(speeds.w_w, tau, speeds.step))


def _delay(speeds: Speeds, p: Parameters) -> Speeds:
    """Dead time of pulse counting and bus."""
    return replace(speeds, w_w=apply_delay(speeds.w_w, p["delay_s"], speeds.step))


def _lag(speeds: Speeds, p: Parameters) -> Speeds:
    """A second filter behind the known one."""
    return replace(speeds, w_w=apply_lag(speeds.w_w, p["tau_s"], speeds.step))


def _scale(speeds: Speeds, p: Parameters) -> Speeds:
    return replace(speeds, w_w=speeds.w_w * p["scale"])


def _offset(speeds: Speeds, p: Parameters) -> Speeds:
    return replace(speeds, w_w=speeds.w_w + p["offset_radps"])


def _eccentricity(speeds: Speeds, p: Parameters) -> Speeds:
    """A ring out of centre: once per turn (Gustafsson 2010, IEEE Instrum. Meas. Mag. 13, 16-23)."""
    wave = 1.0 + p["share"] * np.sin(speeds.angle_w + p["phase_rad"])
    return replace(speeds, w_w=speeds.w_w * wave)


SENSOR = (
    Effect(
        "sensor_eccentricity",
        PLACE,
        lambda g, s: {"share": s * g.uniform(0.010, 0.030), "phase_rad": g.uniform(0.0, 6.283)},
        speeds=_eccentricity,
    ),
    Effect(
        "sensor_scale",
        PLACE,
        lambda g, s: {"scale": 1.0 + s * draw_sign(g) * g.uniform(0.02, 0.06)},
        speeds=_scale,
    ),
    Effect("sensor_lag", PLACE, lambda g, s: {"tau_s": s * g.uniform(0.02, 0.05)}, speeds=_lag),
    Effect(
        "sensor_delay", PLACE, lambda g, s: {"delay_s": s * g.uniform(0.02, 0.05)}, speeds=_delay
    ),
    Effect(
        "sensor_offset",
        PLACE,
        lambda g, s: {"offset_radps": s * draw_sign(g) * g.uniform(0.2, 0.6)},
        speeds=_offset,
    ),
)
