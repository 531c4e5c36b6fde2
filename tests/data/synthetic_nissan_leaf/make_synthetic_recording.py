"""Synthetic recording: writes a synthetic drive that looks like a CAN recording of a Nissan LEAF.

    python tests/data/synthetic_nissan_leaf/make_synthetic_recording.py [FILE]

Two inertias and one backlash (Guercioni et al. 2018, eqs 1-9; Nordin's form of the gap) with the
values of spec/nissan_leaf/leaf.yaml, over those of spec/ev_driveline/plant.yaml. It imports
nothing of the product, so that it can be a witness against it. Same bytes on every run. It
prints when the gap is entered and left (time [s], mode), which the file does not tell.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[3]
TARGET = ROOT / "modewright/api/demo_data_files/recordings/leaf_tip_out/drive_twin.csv"
HEAD = (
    "t_s,em_torque_Nm,em_speed_rpm,inv_voltage_V,em_torque_cmd_Nm,batt_V,batt_A,"
    "wheel_a_kmh,wheel_b_kmh,abs_speed_kmh,t_wheel_s"
)

R, J_EM, B_EM, B_W = 8.1938, 0.06, 0.01, 0.2  # -, kg*m^2, N*m*s/rad, N*m*s/rad
M, R_W, G = 1800.0, 0.3183, 9.81  # kg, m, m/s^2
J_V = M * R_W**2 + 4 * 0.7  # kg*m^2
K, C, ALPHA = 9500.0, 60.0, 0.017  # N*m/rad, N*m*s/rad, rad
A_AER, C_0, C_1, C_2 = 0.378, 0.01, 1e-5, 1e-7  # kg/m, 1, s/rad, s^2/rad^2

ROWS, STEPS = 1500, 100  # rows of 10 ms, each in steps of 0.1 ms
STEP = 1e-4  # s
LAG = 0.035  # s, motor torque behind the command
TIP_OUT, TIP_IN = 800, 1250  # rows
START = 32.0 / 3.6 / R_W  # rad/s, wheel speed at the start
KMH = 3.6 * R_W  # km/h per rad/s of a wheel
RPM = 30.0 / np.pi  # rpm per rad/s
SEED = 2018


def command(row: int) -> float:
    """Return the torque command [N*m] of a row: pull, tip-out, coast, tip-in; 0.25 N*m steps."""
    if row < TIP_OUT:
        return float(np.round(4 * (150 + 4 * np.sin(0.0145 * row))) / 4)
    since = row - TIP_OUT
    if since < 13:  # away over one period of the shuffle, as anti-jerk control does, ...
        return 136.25 - 10.5 * since
    if since < 22:  # ... gently towards zero and a rest there, ...
        return max(0.0, 7.5 - 2.5 * (since - 13))
    if row < TIP_IN:  # ... through the gap, and into coasting
        return max(-20.0, -3.0 - 1.25 * (since - 22))
    return min(60.0, -20.0 + 2.5 * (row - TIP_IN))


def load(w_w: float) -> float:
    """Return the load torque [N*m] at the wheel speed [rad/s]: drag and rolling resistance."""
    rolling = M * G * R_W * (C_0 + C_1 * w_w + C_2 * w_w**2)
    return A_AER * R_W**3 * w_w**2 + rolling + B_W * w_w


def drive() -> tuple[list[tuple[float, float, float]], list[tuple[float, int]]]:
    """Return motor torque [N*m], motor and wheel speed [rad/s] of every millisecond.

    And the changes of mode: time [s] and the new mode (1 drive, 0 gap, -1 coast). Semi-implicit
    Euler: against a step of 0.01 ms these times are within 0.3 ms, the motor within 0.6 rpm.
    """
    torque, w_w, mode = command(0), START, 1
    w_em = R * w_w
    pull = (torque - B_EM * w_em + J_EM * R * load(w_w) / J_V) / (1 / R + J_EM * R / J_V)
    theta_d, theta_b = ALPHA + pull / K, ALPHA  # the twist of a steady pull
    kept, changes = [], []
    for step in range(ROWS * STEPS + 1):
        w_d = w_em / R - w_w
        w_b = w_d + K / C * (theta_d - theta_b)  # inside the gap
        side = (theta_b >= ALPHA and w_b > 0) - (theta_b <= -ALPHA and w_b < 0)
        if side != mode:
            mode = side
            changes.append((step * STEP, mode))
        w_b = 0.0 if mode else w_b
        T_hs = K * (theta_d - theta_b) + C * (w_d - w_b)
        if step % 10 == 0:
            kept.append((torque, w_em, w_w))
        torque += STEP / LAG * (command(step // STEPS) - torque)
        w_em += STEP / J_EM * (torque - T_hs / R - B_EM * w_em)
        w_w += STEP / J_V * (T_hs - load(w_w))
        theta_d += STEP * (w_em / R - w_w)
        theta_b = min(ALPHA, max(-ALPHA, theta_b + STEP * w_b))
    return kept, changes


def rounded(value: float, quantum: float) -> str:
    """Return a value in whole quanta, written as the originals write it."""
    return str(round(round(value / quantum) * quantum, 3))


def rows(kept: list[tuple[float, float, float]]) -> list[str]:
    """Return the lines of the recording; every second one has a wheel frame, with its time."""
    noise = np.random.RandomState(SEED)  # its stream is frozen, that of default_rng is not
    lines = []
    for row in range(1, ROWS + 1):
        torque, w_em, _ = kept[10 * row]
        amps = round(2 * -(torque * w_em + 700) / 390) / 2
        volts = 393.0 + round(2 * 0.055 * amps) / 2
        cells = [str(row / 100), rounded(torque + 0.15 * noise.randn(), 0.5)]
        cells += [str(round(w_em * RPM + 0.7 * noise.randn())), str(2 * round(volts / 2))]
        cells += ["" if row == ROWS else str(command(row)), str(volts), str(amps)]
        errors = noise.randn(2)
        if row % 2 == 0:
            stamp = 10 * row - round(6.5 + 2.4 * np.sin(0.007 * row))  # ms
            speed = kept[stamp][2] * KMH
            cells += [rounded(speed + 0.05 * error, 0.005) for error in errors]
            cells += [rounded(0.967 * speed, 0.01), str(stamp / 1000)]
        else:
            cells += [""] * 4
        lines.append(",".join(cells))
    return lines


if __name__ == "__main__":
    target = Path(sys.argv[1]) if len(sys.argv) > 1 else TARGET
    kept, changes = drive()
    target.write_bytes("\n".join([HEAD, *rows(kept), ""]).encode("ascii"))
    for time, mode in changes:
        print(f"{time:.4f},{mode}")
