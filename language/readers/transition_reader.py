"""Transition reader: the transitions of a mode with guards, waits, resets and events."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal, cast

from language.expressions.migration_hints import event_guard_hint, key_alias_hint
from language.expressions.name_rules import check_name
from language.expressions.syntax_tree import BoolLiteral
from language.model.automaton import Mode, Rewind, Transition
from language.model.declaration import Formula
from language.model.statechart import HistoryKind
from language.readers.base_reader import Reader
from language.text.diagnostic import Problems, suggest_name
from language.text.document import Entry, MappingNode, ScalarNode, SequenceNode, YamlNode


@dataclass(frozen=True)
class ModeContext:
    """The position of a mode in the automaton.

    `key` is its key path and `position` the number of modes before it in its region. `parent` is
    the superstate around it, or None. `has_inner_modes` tells that the mode has modes inside.
    """

    key: str
    region: str
    position: int
    parent: Mode | None = None
    has_inner_modes: bool = False


TRANSITION_KEYS = ("to", "when", "wait", "priority", "reset", "memory", "rewind")

CHART_TRANSITION_KEYS = ("event", "raise", "history", "internal")

MemoryOption = Literal["reset", "continue"]


class TransitionReader(Reader):
    """Reads transitions; `events` are the names of the declared events."""

    def __init__(self, problems: Problems, events: tuple[str, ...]) -> None:
        """Report into `problems`."""
        super().__init__(problems)
        self.events = events

    def read_transitions(
        self, node: YamlNode | None, source: str, context: ModeContext
    ) -> Iterator[Transition]:
        """Yield the transitions of the mode `source` in the order of the file.

        One without a guard is reported and left out; with an event, or if the mode has inner modes,
        a missing `when` means `true`. Without `to` the target is the name of the transition; `to:
        []` gives no targets, and `target` is then the source. Undeclared events and wrong names are
        reported and kept. Whether targets exist is not checked.
        """
        for entry in self.read_mapping(node, "transitions"):
            self._check_name(entry)
            transition = self._read_transition(entry, source, context)
            if transition:
                yield transition

    def _check_name(self, entry: Entry) -> None:
        """Report a transition whose key is no name; for a dotted path the hint proposes `to`."""
        if re.fullmatch(r"\w+(\.\w+)+", entry.key):
            name = entry.key.rpartition(".")[2]
            label = f"`{entry.key}` is not a name"
            self.problems.error(
                "name", entry.span, label, f"a name of its own: `{name}: {{to: {entry.key}}}`"
            )
        else:
            check_name(entry.key, entry.span, self.problems)

    def _read_transition(
        self, entry: Entry, source: str, context: ModeContext
    ) -> Transition | None:
        """Return one transition, or None if its guard is missing.

        A transition without `when` and events is a completion transition of a mode with modes
        inside.
        """
        key = f"{context.key}.transitions.{entry.key}"
        table = self.read_mapping(entry.node, key, (*TRANSITION_KEYS, *CHART_TRANSITION_KEYS))
        to, wait, priority = (table.get(part) for part in ("to", "wait", "priority"))
        targets = self._read_targets(to, entry)
        events = self._read_events(table, "event")
        when = self._read_guard(table, key, entry, bool(events) or context.has_inner_modes)
        waited = self.read_expression(wait, f"{key}.wait", entry.span) if wait else None
        rank = self.read_integer(priority, "priority", 0, 0, 1000) if priority else None
        memory = self.read_choice(table.get("memory"), "memory", ("reset", "continue"), "reset")
        history = self.read_choice(table.get("history"), "history", ("shallow", "deep"), "")
        internal = self.read_choice(table.get("internal"), "internal", ("true", "false"), "false")
        if when is None:
            return None
        return Transition(
            name=entry.key,
            source=source,
            target=targets[0] if targets else source,
            when=when,
            wait=waited,
            priority=rank,
            reset=self.read_formulas(table.get("reset"), f"{key}.reset"),
            key=key,
            span=to.span if to else entry.span,
            region=context.region,
            memory=cast(MemoryOption, memory),
            rewind=self._read_rewind(table.get("rewind"), f"{key}.rewind"),
            targets=targets,
            events=events,
            raises=self._read_events(table, "raise"),
            history=cast(HistoryKind, history),
            internal=internal == "true",
            is_completion="when" not in table.entries and not events,
            is_table_cell=to is not None and to.span == entry.span,
        )

    def _read_targets(self, node: YamlNode | None, entry: Entry) -> tuple[str, ...]:
        """Return the names in `to`; without the key, the name of the transition."""
        if node is None:
            return (entry.key,)
        if isinstance(node, ScalarNode) and not node.text:
            label = "`to` has no target"
            hint = f"`to: []` for none, or leave it out to go to `{entry.key}`"
            self.problems.error("missing", node.span, label, hint)
        return self._read_names(node, "to")

    def _read_names(self, node: YamlNode | None, what: str) -> tuple[str, ...]:
        """Return the names of a list, or of a single scalar; empty for an absent node."""
        if isinstance(node, SequenceNode):
            return tuple(item.text for item in self.read_list(node, what))
        word = self.read_string(node, what, node.span) if node else ""
        return (word,) if word else ()

    def _read_events(self, table: MappingNode, what: str) -> tuple[str, ...]:
        """Return the names of events under the key `what`; undeclared events are reported."""
        node = table.get(what)
        names = self._read_names(node, what)
        for item in node.nodes if isinstance(node, SequenceNode) else (node,):
            if isinstance(item, ScalarNode) and item.text not in self.events:
                label = f"there is no event `{item.text}`"
                hint = event_guard_hint(item.text, self.events)
                hint = hint or suggest_name(item.text, self.events)
                hint = hint or "events are declared under `events`"
                words = [word for word in re.findall(r"\w+", item.text) if word in self.events]
                if len(words) > 1:
                    hint = f"several are a list: `{what}: [{', '.join(words)}]`"
                self.problems.error("name", item.span, label, hint)
        return names

    def _read_guard(
        self, table: MappingNode, key: str, entry: Entry, is_optional: bool
    ) -> Formula | None:
        """Return the guard, or None with a problem reported.

        If the guard is optional, because the transition has an event or its source has modes
        inside, a missing `when` means `true`.
        """
        node = table.get("when")
        if node is None and is_optional:
            return Formula(BoolLiteral(True, entry.span), f"{key}.when")
        keys = entry.node.entries if isinstance(entry.node, MappingNode) else ()
        if node is None and any(key_alias_hint(key, ("when", "event")) for key in keys):
            return None  # reported as an unknown key
        if isinstance(entry.node, SequenceNode) or (
            isinstance(entry.node, ScalarNode) and entry.node.text
        ):
            return None  # reported because it is no mapping
        if node is None:
            hint = "`when: true` with the largest `priority` for all other cases"
            self.problems.error("missing", entry.span, "`when` is missing", hint)
            return None
        if isinstance(node, ScalarNode) and node.text in ("else", "otherwise"):
            label = f"`{node.text}` is no condition"
            hint = "`when: true` with the largest `priority` for all other cases"
            self.problems.error("expression", node.span, label, hint)
            return None
        return self.read_expression(node, f"{key}.when", entry.span)

    def _read_rewind(self, node: YamlNode | None, key: str) -> Rewind | None:
        """Return the rewind of a transition, or None without the key.

        An incomplete rewind is reported and gives None.
        """
        if node is None:
            return None
        table = self.read_mapping(node, key, ("until", "within", "beyond"))
        parts = [
            self.read_expression(table.get(part), f"{key}.{part}", node.span)
            for part in ("until", "within")
        ]
        beyond = self.read_choice(table.get("beyond"), "beyond", ("fault", "fire"), "fault")
        if not (parts[0] and parts[1]):
            return None
        return Rewind(parts[0], parts[1], node.span, is_fault=beyond == "fault")
