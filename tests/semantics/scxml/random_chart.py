"""Random chart: plain JSON like the conformance cases, with what the oracle makes of its events."""

from __future__ import annotations

from random import Random
from typing import Any

from tests.semantics.scxml.oracle import EndlessMacrostep, Oracle

Raw = dict[str, Any]
EVENTS = ("e1", "e2", "e3")
DEPTH = 3
STEPS = 30


def random_case(draw: Random) -> Raw:
    """Return a case whose macrosteps all end."""
    while True:
        chart = _Chart(draw).made()
        try:
            return _played(draw, chart)
        except EndlessMacrostep:
            continue


def _played(draw: Random, chart: Raw) -> Raw:
    oracle = Oracle(chart)
    initial = sorted(oracle.atomic)
    steps = []
    for _ in range(STEPS):
        event = draw.choice(EVENTS)
        oracle.send(event)
        steps.append({"event": event, "expect": sorted(oracle.atomic)})
    return {"chart": chart, "initial": initial, "steps": steps}


class _Chart:
    """A tree of states, then transitions between them."""

    def __init__(self, draw: Random) -> None:
        self.draw = draw
        self.count = 0
        self.states: list[Raw] = []
        self.above: dict[str, list[Raw]] = {}

    def made(self) -> Raw:
        root = self._state("compound", DEPTH, [])
        for state in self.states:
            if state["kind"] not in ("history", "final") and state is not root:
                self._ways(state)
        return root

    def _state(self, kind: str, depth: int, above: list[Raw]) -> Raw:
        state: Raw = {"id": f"s{self.count}", "kind": kind}
        self.count += 1
        self.states.append(state)
        self.above[state["id"]] = above
        if kind in ("compound", "parallel"):
            few = 2 if kind == "parallel" else self.draw.randint(2, 3)
            inner = [*above, state]
            state["children"] = [
                self._state(self._kind(depth - 1), depth - 1, inner) for _ in range(few)
            ]
            if self.draw.random() < 0.4:
                state["children"].insert(self.draw.randint(0, few), self._history(state, inner))
            own = [c for c in state["children"] if kind == "compound"]
            if own:
                state["initial"] = [self.draw.choice(own)["id"]]
        return state

    def _history(self, parent: Raw, above: list[Raw]) -> Raw:
        state = self._state("history", 0, above)
        deep = parent["kind"] == "parallel" or self.draw.random() < 0.5
        state["history"] = "deep" if deep else "shallow"
        first = self.draw.choice(parent["children"])
        state["transitions"] = [{"target": [first["id"]]}]
        return state

    def _kind(self, depth: int) -> str:
        if depth <= 0:
            return "atomic"
        return self.draw.choices(("atomic", "compound", "parallel"), (3, 4, 3))[0]

    def _ways(self, source: Raw) -> None:
        ways = []
        for _ in range(self.draw.choices((0, 1, 2), (3, 5, 2))[0]):
            targets = self._targets()
            way: Raw = {"target": targets}
            if self.draw.random() < 0.9:
                few = self.draw.randint(1, 2)
                way["event"] = sorted(self.draw.sample(EVENTS, few))
            else:
                way["cond"] = f"In({self.draw.choice(self._plain())})"
            if way.get("event") and self.draw.random() < 0.25:
                way["cond"] = f"In({self.draw.choice(self._plain())})"
            inside = [t for t in self._plain() if source in self.above[t]]
            if source["kind"] == "compound" and inside and self.draw.random() < 0.3:
                way["target"], way["internal"] = [self.draw.choice(inside)], True
            ways.append(way)
        if ways:
            source["transitions"] = ways

    def _plain(self) -> list[str]:
        return [s["id"] for s in self.states[1:] if s["kind"] != "history"]

    def _targets(self) -> list[str]:
        """One state, or one in each region of a parallel state."""
        parallel = [s for s in self.states if s["kind"] == "parallel"]
        if parallel and self.draw.random() < 0.2:
            regions = [c for c in self.draw.choice(parallel)["children"] if c["kind"] != "history"]
            return [self.draw.choice(self._in(region)) for region in regions]
        return [self.draw.choice([s["id"] for s in self.states[1:]])]

    def _in(self, region: Raw) -> list[str]:
        return [s["id"] for s in self.states if s is region or region in self.above[s["id"]]]
