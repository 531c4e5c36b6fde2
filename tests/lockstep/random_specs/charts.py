"""Charts: random specs with modes inside modes, regions, history, events, waits and actions."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass, field
from random import Random
from typing import Any

from tests.lockstep.random_specs.spec import Aim, Spec

NESTING, REGIONS = 3, 2
EVENTS = ("go", "back")
OWN = ("trip", "ping")
LEVELS = (-2.0, 0.0, 1.0, 3.0)
WAITS = (1, 2, 4)
PERIOD_MS = 10
Body = dict[str, Any]


@dataclass
class Place:
    """A mode or region while it is drawn; `region` is the number of its variables."""

    name: str
    path: str
    kind: str
    body: Body
    region: int
    depth: int
    parent: Place | None
    children: list[Place] = field(default_factory=list)

    def inside(self) -> Iterator[Place]:
        """Yield it and all below it."""
        yield self
        for child in self.children:
            yield from child.inside()


def chart(draw: Random, name: str) -> Spec:
    """Return a random chart."""
    return _Chart(draw, name).spec()


def chart_of(number: int) -> Spec:
    """Return the random chart of a number: always the same."""
    return chart(Random(f"chart {number}"), f"chart_{number}")


class _Chart:
    def __init__(self, draw: Random, name: str) -> None:
        self.draw = draw
        self.name = name
        self.count = 0
        self.regions = 0
        self.priority = 0
        self.tops: list[Place] = []

    def spec(self) -> Spec:
        draw = self.draw
        names = ["chart", "beside"] if draw.random() < 0.25 else ["chart"]
        for region in names:
            top = Place(region, region, "region", {}, self._new_region(), 0, None)
            self._modes(top, NESTING if region == "chart" else 1)
            self.tops.append(top)
        raising = draw.random() < 0.7
        for top in self.tops:
            for place in list(top.inside()):
                if place is not top:
                    self._fill(place, raising)
        for top in self.tops:
            _without_idle_memory(top)
        steps = draw.choice((2, 3, 8)) if raising else draw.choice((1, 1, 4))
        root: Body = {
            "language": 1,
            "automaton": self.name,
            "period": f"{PERIOD_MS} ms",
            "numbers": "float64",
            "order": draw.choice(("outer_first", "inner_first")),
            "micro_steps": steps,
            "parameters": {"a": {"value": round(draw.uniform(0.3, 0.9), 3)}},
            "inputs": {
                n: {"unit": "1", "range": [-8, 8], "fallback": 0, "fault": "held"} for n in "uv"
            },
            "events": {n: {"from": "input"} for n in EVENTS} | {n: {} for n in OWN},
            "faults": {"held": {"latched": draw.random() < 0.5}},
            "discrete": self._variables(),
            "equations": {"e_1": "u * a + x_0"},
            "regions": {top.name: top.body for top in self.tops},
            "outputs": [*self._variables(), "e_1", "w", "mode", "faults"],
        }
        text = "\n".join(f"{key}: {_yaml(value)}" for key, value in root.items()) + "\n"
        aims = [Aim(name, "real", -8, 8, LEVELS) for name in "uv"]
        aims += [Aim(name, "truth", 0, 1, ()) for name in EVENTS]
        return Spec(self.name, {self.name: text}, tuple(aims), WAITS)

    def _new_region(self) -> int:
        self.regions += 1
        return self.regions - 1

    def _variables(self) -> Body:
        found: Body = {}
        for number in range(self.regions):
            real = {"unit": "1", "initial": 0, "range": [-40, 40], "fault": "held"}
            found |= {f"x_{number}": real, f"y_{number}": dict(real)}
            found[f"k_{number}"] = {
                "type": "int",
                "initial": 0,
                "range": [0, 30000],
                "fault": "held",
            }
        return found

    def _modes(self, owner: Place, depth: int) -> None:
        """Draw the modes inside a region or superstate."""
        owner.body["modes"] = {}
        for _ in range(self.draw.randint(2, 3)):
            self._add(owner, self._kind(depth), depth)
        if owner.kind != "region" and self.draw.random() < 0.35:
            self._add(owner, "final", 0)
        plain = [c for c in owner.children if c.kind != "final"]
        owner.body["initial"] = self.draw.choice(plain).name
        if self.draw.random() < 0.3:
            kept = self._child(owner, "history")
            kept.body["history"] = self.draw.choice(("shallow", "deep"))
            kept.body["initial"] = self.draw.choice(plain).name
            owner.body["modes"][kept.name] = kept.body

    def _kind(self, depth: int) -> str:
        if depth <= 1:
            return "atomic"
        return self.draw.choices(("atomic", "compound", "parallel"), (3, 4, 3))[0]

    def _child(self, owner: Place, kind: str) -> Place:
        name = f"{'r' if kind == 'region' else 'm'}{self.count}"
        self.count += 1
        prefix = "" if owner.path == "chart" else f"{owner.path}."
        child = Place(name, f"{prefix}{name}", kind, {}, owner.region, owner.depth + 1, owner)
        owner.children.append(child)
        return child

    def _add(self, owner: Place, kind: str, depth: int) -> None:
        child = self._child(owner, kind)
        owner.body["modes"][child.name] = child.body
        if kind == "final":
            child.body["final"] = True
        if kind == "compound":
            self._modes(child, depth - 1)
        if kind == "parallel":
            child.body["regions"] = {}
            for place in range(REGIONS):
                region = self._child(child, "region")
                region.region = self._new_region()
                self._modes(region, depth - 1)
                region.body["priority"] = place
                child.body["regions"][region.name] = region.body

    def _fill(self, place: Place, raising: bool) -> None:
        """Draw what happens in a mode, and how it is left."""
        draw, body, own = self.draw, place.body, place.region
        is_top = place.parent is not None and place.parent.kind == "region"
        if is_top and place.parent in self.tops[:1] and place.kind != "history":
            body["equations"] = {"w": draw.choice(("u - v", "x_0 * a", "1", "e_1 + v"))}
        if place.kind == "history":
            return
        if draw.random() < 0.4:
            body["entry"] = {f"k_{own}": f"k_{own} + 1", f"x_{own}": self._value(own)}
        if draw.random() < 0.4:
            body["exit"] = {f"x_{own}": self._value(own)}
        if draw.random() < 0.4 and place.kind in ("atomic", "parallel"):
            body["update"] = {f"y_{own}": self._value(own)}
        ways: Body = {}
        if place.kind != "final":
            for number in range(draw.choices((0, 1, 2, 3), (1, 5, 3, 1))[0]):
                ways[f"t{number}"] = self._way(place, raising)
            if any(child.kind == "final" for child in place.children):
                ways["done"] = {"to": self._target(place).path, **self._priority()}
        if ways:
            body["transitions"] = ways

    def _value(self, own: int) -> str:
        other = self.draw.randrange(self.regions)
        terms = (
            f"x_{own} * a + u",
            f"x_{other} - v",
            f"y_{other} + 0.1",
            "e_1 * a",
            f"u * x_{own}",
        )
        return self.draw.choice(terms)

    def _priority(self) -> Body:
        self.priority += 1
        return {"priority": self.priority}

    def _way(self, place: Place, raising: bool) -> Body:
        draw = self.draw
        way: Body = {**self._where(place), **self._priority()}
        if draw.random() < 0.5:
            events = [*EVENTS, *(OWN if raising else ())]
            way["event"] = draw.sample(events, draw.randint(1, 2))
            if draw.random() < 0.4:
                way["when"] = self._guard()
        else:
            way["when"] = self._guard()
            if draw.random() < 0.5 and "rising" not in way["when"]:
                way["wait"] = f"{draw.choice(WAITS) * PERIOD_MS} ms"
        if draw.random() < 0.4:
            way["reset"] = {f"x_{place.region}": self._value(place.region)}
        if raising and draw.random() < 0.35:
            way["raise"] = draw.choice(OWN)
        if way["to"] and draw.random() < 0.3:
            way["memory"] = "continue"
        return way

    def _where(self, place: Place) -> Body:
        """Where a transition leads: one mode, several, inside its source, or nowhere."""
        draw, kind = self.draw, self.draw.random()
        top = self._top(place)
        if kind < 0.08:
            return {"to": []}
        inner = [p for p in place.inside() if p is not place]
        if kind < 0.2 and place.kind == "compound":
            return {"to": draw.choice(inner).path, "internal": True}
        parallel = [p for p in top.inside() if p.kind == "parallel"]
        if kind < 0.32 and parallel:
            regions = draw.choice(parallel).children
            return {"to": [draw.choice(list(region.inside())).path for region in regions]}
        target = self._target(place)
        way: Body = {"to": target.path}
        if target.kind in ("compound", "parallel") and draw.random() < 0.5:
            way["history"] = draw.choice(("shallow", "deep"))
        return way

    def _target(self, place: Place) -> Place:
        top = self._top(place)
        return self.draw.choice([p for p in top.inside() if p is not top])

    def _top(self, place: Place) -> Place:
        while place.parent is not None:
            place = place.parent
        return place

    def _guard(self) -> str:
        draw = self.draw
        places = [p for top in self.tops for p in top.inside() if p.kind != "history"]
        relation = f"{draw.choice('uv')} {draw.choice(('>', '<='))} {draw.choice(LEVELS)}"
        other = draw.randrange(self.regions)
        kinds = (
            relation,
            relation,
            f"rising({relation})",
            f"{relation} and after({draw.choice(WAITS) * PERIOD_MS} ms)",
            f"{relation} and in({draw.choice(places).path})",
            f"x_{other} > {draw.choice(LEVELS)}",
            f"w > {draw.choice(LEVELS)} or {relation}",
        )
        return draw.choice(kinds)


def _without_idle_memory(top: Place) -> None:
    """`memory: continue` is refused where nothing that is entered waits."""
    waiting = [p.path for p in top.inside() if any("wait" in w for w in _ways(p))]
    for place in top.inside():
        for way in _ways(place):
            targets = way["to"] if isinstance(way["to"], list) else [way["to"]]
            if not any(_together(path, target) for path in waiting for target in targets):
                way.pop("memory", None)


def _ways(place: Place) -> list[Body]:
    return list(place.body.get("transitions", {}).values())


def _together(path: str, target: str) -> bool:
    return f"{path}.".startswith(f"{target}.") or f"{target}.".startswith(f"{path}.")


def _yaml(value: object) -> str:
    return value if isinstance(value, str) else json.dumps(value)
