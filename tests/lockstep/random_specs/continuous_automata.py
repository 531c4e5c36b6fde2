"""Flowing: a random continuous automaton as text - methods, crossings, waits, chains, regions.

Transitions to a mode further back in the file wait: no cycle of them takes no time (rule 12).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from random import Random

from tests.lockstep.random_specs.expressions import Scope, real, truth
from tests.lockstep.random_specs.spec import Aim, Spec

STEP_MS = 10
WAITS_MS = (3, 10, 12.5, 20, 37)
METHODS = ("euler", "midpoint", "rk4", "midpoint", "exact", "exponential")
STATES = ("x", "z", "s")


def random_continuous_spec(draw: Random, name: str) -> Spec:
    """Return a random continuous automaton."""
    made = _Flowing(draw, name)
    text = "\n".join(made.lines()) + "\n"
    steps = tuple(-int(-wait // STEP_MS) for wait in made.waits)
    return Spec(name, {name: text}, tuple(made.aims), steps)


@dataclass
class _Flowing:
    """Draws the sections in the order of the file."""

    draw: Random
    name: str
    aims: list[Aim] = field(default_factory=list)
    waits: list[float] = field(default_factory=list)

    def __post_init__(self) -> None:
        draw = self.draw
        self.method = draw.choice(METHODS)
        self.modes = [f"m_{k}" for k in range(draw.randint(2, 5))]
        self.has_region = draw.random() < 0.3 and self.method != "exact"
        self.levels = {name: [round(draw.uniform(-3.0, 3.0), 2) for _ in range(2)] for name in "uv"}
        memory = ("delay(x, 25 ms)", "delay(u, 10 ms)") if draw.random() < 0.4 else ()
        memory = () if self.method == "exact" else memory
        reals = ("u", "v", "x", "z", "a", "p", "d", "k")
        truths = ("go", "flag", "u > v", "x > z")
        self.scope = Scope(reals, truths, ("k",), ("lookup(curve, u)", "lookup(curve, v)"), memory)

    def lines(self) -> list[str]:
        draw, found = self.draw, ["language: 1", f"automaton: {self.name}", f"step: {STEP_MS} ms"]
        found += [
            f"method: {self.method}",
            "parameters:",
            f"  a: {{value: {draw.uniform(0.5, 3)}}}",
        ]
        found.append(f"  p: {{value: {draw.uniform(-2, 2)}, tunable: true, range: [-4, 4]}}")
        found.append('  d: {derived: "p / a + 0.1", unit: "1"}')
        points = ", ".join(f"{x}: {draw.uniform(-2.0, 2.0):.3f}" for x in (-4, -1, 0.5, 3))
        found.append(f"  curve: {{table: {{over: u, points: {{{points}}}}}}}")
        found += ["inputs:", '  u: {unit: "1", range: [-9, 9]}', '  v: {unit: "1"}']
        found += ["  go: {type: bool}"]
        self.aims = [Aim(n, "real", -9, 9, tuple(self.levels[n])) for n in "uv"]
        self.aims.append(Aim("go", "truth", 0, 1, ()))
        found += ["states:", '  x: {unit: "1", initial: "u + 0.1", range: [-20, 20]}']
        found += ['  z: {unit: "1", initial: "a - x", range: [-20, 20]}']
        found += ['  s: {unit: "1", initial: "0", range: [-20, 20]}']
        found += ["discrete:", "  k: {type: int, initial: 0, range: [-99, 99]}"]
        found += ["  flag: {type: bool, initial: true}"]
        found += ["equations:", f'  e_2: "e_1 * 0.5 - ({real(draw, self.scope)})"']
        found += [f'  e_1: "{real(draw, self.scope, 3)}"', f'  b: "{truth(draw, self.scope, 2)}"']
        found += ["flow:", f'  x: "1 s * der(x) = {self._rate("x")}"']
        found += ["initial: m_0", "modes:"]
        for mode in self.modes:
            found += self._mode(mode)
        if self.has_region:
            found += self._region()
        return [*found, "outputs: [x, z, s, e_1, e_2, k, flag, mode]"]

    def _rate(self, state: str) -> str:
        """What damps a state, what drives it; of `exact` all terms are affine."""
        draw = self.draw
        damped = f"-{draw.uniform(0.5, 20.0)} * {state}"
        coupled = draw.choice(("", " + 3 * z", " - 9 * x", " + 0.7 * u", " - a * v"))
        if self.method == "exact":
            return f"{damped}{coupled} + {draw.uniform(-9, 9)}"
        return f"{damped}{coupled} + clip({real(draw, self.scope.with_reals('s'))}, -40, 40)"

    def _mode(self, mode: str) -> list[str]:
        draw, found = self.draw, [f"  {mode}:", "    flow:"]
        found.append(f'      z: "1 s * der(z) = {self._rate("z")}"')
        if not self.has_region:
            found.append(f'      s: "1 s * der(s) = {self._rate("s")}"')
        is_plain = not self.has_region
        if is_plain and draw.random() < 0.3:
            found.append('    entry: {k: "if k < 50 then k + 1 else 0 - k"}')
        if is_plain and draw.random() < 0.3:
            found.append("    exit: {flag: not flag}")
        return [*found, *self._transitions(mode, self.modes, "x")]

    def _region(self) -> list[str]:
        names, found = ["left", "right"], ["regions:", "  side:", "    initial: left", "    modes:"]
        for name in names:
            lines = [f"  {name}:", "    flow:", f'      s: "1 s * der(s) = {self._rate("s")}"']
            lines += self._transitions(name, names, "s")
            found += ["    " + line for line in lines]
        return found

    def _transitions(self, mode: str, modes: list[str], state: str) -> list[str]:
        draw, found = self.draw, ["    transitions:"]
        here = modes.index(mode)
        others = [other for other in modes if other != mode]
        own = draw.sample(others, min(len(others), draw.randint(1, 2)))
        ahead = modes[(here + 1) % len(modes)]
        own = list(dict.fromkeys([*own, ahead]))
        for target, priority in zip(own, draw.sample(range(9), len(own)), strict=True):
            wait = ""
            if modes.index(target) < here or draw.random() < 0.3:
                self.waits.append(draw.choice(WAITS_MS))
                wait = f", wait: {self.waits[-1]} ms"
            reset = draw.choice(("", self._reset(state), self._reset(state)))
            when = self._steered() if target == ahead else self._when(state, bool(wait))
            found.append(f'      {target}: {{when: "{when}", priority: {priority}{wait}{reset}}}')
        return found

    def _reset(self, state: str) -> str:
        draw = self.draw
        if state == "s":
            return ', reset: {s: "-0.5 * s"}'
        value = f'"clip({real(draw, self.scope, 1)}, -9, 9)"'
        return draw.choice((", reset: {x: z, z: x}", f", reset: {{x: {value}}}"))

    def _steered(self) -> str:
        name = self.draw.choice("uv")
        return f"{name} {self.draw.choice(('>', '<='))} {self.draw.choice(self.levels[name])}"

    def _when(self, state: str, waits: bool) -> str:
        draw, steered = self.draw, self._steered()
        states = ("x", "z", "s") if state == "x" else ("s",)
        crossed = f"{draw.choice(states)} {draw.choice(('>', '<'))} {draw.uniform(-1, 1):.3f}"
        forms = [steered, steered, crossed, crossed, f"({crossed}) and ({steered})"]
        forms += [f"({crossed}) or ({steered})", "go", f"({steered}) and not flag"]
        if not waits:
            forms += ["after(40 ms)", f"after(15 ms) and ({steered})"]
        return draw.choice(forms)
