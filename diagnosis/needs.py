"""Needs: what each effect of the library has to see in recordings to show itself."""

from __future__ import annotations

from collections.abc import Mapping

EFFECT_NEEDS: Mapping[str, tuple[str, ...]] = {
    "actuator_delay": ("fast",),
    "actuator_lag": ("fast",),
    "added_inertia": ("fast", "sampled_fast"),
    "backlash": ("torque_reverses",),
    "brake_drag": ("brakes",),
    "clock_offset": ("fast",),
    "compliance": ("fast", "sampled_fast"),
    "coulomb_friction": ("speed_reverses",),
    "load_dependent_loss": ("both_signs",),
    "mount_compliance": ("fast", "sampled_fast"),
    "position_dependent_stiffness": ("turns", "moves"),
    "quadratic_drag": ("speed_range",),
    "road_grade": ("moves",),
    "second_gap": ("torque_reverses", "sampled_fast"),
    "sensor_delay": ("fast",),
    "sensor_eccentricity": ("turns",),
    "sensor_lag": ("fast",),
    "sensor_offset": ("speed_range",),
    "sensor_quantisation": ("moves",),
    "sensor_scale": ("speed_range",),
    "stiffness_hysteresis": ("two_sizes",),
    "stiffness_nonlinear": ("two_sizes",),
    "stribeck_friction": ("speed_reverses",),
    "torque_derating": ("power",),
    "torque_drift": ("long",),
    "torque_gain": ("both_signs",),
    "torque_offset": ("speed_reverses",),
    "torque_rate_limit": ("two_sizes",),
    "torque_ripple": ("turns", "sampled_fast"),
    "tyre_slip": ("fast", "speed_range"),
    "unequal_half_shafts": ("torque_reverses", "sampled_fast"),
    "unknown_input": ("moves",),
    "viscous_friction": ("speed_range",),
}
"""What each effect of the library has to see."""
NEED_DESCRIPTIONS: Mapping[str, str] = {
    "fast": "steps or a sweep to 5 Hz or more",
    "sampled_fast": "a rate of 50 Hz or more",
    "torque_reverses": "an input that changes its sign",
    "speed_reverses": "a speed that passes through zero",
    "both_signs": "positive and negative input at the same speed",
    "speed_range": "a wide range of speed",
    "two_sizes": "steps of two sizes, one at least twice the other",
    "turns": "five turns or more",
    "moves": "motion for 2 s or more",
    "long": "a recording of 8 s or more",
    "power": "a large input at high and at low speed",
    "brakes": "a brake that is applied and let go",
}
"""What each need asks for, as a manoeuvre."""
