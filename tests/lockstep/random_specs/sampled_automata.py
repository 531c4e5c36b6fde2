"""Sampled: a random ticking automaton as text - types, ranges, waits, memory, regions, runs."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from random import Random

from tests.lockstep.random_specs.expressions import Scope, real, truth, whole
from tests.lockstep.random_specs.models import PLANT_MODELS, PlantModel, advance, method_of
from tests.lockstep.random_specs.rewind_transitions import with_rewinds
from tests.lockstep.random_specs.spec import Aim, Spec

PERIOD_MS = 10
WAITS_MS = (0, 5, 10, 15, 25, 30, 47)
"""None, shorter than the period, whole periods, and between them."""
KEYS = ("cold", "warm", "hot")
HANDLING = ("", "", ", fallback: hold", ", fallback: 1.5", ", on_range: hold")
FAULTY = (", on_range: fault", ", on_range: hold, fallback: 0.5")


def random_sampled_spec(draw: Random, name: str) -> Spec:
    """Return a random sampled automaton."""
    flavour = draw.choice(("plain", "plain", "plain", "regions", "carried", "carried"))
    made = _Sampled(draw, name, flavour)
    text = "\n".join(made.lines()) + "\n"
    texts = {name: text, **({made.model.name: made.model.text} if made.model else {})}
    ticks = tuple(-(-wait // PERIOD_MS) for wait in made.waits)
    return Spec(name, texts, tuple(made.aims), ticks)


@dataclass
class _Sampled:
    """Draws the sections in the order of the file; later ones read what earlier ones declare."""

    draw: Random
    name: str
    flavour: str
    aims: list[Aim] = field(default_factory=list)
    waits: list[int] = field(default_factory=list)
    waiting: set[tuple[str, str]] = field(default_factory=set)

    def __post_init__(self) -> None:
        draw = self.draw
        self.model: PlantModel | None = (
            draw.choice(PLANT_MODELS) if self.flavour == "carried" else None
        )
        self.method = method_of(draw, self.model) if self.model else ""
        self.modes = [f"m_{k}" for k in range(draw.randint(2, 6))]
        self.has_fault_mode = draw.random() < 0.25
        self.levels = {n: [round(draw.uniform(-6.0, 6.0), 2) for _ in range(2)] for n in "uvw"}
        tables = ("lookup(curve, u)", "lookup(plane, v, x)", "lookup(plane, w, w)")
        self.scope = Scope(
            ("u", "v", "w", "x", "z", "a", "p", "d", "k", "m"),
            ("go", "flag", "key == hot", "gear != key", "u > v", "previous(flag)"),
            ("k", "m"),
            tables,
            (
                "previous(u)",
                "previous(x)",
                "delay(v, 35 ms)",
                "delay(x, 20 ms)",
                "previous(u * w)",
                "previous(k)",
            ),
        )
        if self.model:
            parts = [f"{state} / 1 {unit}" for state, unit, _ in self.model.states]
            self.scope = self.scope.with_reals(*parts)
        self.conditions = [self._condition(k) for k in range(4)]

    def _condition(self, number: int) -> str:
        """A relation of an input and a level: inputs are steered to hold it for some ticks."""
        name = self.draw.choice("uvw")
        level = self.draw.choice(self.levels[name])
        more = self.draw.choice(("", "", "", " + p", " * d", " - 0.1 * z"))
        text = f"{name}{more} {self.draw.choice(('>', '>=', '<', '<='))} {level}"
        return text if number < 3 else f"{text} and (go or m >= 1)"

    def lines(self) -> list[str]:
        found = ["language: 1", f"automaton: {self.name}", f"period: {PERIOD_MS} ms"]
        found += ["numbers: float64", *self._declared()]
        found += [f"initial: {self.modes[0]}", "modes:"]
        others = self.modes
        for mode in others:
            found += self._mode(mode)
        if self.flavour == "regions":
            found += self._regions()
        found.append(f"outputs: [{', '.join(self._outputs())}]")
        found = with_rewinds(self.draw, found, self.model)
        return [re.sub(r"<(\w*)\.(\w+)>", self._memory, line) for line in found]

    def _memory(self, wish: re.Match[str]) -> str:
        """Wait counters are kept where the target has some."""
        has_some = (wish[1], wish[2]) in self.waiting
        return ", memory: continue" if has_some else ""

    def _outputs(self) -> list[str]:
        names = ["x", "z", "e_1", "e_2", "s", "k", "flag", "gear", "mode", "faults"]
        return names + [state for state, _, _ in self.model.states] if self.model else names

    def _declared(self) -> list[str]:
        draw, found = self.draw, ["parameters:"]
        a, p = round(draw.uniform(0.2, 3.0), 3), round(draw.uniform(-2.0, 2.0), 3)
        found += [f"  a: {{value: {a}}}", f"  p: {{value: {p}, tunable: true, range: [-4, 4]}}"]
        found.append('  d: {derived: "p * 2 / a + 0.1 - (a - p)", unit: "1"}')
        points = ", ".join(f"{x}: {draw.uniform(-2.0, 2.0):.3f}" for x in (-4, -1.5, 0, 2, 7))
        tunable = draw.choice(("tunable: true, ", ""))
        found.append(f"  curve: {{{tunable}table: {{over: u, points: {{{points}}}}}}}")
        rows = [f"{x}: {{-3: {draw.uniform(-2, 2):.2f}, 3: 0.25}}" for x in (-2, 1, 5)]
        found.append(f"  plane: {{table: {{over: [v, x], points: {{{', '.join(rows)}}}}}}}")
        if self.model:
            (_, unit, _), _ = self.model.states
            noise = f"{unit}^2/s^3"
            found += [f"  q: {{value: 3 {noise}}}", f"  r: {{value: 0.02 {unit}^2}}"]
            found.insert(0, f"model: {self.model.name}")
        if self.has_fault_mode:
            found.insert(0, f"fault_mode: {self.modes[-1]}")
        if draw.random() < 0.4:
            found.insert(0, "faults: {odd: {latched: false}}")
            self.odd = ", fault: odd"
        else:
            self.odd = ""
        return [*found, *self._inputs(), *self._carried(), *self._equations()]

    def _inputs(self) -> list[str]:
        draw, found = self.draw, ["inputs:"]
        for name, high in zip("uvw", (8, 60, 1000), strict=True):
            ways = (
                (*HANDLING, *FAULTY[: 1 if name == "w" else 0]) if self.has_fault_mode else HANDLING
            )
            odd = self.odd if draw.random() < 0.5 else ""
            line = f'  {name}: {{unit: "1", range: [-{high}, {high}]{draw.choice(ways)}{odd}}}'
            found.append(line)
            self.aims.append(Aim(name, "real", -high, high, tuple(self.levels[name])))
        found += ["  m: {type: int, range: [-5, 9]}", "  go: {type: bool}"]
        found.append(f"  key: {{type: enum, values: [{', '.join(KEYS)}]}}")
        self.aims.append(Aim("m", "whole", -5, 9, (1.0, 3.0)))
        self.aims += [Aim("go", "truth", 0, 1, ()), Aim("key", "enum", 0, 2, ())]
        if self.model:
            force, unit = self.model.force
            (_, first, high), _ = self.model.states
            found.append(f"  {force}: {{unit: {unit}, range: [-90, 90], default: 0 {unit}}}")
            found.append(f"  y_p: {{unit: {first}, range: [-{high}, {high}]}}")
            self.aims += [
                Aim(force, "real", -90, 90, (5.0, -5.0)),
                Aim("y_p", "real", -1, 1, (0.2,)),
            ]
        return found

    def _carried(self) -> list[str]:
        draw = self.draw
        handling = draw.choice(HANDLING[:3])
        found = ["states:", f'  x: {{unit: "1", initial: "u + a", range: [-50, 50]{handling}}}']
        found.append('  z: {unit: "1", initial: "x - v", range: [-9, 9], on_range: hold}')
        if self.flavour == "regions":
            found.append('  t: {unit: "1", initial: "0", range: [-30, 30]}')
        if self.model:
            found += [
                f"  {state}: {{initial: 0 {unit}, range: [-{high}, {high}]}}"
                for state, unit, high in self.model.states
            ]
        found += ["discrete:", "  k: {type: int, initial: 0, range: [-4, 12]}"]
        found.append("  flag: {type: bool, initial: false}")
        found.append(f"  gear: {{type: enum, values: [{', '.join(KEYS)}], initial: warm}}")
        return found

    def _equations(self) -> list[str]:
        """A chain, out of order in the file; conditions that waits stand for."""
        draw = self.draw
        found = [
            f'  e_3: "{real(draw, self.scope.with_reals("e_2", "e_1"))}"',
            f'  e_1: "{real(draw, self.scope, 3)}"',
            f'  e_2: "e_1 * 0.5 - ({real(draw, self.scope.with_reals("e_1"))})"',
            f'  e_4: "clip({real(draw, self.scope.with_reals("e_1", "e_2", "e_3"), 3)}, -40, 40)"',
            f'  b: "{truth(draw, self.scope.with_reals("e_1", "e_4"), 2)}"',
            f'  i: "{whole(draw, self.scope)}"',
        ]
        found += [f'  q_{k}: "{text}"' for k, text in enumerate(self.conditions)]
        self.scope = self.scope.with_reals("e_1", "e_2", "e_3", "e_4").with_truths(
            "b", "i > 2", "q_0", "q_3"
        )
        return ["equations:", *found]

    def _mode(self, mode: str) -> list[str]:
        draw, scope = self.draw, self.scope
        found = [f"  {mode}:", "    equations:", f'      s: "0.3 + ({real(draw, scope)})"']
        guard = ""
        if self.model and draw.random() < 0.7:
            carrying, guard = advance(draw, self.model, self.method)
            found += carrying
        is_plain = self.flavour != "regions"
        if is_plain and draw.random() < 0.3:
            found.append(f'    entry: {{k: "{whole(draw, scope)}", gear: key}}')
        if is_plain and draw.random() < 0.25:
            found.append(
                f'    exit: {{z: "{real(draw, scope.with_reals("s"), 1)}", flag: not flag}}'
            )
        if draw.random() < 0.75:
            found += ["    update:", f'      x: "{self._growing()}"']
            found += [f'      z: "{real(draw, scope.with_reals("s"), 1)}"'] * draw.randint(0, 1)
            if is_plain:
                found += ['      k: "if b then k + 1 else k - m"'] * draw.randint(0, 1)
        return found + self._transitions(mode, self.modes, guard, "")

    def _growing(self) -> str:
        step = real(self.draw, self.scope.with_reals("s"), 1)
        return self.draw.choice(
            (f"x + clip({step}, -3, 3)", f"0.9 * x + clip({step}, -9, 9)", step)
        )

    def _transitions(self, mode: str, modes: list[str], guard: str, region: str) -> list[str]:
        """One to three transitions with different priorities, not in the order of the file."""
        draw = self.draw
        others = [other for other in modes if other != mode]
        own = draw.sample(others, min(len(others), draw.randint(1, 3)))
        if draw.random() < 0.15:
            own.append(mode)
        found = ["    transitions:"]
        priorities = draw.sample(range(9), len(own))
        for k, (target, priority) in enumerate(zip(own, priorities, strict=True)):
            wait, when = self._when(guard if k else "", is_first=k == 0)
            if wait and "wait: 0 ms" not in wait:
                self.waiting.add((region, mode))
            wait += f"<{region}.{target}>" if draw.random() < 0.2 else ""
            wait += "" if region else f"<back {mode} {target}>"
            names = draw.choice(((), ("x",), ("x", "z"), ("x", "z", "k")))
            reset = ", ".join(f"{n}: {v}" for n, v in self._reset(names, region).items())
            found.append(
                f'      {target}: {{when: "{when}", priority: {priority}{wait}'
                + (f", reset: {{{reset}}}}}" if reset else "}")
            )
        return found

    def _when(self, guard: str, is_first: bool) -> tuple[str, str]:
        """Return a wait and a guard: a condition by name where it waits, else any."""
        draw = self.draw
        if guard:
            return "", guard
        if draw.random() < 0.45:
            wait = draw.choice(WAITS_MS)
            self.waits.append(wait)
            condition = f"q_{draw.randrange(len(self.conditions))}"
            return f", wait: {wait} ms", condition
        relation = draw.choice(self.conditions)
        if is_first:  # a way out that inputs can take
            return "", relation
        forms = [relation, relation, f"({relation}) and k < 9", f"rising({relation})"]
        forms += [f"rising({relation})", f"falling({relation})", f"falling({relation})"]
        forms += ["after(40 ms)", f"({relation}) or after(200 ms)", "b"]
        forms += ["key == hot", "m > 3 and not go", f"rising(go) and {truth(draw, self.scope)}"]
        if self.flavour == "regions":
            forms += ["in(side.left)", f"in(side.right) and ({relation})"] * 2
        return "", draw.choice(forms)

    def _reset(self, names: tuple[str, ...], region: str) -> dict[str, str]:
        """Half of the resets of two swap them."""
        draw, scope = self.draw, self.scope.with_reals("s")
        if region:
            return {"t": '"x - t"'} if names else {}
        if len(names) > 1 and draw.random() < 0.5:
            return {"x": "z", "z": "x"}
        found = {name: f'"{real(draw, scope, 1)}"' for name in names if name != "k"}
        return {**found, "k": f'"{whole(draw, scope)}"'} if "k" in names else found

    def _regions(self) -> list[str]:
        names = ["left", "right"]
        found = ["regions:", "  side:", "    initial: left", "    modes:"]
        for name in names:
            lines = [
                f"  {name}:",
                f'    equations: {{h: "0.5 * ({real(self.draw, self.scope, 1)})"}}',
            ]
            lines += ['    update: {t: "t + 0.25 * (h - t) / (1 + abs(h))"}']
            lines += self._transitions(name, names, "", "side")
            found += ["    " + line for line in lines]
        return found
