"""Shapes of large specs: valid texts of many parts, each part small; a size says how many."""

from __future__ import annotations

HEAD = """language: 1
automaton: large
parameters:
  k: {value: 2 N*m/rad, range: [1, 4]}
  c: {value: 0.5 N*m*s/rad, range: [0.1, 1], tunable: true}
  J: {value: 3 kg*m^2, range: [1, 9]}
inputs: {T_in: {unit: N*m, range: [-10, 10]}}
states:
  w: {unit: rad/s, initial: 0 rad/s, range: [-9, 9]}
  a: {unit: rad, initial: 0.1 rad, range: [-3, 3]}
"""
FLOW = """flow:
  w: J * der(w) = T_in - c * w
  a: der(a) = w
"""
TICK = "period: 10 ms\nnumbers: float64\n"


def modes_of_equations(modes: int, equations: int, sampled: bool = False) -> str:
    """Modes in a ring, each with its own equations: torques that read the one before."""
    lines = [HEAD, TICK if sampled else "", "initial: m_0\nmodes:\n"]
    for i in range(modes):
        lines += [f"  m_{i}:\n", "    equations:\n"]
        lines += [f"      e_{k}: {_torque(k, f'e_{k - 1}', i)}\n" for k in range(equations)]
        last = f"e_{equations - 1}"
        if sampled:
            lines.append(f"    update: {{w: w + 10 ms / J * ({last} - c * w), a: a + 10 ms * w}}\n")
        else:
            lines.append(f"    flow: {{w: J * der(w) = {last} - c * w, a: der(a) = w}}\n")
        lines.append(f"    transitions: {{m_{(i + 1) % modes}: {{when: {_over('a', i)}}}}}\n")
    return "".join([*lines, "outputs: [w, a, mode]\n"])


def _torque(k: int, before: str, shift: int = 0) -> str:
    """A torque of three summands that stays small whatever it follows."""
    inner = f"0.5 * {before}" if k else "T_in"
    spring, drag = f"k * (a - {k % 90 + 1}.{shift} mrad)", f"c * w * {k % 7 + 1}.5"
    return f"{inner} + {spring} - {drag} + max(T_in, 0.25 N*m)"


def _over(state: str, i: int) -> str:
    return f"{state} > {1 + i % 7}.{i} rad and w > 0 rad/s"


def chain(length: int) -> str:
    """Equations at the root, each reads the one before."""
    equations = [f"  e_{k}: {_torque(k, f'e_{k - 1}')}\n" for k in range(length)]
    flow = FLOW.replace("T_in", f"e_{length - 1}")
    return "".join([HEAD, "equations:\n", *equations, flow, "outputs: [w, a]\n"])


def reversed_equations(length: int) -> str:
    """The same chain written from its end."""
    head, start, rest = chain(length).partition("equations:\n")
    equations, flow, tail = rest.partition("flow:")
    lines = "\n".join(reversed(equations.splitlines()))
    return f"{head}{start}{lines}\n{flow}{tail}"


def parameters(count: int) -> str:
    """Parameters, every second one derived from the one before it."""
    lines = [
        f"  p_{n}: {{derived: 0.5 * p_{n - 1} + 1 N*m, unit: N*m}}\n"
        if n % 2
        else f"  p_{n}: {{value: {n}.5 N*m, range: [0, 1.0e+6], tunable: true}}\n"
        for n in range(count)
    ]
    equations = [f"  T_{n}: p_{n} + {_before('T', n)}\n" for n in range(0, count, 10)]
    flow = FLOW.replace("T_in", f"T_{(count - 1) // 10 * 10}")
    text = HEAD.replace("inputs:", "".join(lines) + "inputs:")
    return "".join([text, "equations:\n", *equations, flow, "outputs: [w, a]\n"])


def _before(letter: str, n: int) -> str:
    return f"{letter}_{n - 10}" if n >= 10 else "T_in"


def long_expressions(count: int, terms: int = 60) -> str:
    """Equations of many terms each, up to the longest text that is read."""
    inner = [f"c * w * {n}.5" for n in range(terms)]
    equations = [f"  e_{k}: {' + '.join(inner)} - {k}.25 N*m\n" for k in range(count)]
    flow = FLOW.replace("T_in", f"e_{count - 1}")
    return "".join([HEAD, "equations:\n", *equations, flow, "outputs: [w, a]\n"])


