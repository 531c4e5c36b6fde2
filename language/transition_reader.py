"""Transition reader: the transitions of a mode, each with its guard."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Literal, cast

from language.aliases import heard_with_guard, known_as
from language.chart import Keeping
from language.declaration import Formula
from language.document import Entry, Items, Node, Scalar, Table
from language.model import Rewind, Transition
from language.names import check_name
from language.problem import Problems, nearest
from language.reader import Reader
from language.site import Site
from language.syntax import Truth

TRANSITION_KEYS = ("to", "when", "wait", "priority", "reset", "memory", "rewind")
CHART_WAY_KEYS = ("event", "raise", "history", "internal")
Remembering = Literal["reset", "continue"]


class TransitionReader(Reader):
    """Reads transitions; `events` are those that the automaton declares."""

    def __init__(self, problems: Problems, events: tuple[str, ...]) -> None:
        """Report into `problems`."""
        super().__init__(problems)
        self.events = events

    def transitions(self, node: Node | None, source: str, site: Site) -> Iterator[Transition]:
        """Iterate over the transitions of the mode `source`; one without a guard is reported."""
        for entry in self.table(node, "transitions"):
            self._check_name(entry)
            transition = self._transition(entry, source, site)
            if transition:
                yield transition

    def _check_name(self, entry: Entry) -> None:
        """A transition is named like anything; one named like a path to its target has `to`."""
        if re.fullmatch(r"\w+(\.\w+)+", entry.key):
            name = entry.key.rpartition(".")[2]
            label = f"`{entry.key}` is not a name"
            self.problems.error(
                "name", entry.span, label, f"a name of its own: `{name}: {{to: {entry.key}}}`"
            )
        else:
            check_name(entry.key, entry.span, self.problems)

    def _transition(self, entry: Entry, source: str, site: Site) -> Transition | None:
        key = f"{site.key}.transitions.{entry.key}"
        table = self.table(entry.node, key, (*TRANSITION_KEYS, *CHART_WAY_KEYS))
        to, wait, priority = (table.get(part) for part in ("to", "wait", "priority"))
        targets = self._targets(to, entry)
        events = self._events(table, "event")
        when = self._guard(table, key, entry, bool(events) or site.holds_modes)
        waited = self.expression(wait, f"{key}.wait", entry.span) if wait else None
        rank = self.whole(priority, "priority", 0, 0, 1000) if priority else None
        memory = self.choice(table.get("memory"), "memory", ("reset", "continue"), "reset")
        history = self.choice(table.get("history"), "history", ("shallow", "deep"), "")
        internal = self.choice(table.get("internal"), "internal", ("true", "false"), "false")
        if when is None:
            return None
        return Transition(
            name=entry.key,
            source=source,
            target=targets[0] if targets else source,
            when=when,
            wait=waited,
            priority=rank,
            reset=self.formulas(table.get("reset"), f"{key}.reset"),
            key=key,
            span=to.span if to else entry.span,
            region=site.region,
            memory=cast(Remembering, memory),
            rewind=self._rewind(table.get("rewind"), f"{key}.rewind"),
            targets=targets,
            events=events,
            raises=self._events(table, "raise"),
            history=cast(Keeping, history),
            internal=internal == "true",
            completes="when" not in table.entries and not events,
            in_cell=to is not None and to.span == entry.span,
        )

    def _targets(self, node: Node | None, entry: Entry) -> tuple[str, ...]:
        """Return the names of the modes that a transition leads to: by default its own name."""
        if node is None:
            return (entry.key,)
        if isinstance(node, Scalar) and not node.text:
            label = "`to` has no target"
            hint = f"`to: []` for none, or leave it out to go to `{entry.key}`"
            self.problems.error("missing", node.span, label, hint)
        return self._words(node, "to")

    def _words(self, node: Node | None, what: str) -> tuple[str, ...]:
        """Return the names of a list, or the only one."""
        if isinstance(node, Items):
            return tuple(item.text for item in self.items(node, what))
        word = self.text(node, what, node.span) if node else ""
        return (word,) if word else ()

    def _events(self, table: Table, what: str) -> tuple[str, ...]:
        """Return the names of events, which are declared."""
        node = table.get(what)
        found = self._words(node, what)
        for item in node.nodes if isinstance(node, Items) else (node,):
            if isinstance(item, Scalar) and item.text not in self.events:
                label = f"there is no event `{item.text}`"
                hint = heard_with_guard(item.text, self.events)
                hint = hint or nearest(item.text, self.events)
                hint = hint or "events are declared under `events`"
                words = [word for word in re.findall(r"\w+", item.text) if word in self.events]
                if len(words) > 1:
                    hint = f"several are a list: `{what}: [{', '.join(words)}]`"
                self.problems.error("name", item.span, label, hint)
        return found

    def _guard(self, table: Table, key: str, entry: Entry, optional: bool) -> Formula | None:
        """Return the guard; an event needs none, nor does the end of a mode with modes inside."""
        node = table.get("when")
        if node is None and optional:
            return Formula(Truth(True, entry.span), f"{key}.when")
        keys = entry.node.entries if isinstance(entry.node, Table) else ()
        if node is None and any(known_as(key, ("when", "event")) for key in keys):
            return None  # told as an unknown key
        if isinstance(entry.node, Items) or (isinstance(entry.node, Scalar) and entry.node.text):
            return None  # told as no mapping
        if node is None:
            hint = "`when: true` with the largest `priority` for what the others leave"
            self.problems.error("missing", entry.span, "`when` is missing", hint)
            return None
        if isinstance(node, Scalar) and node.text in ("else", "otherwise"):
            label = f"`{node.text}` is no condition"
            hint = "`when: true` with the largest `priority` for what the others leave"
            self.problems.error("expression", node.span, label, hint)
            return None
        return self.expression(node, f"{key}.when", entry.span)

    def _rewind(self, node: Node | None, key: str) -> Rewind | None:
        """Read how far back a transition reaches, and to what."""
        if node is None:
            return None
        table = self.table(node, key, ("until", "within", "beyond"))
        parts = [
            self.expression(table.get(part), f"{key}.{part}", node.span)
            for part in ("until", "within")
        ]
        beyond = self.choice(table.get("beyond"), "beyond", ("fault", "fire"), "fault")
        if not (parts[0] and parts[1]):
            return None
        return Rewind(parts[0], parts[1], node.span, is_fault=beyond == "fault")
