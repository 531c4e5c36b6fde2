"""One recording: the manoeuvre and the surroundings as drawn, and what the physics makes of it."""

from dataclasses import dataclass, replace

import numpy as np

from tests.generators.blind_cases.can_frame import sample_frames
from tests.generators.blind_cases.driver_model import Trip, smooth_torques
from tests.generators.blind_cases.manoeuvre import OTHERS, TRAINING
from tests.generators.blind_cases.physical_parameters import Physics
from tests.generators.blind_cases.solver import STEP_S, SUBSTEPS, Array, Motion, solve
from tests.generators.blind_cases.true_parameters import Base
from tests.generators.blind_cases.unmeasured_inputs import (
    Slope,
    Window,
    draw_slope,
    draw_windows,
    motor_noise,
    roughness,
    window_torque,
)

SHORTEST_S, LONGEST_S = 8.0, 9.5
TIME_GRID_S = 0.01
"""Lengths are whole multiples of this, so that every rate has whole rows."""


@dataclass(frozen=True)
class Recording:
    """All that chance decides of a recording; nothing here depends on the effects."""

    part: str
    index: int
    manoeuvre: str
    seconds: float
    speed: float
    """Wheel speed before the first sample [rad/s]."""
    demand: Array
    brake: Array
    road: Array
    motor_noise: Array
    slope: Slope
    windows: tuple[Window, ...]
    heat_start: float
    """Heat that an earlier drive left in winding and rotor [-]."""
    key: tuple[int, ...]


def draw_seconds(rng: np.random.Generator) -> float:
    """Length of a recording [s]."""
    return round(rng.uniform(SHORTEST_S, LONGEST_S) / TIME_GRID_S) * TIME_GRID_S


def draw_recording(
    part: str, index: int, manoeuvre: str, base: Base, key: tuple[int, ...]
) -> Recording:
    """The recording for this key; the key gives a stream of chance to each matter."""
    chance = {
        matter: np.random.default_rng([*key, number])
        for number, matter in enumerate(("drive", "road", "motor", "slope", "windows", "heat"))
    }
    rng = chance["drive"]
    seconds = draw_seconds(rng)
    rows = round(seconds / STEP_S)
    trip = Trip(seconds, base)
    pedal_s, pipe_s = rng.uniform(0.036, 0.09), rng.uniform(0.10, 0.20)
    drive = TRAINING.get(manoeuvre) or OTHERS[manoeuvre]
    drive(trip, rng)
    given = smooth_torques(trip, rows, pedal_s, pipe_s)
    return Recording(
        part, index, manoeuvre, seconds, trip.first_speed, given[:, 0], given[:, 1],
        roughness(chance["road"], rows), motor_noise(chance["motor"], rows),
        draw_slope(chance["slope"], base),
        draw_windows(chance["windows"], seconds, certain=part == "train" and index % 2 == 0),
        float(chance["heat"].uniform(0.0, 0.3)), key,
    )  # fmt: skip


def recording_physics(physics: Physics, recording: Recording) -> Physics:
    """The case's physics with the numbers that are another in each recording."""
    slope = recording.slope
    return replace(
        physics,
        grade_from=slope.first,
        grade_to=slope.last,
        grade_at=slope.at,
        grade_length=slope.length,
        heat_start=recording.heat_start,
    )


def inputs(physics: Physics, recording: Recording) -> Array:
    """What drives the solver: demand as it arrives, all brakes, all road torques, noise."""
    rows, share = len(recording.demand), physics.unknown_share
    demand = sample_frames(
        recording.demand,
        np.random.default_rng([*recording.key, 100]),
        physics.input_frame_s,
        physics.input_jitter_s,
        physics.input_transport_s,
    )
    brake = recording.brake + share * window_torque(recording.windows, rows, brake=True)
    road = recording.road + share * window_torque(recording.windows, rows, brake=False)
    return np.column_stack([demand, brake, road, recording.motor_noise])


def simulate_motion(physics: Physics, recording: Recording, substeps: int = SUBSTEPS) -> Motion:
    """The true motion, the wheel speed as it reaches the recorder, every STEP_S."""
    given = inputs(physics, recording)
    motion = solve(recording_physics(physics, recording), recording.speed, given, substeps)
    late = sample_frames(
        motion.w_w,
        np.random.default_rng([*recording.key, 101]),
        physics.sense_frame_s,
        physics.sense_jitter_s,
        physics.sense_transport_s,
    )
    return replace(motion, w_w=late)