def transitions(modes: int, each: int, sampled: bool = False) -> str:
    """Modes that each lead to the next `each` others, with priorities, waits and resets."""
    lines = [HEAD, TICK if sampled else "", "" if sampled else FLOW, "initial: m_0\nmodes:\n"]
    for i in range(modes):
        lines += [f"  m_{i}:\n", "    equations: {g: a - 1 rad}\n"]
        if sampled:
            lines.append("    update: {w: w + 10 ms / J * (T_in - c * w), a: a + 10 ms * w}\n")
        lines.append("    transitions:\n")
        for k in range(each):
            more = "wait: 3 ms, " if k % 3 == 0 else "reset: {a: 0.5 * a}, " if k % 3 == 1 else ""
            target = (i + k + 1) % modes
            when = f"g > {i}.{k} rad and w > 0.{k} rad/s"
            lines.append(f"      m_{target}: {{when: {when}, {more}priority: {k + 1}}}\n")
    return "".join([*lines, "outputs: [w, a, mode]\n"])


def regions(count: int, modes: int) -> str:
    """Parallel regions, each with modes that give one torque."""
    lines = [HEAD, FLOW.replace("T_in", f"e_{count - 1}"), "regions:\n"]
    for r in range(count):
        lines += [f"  r_{r}:\n", "    initial: m_0\n    modes:\n"]
        for i in range(modes):
            torque = _torque(r, f"e_{r - 1}", i)
            when = f"a > {i}.{r} rad and w > 0 rad/s"
            to = f"m_{(i + 1) % modes}"
            lines.append(f'      m_{i}:\n        equations: {{e_{r}: "{torque}"}}\n')
            lines.append(f"        transitions: {{{to}: {{when: {when}}}}}\n")
    return "".join([*lines, "outputs: [w, a]\n"])


def table(rows: int, columns: int) -> str:
    """A table over two axes."""
    lines = ["  lim:\n    table:\n      over: [a, w]\n      unit: N*m\n      points:\n"]
    for r in range(rows):
        cells = ", ".join(f"{c} rad/s: {(r * c) % 97}.5" for c in range(columns))
        lines.append(f"        {r} rad: {{{cells}}}\n")
    text = HEAD.replace("inputs:", "".join(lines) + "inputs:")
    return text + FLOW.replace("T_in", "T_in + lookup(lim, a, w)") + "outputs: [w, a]\n"


def equations_with_memory(count: int) -> str:
    """A sampled automaton whose equations read values of earlier ticks."""
    lines = [HEAD, TICK, "equations:\n"]
    for k in range(count):
        before = f"e_{k - 1}" if k else "T_in"
        lines.append(f"  e_{k}: 0.5 * previous({before}) + k * (a - {k}.5 mrad)\n")
    lines.append(f"modes:\n  run:\n    update: {{w: w + 10 ms / J * e_{count - 1}}}\n")
    return "".join([*lines, "outputs: [w, a]\n"])


def system(instances: int, different: int = 8) -> dict[str, str]:
    """Many instances of one sampled automaton in a row, some different, and a scenario."""
    small = HEAD.replace("automaton: large", "automaton: part") + TICK
    small += "modes: {run: {update: {w: w + 10 ms / J * (T_in - c * w)}}}\n"
    small += "equations: {T_out: k * a + c * w}\noutputs: [w, a, T_out]\n"
    lines = ["language: 1\nsystem: large\ninputs: {T: {unit: N*m}}\ninstances:\n"]
    for n in range(instances):
        inertia = f"{n % different + 1}.5 kg*m^2"
        lines.append(f"  i_{n}: {{of: part, values: {{J: {inertia}}}}}\n")
    lines.append("connections:\n")
    lines += [f"  i_{n}.T_in: {f'0.5 * i_{n - 1}.T_out' if n else 'T'}\n" for n in range(instances)]
    lines.append(f"outputs: {{T_out: i_{instances - 1}.T_out}}\n")
    return {"part": small, "large": "".join(lines), "run": scenario(10)}


def scenario(steps: int) -> str:
    """A scenario of a system whose input `T` has many steps."""
    pairs = ", ".join(f"{n * 1e-3:.3f} s: {n % 19}.5 N*m" for n in range(1, steps + 1))
    return (
        f"language: 1\nscenario: run\nof: large\nhorizon: {steps} ms\n"
        f"inputs: {{T: {{start: 1 N*m, steps: {{{pairs}}}}}}}\n"
    )
