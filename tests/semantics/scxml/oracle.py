"""Oracle: the algorithm of the W3C's SCXML (2015, appendix D) over charts as plain JSON.

It knows nothing of the product, and is as near to the text of the standard as it can be.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

State = Mapping[str, Any]
Transition = tuple[str, Mapping[str, Any]]
MOST = 64


class EndlessMacrostep(Exception):
    """A macrostep does not end."""


class Oracle:
    """One chart; `active` are the ids of all active states."""

    def __init__(self, chart: State) -> None:
        """Enter the initial states."""
        self.states: dict[str, State] = {}
        self.parents: dict[str, str | None] = {}
        self.order: dict[str, int] = {}
        self.root: str = chart["id"]
        self._read(chart, None)
        self.active: set[str] = set()
        self.history: dict[str, list[str]] = {}
        self.steps = 0
        self._enter([(self.root, {"target": list(chart["initial"])})], at_root=True)
        self._run_to_completion()

    def send(self, event: str) -> None:
        """Take an external event."""
        self.steps = 0
        self._microstep(self._select_transitions(event))
        self._run_to_completion()

    @property
    def atomic(self) -> frozenset[str]:
        """The ids of the active atomic states."""
        return frozenset(s for s in self.active if self._is_atomic(s))

    def _read(self, state: State, parent: str | None) -> None:
        self.states[state["id"]] = state
        self.parents[state["id"]] = parent
        self.order[state["id"]] = len(self.order)
        for child in state.get("children", ()):
            self._read(child, state["id"])

    def _kind(self, state: str) -> str:
        kind: str = self.states[state]["kind"]
        return kind

    def _is_atomic(self, state: str) -> bool:
        return self._kind(state) in ("atomic", "final")

    def _children(self, state: str) -> list[str]:
        inner = self.states[state].get("children", ())
        return [child["id"] for child in inner if child["kind"] != "history"]

    def _ancestors(self, state: str, until: str | None = None) -> Iterator[str]:
        parent = self.parents[state]
        while parent is not None and parent != until:
            yield parent
            parent = self.parents[parent]

    def _inside(self, state: str, outer: str) -> bool:
        return outer in self._ancestors(state)

    def _run_to_completion(self) -> None:
        while chosen := self._select_transitions(None):
            self._microstep(chosen)

    def _select_transitions(self, event: str | None) -> list[Transition]:
        enabled: list[Transition] = []
        for leaf in sorted(self.atomic, key=self.order.__getitem__):
            for state in (leaf, *self._ancestors(leaf)):
                found = next(
                    (
                        w
                        for w in self.states[state].get("transitions", ())
                        if self._is_enabled(w, event)
                    ),
                    None,
                )
                if found is not None:
                    if not any(found is way for _, way in enabled):
                        enabled.append((state, found))
                    break
        return self._remove_conflicting(enabled)

    def _is_enabled(self, transition: Mapping[str, Any], event: str | None) -> bool:
        if event is None or not transition.get("event"):
            if event is not None or transition.get("event"):
                return False
        elif event not in transition["event"]:
            return False
        condition = transition.get("cond", "true")
        if condition.startswith("In("):
            return condition[3:-1] in self.active
        return True

    def _remove_conflicting(self, enabled: list[Transition]) -> list[Transition]:
        kept: list[Transition] = []
        for first in enabled:
            removed: list[Transition] = []
            preempted = False
            for second in kept:
                if self._exit_set(first) & self._exit_set(second):
                    if self._inside(first[0], second[0]):
                        removed.append(second)
                    else:
                        preempted = True
                        break
            if not preempted:
                kept = [way for way in kept if not any(way is r for r in removed)] + [first]
        return kept

    def _exit_set(self, transition: Transition) -> set[str]:
        if not transition[1].get("target"):
            return set()
        domain = self._domain(transition)
        return {state for state in self.active if domain and self._inside(state, domain)}

    def _domain(self, transition: Transition) -> str | None:
        source, way = transition
        targets = self._effective_targets(way.get("target", ()))
        if not targets:
            return None
        inside = all(self._inside(target, source) for target in targets)
        if way.get("internal") and self._kind(source) == "compound" and inside:
            return source
        for outer in self._ancestors(source):
            is_compound = self._kind(outer) == "compound"
            if is_compound and all(self._inside(target, outer) for target in targets):
                return outer
        return self.root

    def _effective_targets(self, targets: Iterable[str]) -> list[str]:
        found: list[str] = []
        for target in targets:
            if self._kind(target) == "history":
                known = self.history.get(target)
                found += (
                    known
                    if known is not None
                    else self._effective_targets(self._history_default(target))
                )
            else:
                found.append(target)
        return found

    def _history_default(self, history: str) -> list[str]:
        targets: list[str] = self.states[history]["transitions"][0]["target"]
        return targets

    def _microstep(self, chosen: list[Transition]) -> None:
        if not chosen:
            return
        self.steps += 1
        if self.steps > MOST:
            raise EndlessMacrostep
        self._exit(chosen)
        self._enter(chosen)

    def _exit(self, chosen: list[Transition]) -> None:
        leaving = set[str]().union(*(self._exit_set(way) for way in chosen))
        for state in leaving:
            for child in self.states[state].get("children", ()):
                if child["kind"] == "history":
                    deep = child["history"] == "deep"
                    self.history[child["id"]] = [
                        other
                        for other in self.active
                        if (deep and self._is_atomic(other) and self._inside(other, state))
                        or (not deep and self.parents[other] == state)
                    ]
        self.active -= leaving

    def _enter(self, chosen: list[Transition], at_root: bool = False) -> None:
        coming: set[str] = set()
        for transition in chosen:
            domain = self.root if at_root else self._domain(transition)
            for target in transition[1].get("target", ()):
                self._add_descendants(target, coming)
            for target in self._effective_targets(transition[1].get("target", ())):
                self._add_ancestors(target, domain, coming)
        self.active |= coming

    def _add_descendants(self, state: str, coming: set[str]) -> None:
        if self._kind(state) == "history":
            known = self.history.get(state)
            targets = known if known is not None else self._history_default(state)
            for target in targets:
                self._add_descendants(target, coming)
            for target in targets:
                self._add_ancestors(target, self.parents[state], coming)
            return
        coming.add(state)
        if self._kind(state) == "compound":
            initial = self.states[state]["initial"]
            for target in initial:
                self._add_descendants(target, coming)
            for target in initial:
                self._add_ancestors(target, state, coming)
        elif self._kind(state) == "parallel":
            self._add_regions(state, coming)

    def _add_ancestors(self, state: str, until: str | None, coming: set[str]) -> None:
        for outer in self._ancestors(state, until):
            coming.add(outer)
            if self._kind(outer) == "parallel":
                self._add_regions(outer, coming)

    def _add_regions(self, state: str, coming: set[str]) -> None:
        for region in self._children(state):
            if not any(s == region or self._inside(s, region) for s in coming):
                self._add_descendants(region, coming)
