"""Chart reader: nested modes as a tree, with the modes of each region and the superstates."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import cast

from language.ir.root_region import CHART
from language.model.automaton import Mode, Region
from language.model.statechart import (
    ROOT,
    Chart,
    ChartEvent,
    ChartNode,
    HistoryKind,
    NodeKind,
    TransitionOrder,
)
from language.readers.base_reader import TEXT_KEYS
from language.readers.chart_initial_reader import RawNode, resolve_initials
from language.readers.chart_transition_reader import resolve_transitions
from language.readers.mode_reader import (
    IMPLICIT_MODE,
    INNER_KEYS,
    REGION_KEYS,
    ModeReader,
    check_mode_numbers,
)
from language.readers.transition_reader import CHART_TRANSITION_KEYS, ModeContext
from language.text.diagnostic import Span
from language.text.document import Entry, MappingNode, SequenceNode, YamlNode

CHART_KEYS = ("events", "order", "micro_steps")
"""Keys at the root that make an automaton a chart."""
MAX_MICRO_STEPS = 255
"""Largest bound of micro-steps in a tick."""
NO_PARENT = -1
"""The index of the parent of the root."""


def is_chart(root: MappingNode) -> bool:
    """Tell whether the tree of an automaton uses a key that only charts have.

    Such keys are CHART_KEYS (`events`, `order`, `micro_steps`) at the root, `regions` in a region
    of the root, INNER_KEYS in a mode or template, and CHART_TRANSITION_KEYS or a list of targets in
    `to` in a transition. Regions at the root alone make no chart. Nothing is reported.
    """
    if any(key in root.entries for key in CHART_KEYS):
        return True
    owners = [root]
    for entry in _child_mappings(root.get("regions")):
        owners.append(entry)
        if "regions" in entry.entries:
            return True
    return any(_uses_chart_keys(mode) for owner in owners for mode in _mode_mappings(owner))


def _mode_mappings(owner: MappingNode) -> Iterator[MappingNode]:
    """Yield the mappings of the modes and templates directly below a mapping."""
    yield from _child_mappings(owner.get("modes"))
    yield from _child_mappings(owner.get("templates"))


def _uses_chart_keys(mode: MappingNode) -> bool:
    """Tell whether a mode or one of its transitions uses a key of charts or a list of targets."""
    transitions = _child_mappings(mode.get("transitions"))
    return any(key in mode.entries for key in INNER_KEYS) or any(
        any(key in transition.entries for key in CHART_TRANSITION_KEYS)
        or isinstance(transition.get("to"), SequenceNode)
        for transition in transitions
    )


def _child_mappings(node: YamlNode | None) -> Iterator[MappingNode]:
    """Yield the values of a mapping that are mappings; nothing for another node."""
    for entry in node if isinstance(node, MappingNode) else ():
        if isinstance(entry.node, MappingNode):
            yield entry.node


@dataclass(frozen=True)
class ModeStructure:
    """The regions of an automaton, `chart` first, and in a chart the superstates and the tree."""

    regions: tuple[Region, ...]
    superstates: tuple[Mode, ...] = ()
    statechart: Chart | None = None


class ChartReader:
    """Reads the tree of nested modes of an automaton; a `ModeReader` reads each mode."""

    def __init__(self, mode_reader: ModeReader) -> None:
        """Read with the root and the problems of `mode_reader`."""
        self.mode_reader = mode_reader
        self.problems = mode_reader.problems
        self.root = mode_reader.root
        self.raw_nodes: list[RawNode] = []
        self.has_errors = False

    def read(self, span: Span) -> ModeStructure:
        """Return the regions (`chart` first), superstates and tree of a chart; call it only once.

        `span` is the place of the automaton. The modes at the root form the region `chart`; if
        there are only regions, it gets the single mode `always`. Superstates are returned without
        dynamics (equations, flow, update, observer, run, invariants).

        Raises SpecError without any mode, for a region of the root without modes, and for a problem
        of `initial`. All other problems are only reported.
        """
        signals = self._read_events()
        self._read_tree(span)
        chart = self._build_chart(signals)
        regions = tuple(self._build_region(chart, node) for node in chart.regions)
        return ModeStructure(regions, self._collect_superstates(), chart)

    def _read_tree(self, span: Span) -> None:
        """Read all nodes in preorder into `raw_nodes`, then resolve `initial`. Raises SpecError.

        The modes at the root become the region `chart`. If there are only regions, `chart` gets one
        mode that is always active.
        """
        self.raw_nodes.append(
            RawNode("", "", "parallel", NO_PARENT, "", False, span, MappingNode({}, span))
        )
        entries = self.mode_reader.root_region_entries()
        own = {k: e for k, e in self.root.entries.items() if k in ("modes", "initial")}
        if entries and "modes" not in own:
            always = MappingNode(
                {IMPLICIT_MODE: Entry(IMPLICIT_MODE, span, MappingNode({}, span))}, span
            )
            own["modes"] = Entry("modes", span, always)
        if "modes" in own and all(entry.key != CHART for entry in entries):
            table = self.mode_reader.read_mapping(MappingNode(own, span), "regions", REGION_KEYS)
            self._read_node(Entry(CHART, span, table), table, ROOT, CHART, CHART, True, "", None)
        entries.sort(key=lambda entry: entry.key != CHART)
        for entry in entries:
            self._read_region(entry, ROOT, "")
        self.raw_nodes[ROOT].last = len(self.raw_nodes) - 1
        if len(self.raw_nodes) == 1:
            self.problems.error("missing", span, "a chart has at least one mode in `modes`")
            self.problems.raise_if_errors()
        known = len(self.problems.reported)
        resolve_initials(self.raw_nodes, self.mode_reader)
        if len(self.problems.reported) > known or self.has_errors:
            self.problems.raise_if_errors()

    def _build_chart(self, events: Mapping[str, ChartEvent]) -> Chart:
        """Return the chart with its transitions resolved."""
        nodes = tuple(self._build_node(index) for index in range(len(self.raw_nodes)))
        bare = Chart(nodes, events, "outer_first", 1, {})
        modes = {n: raw.mode for n, raw in enumerate(self.raw_nodes) if raw.mode is not None}
        return dataclasses.replace(
            bare,
            transitions=resolve_transitions(bare, modes, self.problems),
            order=cast(TransitionOrder, self._read_order()),
            micro_steps=self._read_micro_steps(events, modes.values()),
        )

    def _collect_superstates(self) -> tuple[Mode, ...]:
        """Return the superstates without the dynamics that their inner modes inherited.

        They keep transitions, entry and exit actions.
        """
        return tuple(
            dataclasses.replace(
                raw.mode, equations={}, flow={}, update={}, observer=None, run=None, invariants={}
            )
            for raw in self.raw_nodes
            if raw.mode is not None and raw.number is None
        )

    def _read_region(self, entry: Entry, parent: int, prefix: str) -> None:
        """Read a region of the root or of the node `parent` with all nodes inside."""
        is_root = parent == ROOT
        path = f"{prefix}{entry.key}"
        key = f"regions.{entry.key}" if is_root else ""
        if not is_root:
            outer = self.raw_nodes[parent]
            base = outer.mode.key if outer.mode else ""
            key = f"{base}.regions.{entry.key}"
        what = REGION_KEYS if is_root else None
        table = self.mode_reader.read_mapping(entry.node, key or "regions", what)
        self._read_node(entry, table, parent, path, path, True, key, None)

    def _read_node(
        self,
        entry: Entry,
        table: MappingNode,
        parent: int,
        path: str,
        region: str,
        is_region: bool,
        key: str,
        parent_mode: Mode | None,
    ) -> None:
        """Append a node to `raw_nodes`, then its descendants; read its mode.

        A region of the root has no mode of its own, and a history is no mode. `parent_mode` is the
        superstate whose dynamics the mode inherits; a region does not pass on its own.
        """
        index = len(self.raw_nodes)
        table = self.mode_reader.apply_template(table)
        kind = self._node_kind(entry, table)
        if kind == "history":
            is_region, region = False, self.raw_nodes[parent].region
        raw = RawNode(entry.key, path, kind, parent, region, is_region, entry.span, table)
        self.raw_nodes.append(raw)
        self.raw_nodes[parent].children.append(index)
        is_root = is_region and parent == ROOT
        if kind == "history":
            self._check_history(entry, table)
        elif not is_root:
            raw.mode = self._read_mode(entry, raw, key, parent_mode)
        elif kind != "compound":
            self.problems.error("missing", entry.span, "a region has at least one mode in `modes`")
            self.has_errors = True
        self._read_children(raw, index, key, path, raw.mode if not is_region else None)
        raw.last = len(self.raw_nodes) - 1
        if kind in ("atomic", "parallel") and raw.mode:
            raw.number = raw.mode.number

    def _check_history(self, entry: Entry, table: MappingNode) -> None:
        """Report the keys of a history other than `history` and `initial`."""
        for key, own in table.entries.items():
            if key not in ("history", "initial", *TEXT_KEYS):
                label = f"`{entry.key}` is a history: it has no `{key}`"
                hint = "it only determines what is entered in the mode around it"
                self.problems.error("form", own.span, label, hint)

    def _read_children(
        self, raw: RawNode, index: int, key: str, path: str, parent_mode: Mode | None
    ) -> None:
        """Read the regions of a parallel node, or the modes of a compound node."""
        prefix = "" if path == CHART else f"{path}."
        if raw.kind == "parallel":
            for entry in self.mode_reader.named_entries(raw.table.get("regions"), f"{key}.regions"):
                self._read_region(entry, index, prefix)
        elif raw.kind == "compound":
            base = f"{key}." if key else ""
            for entry in self.mode_reader.named_entries(raw.table.get("modes"), f"{base}modes"):
                inner = f"{base}modes.{entry.key}"
                table = self.mode_reader.read_mapping(entry.node, inner)
                inner_path = f"{prefix}{entry.key}"
                self._read_node(
                    entry, table, index, inner_path, raw.region, False, inner, parent_mode
                )

    def _node_kind(self, entry: Entry, table: MappingNode) -> NodeKind:
        """Return the kind of a node; a node with both `modes` and `regions` is reported."""
        if "history" in table.entries:
            return "history"
        if "modes" in table.entries and "regions" in table.entries:
            label = f"`{entry.key}` has both `modes` and `regions`"
            hint = "put the modes into one more region"
            self.problems.error("form", table.entries["regions"].span, label, hint)
        if "modes" in table.entries:
            return "compound"
        return "parallel" if "regions" in table.entries else "atomic"

    def _read_mode(self, entry: Entry, raw: RawNode, key: str, parent_mode: Mode | None) -> Mode:
        """Return the mode of a node, which inherits the dynamics of superstates of its region.

        Its name is the path inside its region. A number of a superstate and a priority of a mode
        that is no region are reported.
        """
        name = raw.path.removeprefix(f"{raw.region}.") if raw.region != CHART else raw.path
        if raw.is_region:
            name = raw.name
        if raw.kind == "compound" and "number" in raw.table.entries:
            span = raw.table.entries["number"].span
            self.problems.error("form", span, "a superstate has no number: its innermost modes do")
        if "priority" in raw.table.entries and not raw.is_region:
            span = raw.table.entries["priority"].span
            self.problems.error("form", span, "a mode has no priority: regions inside a mode do")
        position = sum(1 for r in self.raw_nodes if r.region == raw.region and r.number is not None)
        site = ModeContext(key, raw.region, position, parent_mode, raw.kind != "atomic")
        return self.mode_reader.read_mode(Entry(name, entry.span, raw.table), site)

    def _build_node(self, index: int) -> ChartNode:
        """Return the immutable node of the raw node at an index."""
        raw = self.raw_nodes[index]
        table = raw.table
        final = self.mode_reader.read_choice(
            table.get("final"), "final", ("true", "false"), "false"
        )
        if final == "true" and raw.kind != "atomic":
            label = "a final mode has no modes inside"
            self.problems.error("form", table.entries["final"].span, label)
        history_kinds = ("shallow", "deep")
        return ChartNode(
            index=index,
            last_descendant=raw.last,
            name=raw.name,
            path=raw.path,
            kind=raw.kind,
            parent=raw.parent,
            children=tuple(raw.children),
            region=raw.region,
            is_region=raw.is_region,
            mode_key=raw.mode.key if raw.mode else "",
            number=raw.number,
            initial=raw.initial,
            history=cast(
                HistoryKind,
                self.mode_reader.read_choice(table.get("history"), "history", history_kinds, ""),
            ),
            is_final=final == "true",
            priority=self.mode_reader.read_integer(table.get("priority"), "priority", 0, 0, 1000),
        )

    def _read_events(self) -> dict[str, ChartEvent]:
        """Return the declared events by name, numbered from 1."""
        events: dict[str, ChartEvent] = {}
        for entry in self.mode_reader.named_entries(self.root.get("events"), "events"):
            table = self.mode_reader.read_mapping(entry.node, f"events.{entry.key}", ("from",))
            origin = self.mode_reader.read_choice(table.get("from"), "from", ("input",), "")
            number = len(events) + 1
            events[entry.key] = ChartEvent(entry.key, number, origin == "input", entry.span)
        return events

    def _read_order(self) -> str:
        """Return `order`, by default `outer_first`."""
        allowed = ("outer_first", "inner_first")
        return self.mode_reader.read_choice(self.root.get("order"), "order", allowed, "outer_first")

    def _read_micro_steps(self, events: Mapping[str, ChartEvent], modes: Iterable[Mode]) -> int:
        """Return the bound of micro-steps in a tick (rule 7).

        The default is 1. If a tick may have several events, because events are raised or several
        are inputs, it is the number of innermost modes, from 2 to 255. A bound of 1 is reported if
        a transition raises an event.
        """
        raised = any(transition.raises for mode in modes for transition in mode.transitions)
        several = raised or sum(signal.is_input for signal in events.values()) > 1
        count = max(2, sum(raw.number is not None for raw in self.raw_nodes))
        node = self.root.get("micro_steps")
        bound = self.mode_reader.read_integer(
            node, "micro_steps", min(count, MAX_MICRO_STEPS) if several else 1, 1, MAX_MICRO_STEPS
        )
        if node is not None and raised and bound < 2:
            label = "an event that is raised is taken in the next micro-step: one is too few"
            self.problems.error("form", node.span, label)
        return bound

    def _build_region(self, chart: Chart, node: ChartNode) -> Region:
        """Return the region of a node with its innermost modes and its initial mode.

        A region inside a mode gets a number for inactivity: below all mode numbers, and at most -1.
        """
        modes = {}
        for leaf in chart.leaves(node.region):
            mode = self.raw_nodes[leaf.index].mode
            assert mode is not None
            modes[mode.name] = mode
        check_mode_numbers(modes.values(), self.problems)
        active = chart.entry_set(node, ())
        initial = next(n for n in active if n.region == node.region and n.number is not None)
        start = self.raw_nodes[initial.index].mode
        assert start is not None
        inactive = (
            None if node.parent == ROOT else min(-1, *(mode.number - 1 for mode in modes.values()))
        )
        return Region(node.region, modes, start.name, self.raw_nodes[node.index].span, inactive)
