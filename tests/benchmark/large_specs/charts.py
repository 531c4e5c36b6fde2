"""Large charts, made to measure how long a check takes: valid, with guards of all kinds."""

from __future__ import annotations

HEAD = """language: 1
automaton: chart
parameters:
  J:     {value: 0.05 kg*m^2, range: [0.01, 0.2], tunable: true}
  P_max: {value: 80 kW, range: [60, 100], tunable: true}
inputs:
  T:   {unit: N*m, range: [-400, 400]}
  key: {type: enum, values: [parked, ready, driving]}
  hot: {type: bool}
states:
  w: {unit: rad/s, initial: 0 rad/s, range: [-400, 1400]}
  angle: {unit: rad, initial: 0 rad, range: [-4, 4]}
equations:
  P: T * w
  far: angle - 1 rad
flow:
  w: J * der(w) = T
  angle: der(angle) = 0.01 * w
initial: m_0
modes:
"""
GUARDS = (
    "T * w > {0} kW and hot",
    "angle > {1} rad and w > {2} rad/s and not hot",
    "far < -{1} rad and w < -{2} rad/s and not hot",
    "P > P_max + {0} kW and key == driving and not hot and abs(angle) <= {1} rad",
    "w^2 + 2 1/s * angle * w < {2} rad^2/s^2 and not hot and T > {3} N*m and key == ready",
    "after({0} ms) and key == parked and sin(angle) > 0.{0} and not hot and abs(angle) < 0.{0} rad",
)


def large_chart(modes: int = 30, transitions: int = 6) -> str:
    """Return a continuous automaton with so many modes and transitions out of each.

    Half of the guards have no priority: each pair of them has to be proven disjoint.
    """
    lines = [HEAD]
    for mode in range(modes):
        lines.append(f"  m_{mode}:\n    transitions:\n")
        for way in range(transitions):
            target = (mode + 1 + way * way + way) % modes
            numbers = (10 + (mode * 7 + way) % 60, 1 + (mode + way) % 3, 5 + mode, 100 + mode)
            guard = GUARDS[way % len(GUARDS)].format(*numbers)
            priority = f", priority: {way}" if way >= 3 else ""
            lines.append(f"      w_{way}: {{to: m_{target}, when: '{guard}'{priority}}}\n")
    return "".join(lines) + "outputs: [w, angle, P, far]\n"
