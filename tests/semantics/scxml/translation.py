"""Translation: a statechart of the W3C's SCXML, as plain JSON, to a spec of ours.

Document order becomes `priority`, `order: inner_first`, `micro_steps: 64`. A child of a parallel
state is a region, whatever it is itself; a history state is a mode with `history`.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

State = Mapping[str, Any]
Yaml = dict[str, Any]


@dataclass(frozen=True)
class Case:
    """A spec, its events by the name of the original, and the original id of each path."""

    name: str
    text: str
    events: Mapping[str, str]
    ids: Mapping[str, str]


def translate_case(case: Mapping[str, Any], name: str) -> Case:
    """Return a case as an automaton of a name."""
    return _Translation(case, name).result()


class _Translation:
    """One chart; `paths` are those of our modes by the id of the state."""

    def __init__(self, case: Mapping[str, Any], name: str) -> None:
        self.case = case
        self.name = name
        self.root: State = case["chart"]
        self.paths: dict[str, tuple[str, ...]] = {}
        self.parents: dict[str, State] = {}
        self.states: dict[str, State] = {}
        self._place(self.root, ())
        sent = [step["event"] for step in case["steps"]]
        named = [event for state in self.states.values() for event in _events(state)]
        names = dict.fromkeys(e for e in [*sent, *named] if "*" not in e)
        self.events = {event: f"event_{k}_{_clean(event)}"[:31] for k, event in enumerate(names)}
        self.priority = 0

    def result(self) -> Case:
        spec: Yaml = {
            "language": 1,
            "automaton": self.name,
            "period": "1 ms",
            "numbers": "float64",
            "order": "inner_first",
            "micro_steps": 64,
            "events": {ours: {"from": "input"} for ours in self.events.values()},
            "initial": [self._below((), target) for target in self.root["initial"]],
            "modes": {self.paths[c["id"]][-1]: self._body(c) for c in self.root["children"]},
            "outputs": ["mode"],
        }
        if not spec["events"]:
            del spec["events"]
        ids = {".".join(path): key for key, path in self.paths.items()}
        lines = [f"{key}: {_yaml(value)}" for key, value in spec.items()]
        return Case(self.name, "\n".join([*lines, ""]), self.events, ids)

    def _place(self, state: State, path: tuple[str, ...]) -> None:
        for child in state.get("children", ()):
            own = (*path, f"s{len(self.paths)}_{_clean(child['id'])}"[:31])
            self.paths[child["id"]] = own
            self.parents[child["id"]] = state
            self.states[child["id"]] = child
            self._place(child, own)

    def _body(self, state: State) -> Yaml:
        body: Yaml = {}
        if state["kind"] == "history":
            body["history"] = state["history"]
            above = self._path(self.parents[state["id"]])
            targets = [target for way in state["transitions"] for target in way["target"]]
            body["initial"] = [self._below(above, target) for target in targets]
            return body
        if state["kind"] == "final":
            return {"final": True}
        inner = {self.paths[c["id"]][-1]: self._body(c) for c in state.get("children", ())}
        if state["kind"] == "compound":
            own = self._path(state)
            body["initial"] = [self._below(own, target) for target in state["initial"]]
            body["modes"] = inner
        if state["kind"] == "parallel":
            body["regions"] = inner
            for place, region in enumerate(inner.values()):
                if "history" not in region:
                    region["priority"] = place
        ways = state.get("transitions", ())
        if ways:
            body["transitions"] = {f"t{k}": self._way(state, way) for k, way in enumerate(ways)}
        return body

    def _way(self, source: State, way: Mapping[str, Any]) -> Yaml:
        self.priority += 1
        targets = way.get("target", [])
        found: Yaml = {"to": [".".join(self.paths[target]) for target in targets]}
        found["priority"] = self.priority
        if way.get("event"):
            found["event"] = [self.events[event] for event in self._meant(way["event"])]
        found["when"] = self._condition(way.get("cond", "true"))
        own = self._path(source)
        inside = all(self.paths[t][: len(own)] == own and t != source["id"] for t in targets)
        if way.get("internal") and inside and targets:
            found["internal"] = True
        return found

    def _meant(self, descriptors: list[str]) -> Iterator[str]:
        """An event descriptor means all events that begin with its words."""
        for event in self.events:
            for descriptor in descriptors:
                wanted = descriptor.removesuffix(".*").removesuffix("*").rstrip(".")
                if not wanted or event == wanted or event.startswith(f"{wanted}."):
                    yield event
                    break

    def _condition(self, text: str) -> str:
        """`In(state)` asks for a mode; JavaScript's operators are words here."""

        def asked(match: re.Match[str]) -> str:
            return f"in({'.'.join(self.paths[match.group(1)])})"

        found = re.sub(r"In\(\s*['\"]?([^'\")]+?)['\"]?\s*\)", asked, text)
        for sign, word in (("&&", " and "), ("||", " or "), ("!", " not ")):
            found = found.replace(sign, word)
        return re.sub(r"\s+", " ", found).strip()

    def _path(self, state: State) -> tuple[str, ...]:
        return self.paths.get(state["id"], ())

    def _below(self, above: tuple[str, ...], target: str) -> str:
        path = self.paths[target]
        assert path[: len(above)] == above, f"{target} is not inside {above}"
        return ".".join(path[len(above) :])


def _events(state: State) -> Iterator[str]:
    for way in state.get("transitions", ()):
        yield from way.get("event") or ()


def _yaml(value: object) -> str:
    """JSON is YAML, too."""
    return value if isinstance(value, str) else json.dumps(value)


def _clean(text: str) -> str:
    return re.sub(r"\W+", "_", text).strip("_")
