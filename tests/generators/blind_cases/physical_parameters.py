"""Every number of the true driveline; the defaults mean: no effect.

The C solver gets a structure with these fields in this order (see `solver.header`).
"""

from dataclasses import asdict, dataclass

from tests.generators.blind_cases.true_parameters import RATIO, TAU_F_S, Base


@dataclass(frozen=True)
class Physics:
    """Base values, then the numbers of the effects, place by place (angles at the wheel)."""

    J_em: float
    k: float
    c: float
    alpha: float
    b_em: float
    J_v: float
    b_w: float
    f0: float
    cd2: float
    ratio: float = RATIO
    tau_f: float = TAU_F_S

    rate_limit: float = 0.0  # fastest change of torque [N*m/s], 0: none
    rate_band: float = 1.0  # torque about zero where it is slower still [N*m]
    rate_in_band: float = 1.0  # share of the rate left there [-]
    lag_omega: float = 0.0  # corner of the current loop [rad/s], 0: none
    lag_zeta: float = 0.8  # its damping ratio [-]
    input_transport_s: float = 0.0  # age of the demand on its way [s]
    input_frame_s: float = 0.0  # period of the demand's CAN frame [s], 0: none
    input_jitter_s: float = 0.0  # standard deviation of the frame's time [s]
    power_limit: float = 0.0  # power of the cold machine [W], 0: no limit
    power_heat: float = 0.0  # relative loss of power per unit of winding heat [-]
    power_share: float = 0.0  # share of the missing torque that is missing [-]
    drift_gain: float = 0.0  # relative loss of torque per unit of rotor heat [-]
    heat_winding_s: float = 4.0  # time constant of the winding's heat [s]
    heat_rotor_s: float = 3.0  # time constant of the rotor's heat [s]
    heat_start: float = 0.0  # heat of winding and rotor at the start [-]
    torque_offset: float = 0.0  # error of the torque [N*m]
    ripple_offset: float = 0.0  # ripple of current offset, once per pole pair [N*m]
    ripple_scale: float = 0.0  # ripple of current scale, twice, relative to torque [-]
    ripple_order: float = 3.0  # pole pairs [-]
    ripple_phase: float = 0.0  # [rad]
    ripple_phase_2: float = 0.0  # [rad]

    slip_torque: float = 0.0  # sum of the Maxwell-slip elements' limits [N*m]
    slip_angle: float = 0.1  # motor angle at which the last element slips [rad]
    bristle_coulomb: float = 0.0  # LuGre: friction at high speed [N*m]
    bristle_static: float = 0.0  # LuGre: friction at rest [N*m], 0: none
    bristle_speed: float = 30.0  # LuGre: Stribeck speed of the motor [rad/s]
    bristle_exponent: float = 1.0  # LuGre: exponent of the Stribeck curve [-]
    bristle_stiffness: float = 60.0  # LuGre: bristle stiffness [N*m/rad]
    mesh_loss: float = 0.0  # relative mesh loss at MESH_TORQUE and MESH_SPEED [-]
    drag_share: float = 0.0  # residual drag over brake torque [-]
    drag_limit: float = 0.0  # largest residual drag [N*m]
    drag_turn: float = 60.0  # wheel angle over which run-out knocks the pads back [rad]
    drag_s: float = 6.0  # time constant of the seals' roll-back [s]
    grade_share: float = 0.0  # share of the recording's road slope that acts [-]
    grade_from: float = 0.0  # torque of the slope at first [N*m]
    grade_to: float = 0.0  # torque of the slope at last [N*m]
    grade_at: float = 0.0  # wheel angle where the slope starts to change [rad]
    grade_length: float = 1.0  # length of the vertical curve, as wheel angle [rad]
    unknown_share: float = 0.0  # share of the recording's unrecorded torque that acts [-]

    two_shafts: float = 0.0  # 1: left and right half-shaft side by side
    share_left: float = 0.5  # left shaft's share of stiffness and damping [-]
    gap_skew: float = 0.0  # left half gap alpha*(1+skew), right alpha*(1-skew) [-]
    gap_shift: float = 0.0  # centre of the left gap, minus that of the right [rad]
    mid_J: float = 0.0  # inertia between two gaps [kg*m^2], 0: one gap
    mid_k: float = 0.0  # stiffness of the gear-side contact [N*m/rad]
    mid_c: float = 0.0  # damping of the gear-side contact [N*m*s/rad]
    mid_alpha: float = 0.0  # half gap on the gear side [rad]
    knee_gain: float = 0.0  # stiffness beyond the knee over that before, less 1 [-]
    knee_twist: float = 0.06  # twist at the knee [rad]
    knee_width: float = 0.01  # softness of the knee [rad]
    iwan_gain: float = 0.0  # stiffness of all slip elements over k [-]
    iwan_twist: float = 0.05  # twist at which the last element slips [rad]
    joint_1: float = 0.0  # relative compliance, once per turn of the wheel [-]
    joint_3: float = 0.0  # relative compliance, three times per turn [-]
    joint_phase: float = 0.0  # [rad]
    mount_J: float = 0.0  # inertia of the housing in pitch [kg*m^2], 0: rigid
    mount_k: float = 0.0  # static stiffness of the mounts [N*m/rad]
    mount_c: float = 0.0  # damping of the mounts [N*m*s/rad]
    mount_k_2: float = 0.0  # stiffness of the rubber's Maxwell branch [N*m/rad]
    mount_s: float = 1.0  # relaxation time of that branch [s]

    rim_J: float = 0.0  # inertia of the rims, taken from J_v [kg*m^2], 0: rigid tyre
    tyre_k: float = 0.0  # torsional stiffness of the tyres [N*m/rad]
    tyre_c: float = 0.0  # torsional damping of the tyres [N*m*s/rad]
    tyre_k_2: float = 0.0  # stiffness of the rubber's Maxwell branch [N*m/rad]
    tyre_s: float = 1.0  # relaxation time of that branch [s]
    magic_D: float = 0.0  # Magic Formula: peak torque [N*m], 0: no slip
    magic_B: float = 0.0  # Magic Formula: stiffness factor [-]
    magic_C: float = 1.65  # Magic Formula: shape [-]
    magic_E: float = 0.0  # Magic Formula: curvature [-]
    relaxation: float = 1.0  # relaxation length over wheel radius [rad]
    creep_c: float = 0.0  # damping added near standstill [N*m*s/rad]

    eccentricity: float = 0.0  # of the encoder ring over its radius [-]
    eccentricity_phase: float = 0.0  # [rad]
    sense_omega: float = 0.0  # corner of the slower sensor [rad/s], 0: as said
    sense_zeta: float = 0.75  # its damping ratio [-]
    sense_scale: float = 1.0  # wheel speed read over true [-]
    sense_offset: float = 0.0  # error of the wheel speed [rad/s]
    sense_transport_s: float = 0.0  # age of the wheel speed on its way [s]
    sense_frame_s: float = 0.0  # period of the wheel speed's frame [s], 0: none
    sense_jitter_s: float = 0.0  # standard deviation of the frame's time [s]


def clean_physics(base: Base) -> Physics:
    """The driveline of the brief with these true values and no effect."""
    return Physics(**asdict(base))
