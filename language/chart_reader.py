"""Chart reader: modes inside modes to a tree, innermost modes by region, and superstates."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import cast

from language.chart import ROOT, Chart, Keeping, Kind, Node, Order, Signal
from language.chart_initial import RawNode, set_initials
from language.chart_way import ways_of
from language.document import Entry, Items, Node as YamlNode, Table
from language.mode import ALWAYS, INNER_KEYS, REGION_KEYS, ModeReader, check_numbers
from language.model import CHART, Mode, Region
from language.problem import Span
from language.reader import TEXT_KEYS
from language.site import Site
from language.transition_reader import CHART_WAY_KEYS

CHART_KEYS = ("events", "order", "micro_steps")
"""Keys at the root that make the modes a chart."""
MOST_MICRO_STEPS = 255
NOWHERE = -1


def is_chart(root: Table) -> bool:
    """Tell whether an automaton has modes inside modes, events, or several micro-steps."""
    if any(key in root.entries for key in CHART_KEYS):
        return True
    owners = [root]
    for entry in _tables(root.get("regions")):
        owners.append(entry)
        if "regions" in entry.entries:
            return True
    return any(_is_nested(mode) for owner in owners for mode in _modes(owner))


def _modes(owner: Table) -> Iterator[Table]:
    yield from _tables(owner.get("modes"))
    yield from _tables(owner.get("templates"))


def _is_nested(mode: Table) -> bool:
    ways = _tables(mode.get("transitions"))
    return any(key in mode.entries for key in INNER_KEYS) or any(
        any(key in way.entries for key in CHART_WAY_KEYS) or isinstance(way.get("to"), Items)
        for way in ways
    )


def _tables(node: YamlNode | None) -> Iterator[Table]:
    for entry in node if isinstance(node, Table) else ():
        if isinstance(entry.node, Table):
            yield entry.node


@dataclass(frozen=True)
class ReadModes:
    """What was read: the chart and the regions beside it; superstates and tree of a chart."""

    regions: tuple[Region, ...]
    superstates: tuple[Mode, ...] = ()
    tree: Chart | None = None


class ChartReader:
    """Reads the tree of an automaton with the help of the reader of modes."""

    def __init__(self, modes: ModeReader) -> None:
        self.modes = modes
        self.problems = modes.problems
        self.root = modes.root
        self.raw: list[RawNode] = []
        self.broken = False

    def read(self, at: Span) -> ReadModes:
        """Return the chart of an automaton. Raises SpecError where there is no tree."""
        signals = self._signals()
        self._read_tree(at)
        chart = self._chart(signals)
        regions = tuple(self._as_region(chart, node) for node in chart.regions)
        return ReadModes(regions, self._superstates(), chart)

    def _read_tree(self, at: Span) -> None:
        """Read all nodes below a root, in the order of their numbers, and what is initial."""
        self.raw.append(RawNode("", "", "parallel", NOWHERE, "", False, at, Table({}, at)))
        entries = self.modes.root_regions()
        own = {k: e for k, e in self.root.entries.items() if k in ("modes", "initial")}
        if entries and "modes" not in own:
            always = Table({ALWAYS: Entry(ALWAYS, at, Table({}, at))}, at)
            own["modes"] = Entry("modes", at, always)
        if "modes" in own and all(entry.key != CHART for entry in entries):
            table = self.modes.table(Table(own, at), "regions", REGION_KEYS)
            self._enter(Entry(CHART, at, table), table, ROOT, CHART, CHART, True, "", None)
        entries.sort(key=lambda entry: entry.key != CHART)
        for entry in entries:
            self._region(entry, ROOT, "")
        self.raw[ROOT].last = len(self.raw) - 1
        if len(self.raw) == 1:
            self.problems.error("missing", at, "a chart has at least one mode in `modes`")
            self.problems.stop_if_any()
        known = len(self.problems.found)
        set_initials(self.raw, self.modes)
        if len(self.problems.found) > known or self.broken:
            self.problems.stop_if_any()

    def _chart(self, signals: Mapping[str, Signal]) -> Chart:
        nodes = tuple(self._node(index) for index in range(len(self.raw)))
        bare = Chart(nodes, signals, "outer_first", 1, {})
        modes = {n: raw.mode for n, raw in enumerate(self.raw) if raw.mode is not None}
        return dataclasses.replace(
            bare,
            ways=ways_of(bare, modes, self.problems),
            order=cast(Order, self._order()),
            micro_steps=self._micro_steps(signals, modes.values()),
        )

    def _superstates(self) -> tuple[Mode, ...]:
        """Return the modes with modes inside; what they hold was handed down to those."""
        return tuple(
            dataclasses.replace(
                raw.mode, equations={}, flow={}, update={}, observer=None, run=None, invariants={}
            )
            for raw in self.raw
            if raw.mode is not None and raw.number is None
        )

    def _region(self, entry: Entry, parent: int, prefix: str) -> None:
        """Read a region: a node that its parent is always in, with what is inside it."""
        is_root = parent == ROOT
        path = f"{prefix}{entry.key}"
        key = f"regions.{entry.key}" if is_root else ""
        if not is_root:
            outer = self.raw[parent]
            base = outer.mode.key if outer.mode else ""
            key = f"{base}.regions.{entry.key}"
        what = REGION_KEYS if is_root else None
        table = self.modes.table(entry.node, key or "regions", what)
        self._enter(entry, table, parent, path, path, True, key, None)

    def _enter(
        self,
        entry: Entry,
        table: Table,
        parent: int,
        path: str,
        region: str,
        is_region: bool,
        key: str,
        above: Mode | None,
    ) -> None:
        index = len(self.raw)
        table = self.modes.like(table)
        kind = self._kind(entry, table)
        if kind == "history":
            is_region, region = False, self.raw[parent].region
        raw = RawNode(entry.key, path, kind, parent, region, is_region, entry.span, table)
        self.raw.append(raw)
        self.raw[parent].children.append(index)
        is_root = is_region and parent == ROOT
        if kind == "history":
            self._check_history(entry, table)
        elif not is_root:
            raw.mode = self._mode(entry, raw, key, above)
        elif kind != "compound":
            self.problems.error("missing", entry.span, "a region has at least one mode in `modes`")
            self.broken = True
        self._inside(raw, index, key, path, raw.mode if not is_region else None)
        raw.last = len(self.raw) - 1
        if kind in ("atomic", "parallel") and raw.mode:
            raw.number = raw.mode.number

    def _check_history(self, entry: Entry, table: Table) -> None:
        for key, own in table.entries.items():
            if key not in ("history", "initial", *TEXT_KEYS):
                label = f"`{entry.key}` is a history: it has no `{key}`"
                hint = "it only says what is entered in the mode around it"
                self.problems.error("form", own.span, label, hint)

    def _inside(self, raw: RawNode, index: int, key: str, path: str, above: Mode | None) -> None:
        prefix = "" if path == CHART else f"{path}."
        if raw.kind == "parallel":
            for entry in self.modes.named(raw.table.get("regions"), f"{key}.regions"):
                self._region(entry, index, prefix)
        elif raw.kind == "compound":
            base = f"{key}." if key else ""
            for entry in self.modes.named(raw.table.get("modes"), f"{base}modes"):
                inner = f"{base}modes.{entry.key}"
                table = self.modes.table(entry.node, inner)
                where = f"{prefix}{entry.key}"
                self._enter(entry, table, index, where, raw.region, False, inner, above)

    def _kind(self, entry: Entry, table: Table) -> Kind:
        if "history" in table.entries:
            return "history"
        if "modes" in table.entries and "regions" in table.entries:
            label = f"`{entry.key}` has both `modes` and `regions`"
            hint = "put the modes into one more region"
            self.problems.error("form", table.entries["regions"].span, label, hint)
        if "modes" in table.entries:
            return "compound"
        return "parallel" if "regions" in table.entries else "atomic"

    def _mode(self, entry: Entry, raw: RawNode, key: str, above: Mode | None) -> Mode:
        """Return the mode of a node; what superstates of its region hold is handed down."""
        name = raw.path.removeprefix(f"{raw.region}.") if raw.region != CHART else raw.path
        if raw.is_region:
            name = raw.name
        if raw.kind == "compound" and "number" in raw.table.entries:
            span = raw.table.entries["number"].span
            self.problems.error("form", span, "a superstate has no number: its innermost modes do")
        if "priority" in raw.table.entries and not raw.is_region:
            span = raw.table.entries["priority"].span
            self.problems.error("form", span, "a mode has no priority: regions inside a mode do")
        position = sum(1 for r in self.raw if r.region == raw.region and r.number is not None)
        site = Site(key, raw.region, position, above, raw.kind != "atomic")
        return self.modes.mode(Entry(name, entry.span, raw.table), site)

    def _node(self, index: int) -> Node:
        raw = self.raw[index]
        table = raw.table
        final = self.modes.choice(table.get("final"), "final", ("true", "false"), "false")
        if final == "true" and raw.kind != "atomic":
            label = "a final mode has no modes inside"
            self.problems.error("form", table.entries["final"].span, label)
        kept = ("shallow", "deep")
        return Node(
            index=index,
            last=raw.last,
            name=raw.name,
            path=raw.path,
            kind=raw.kind,
            parent=raw.parent,
            children=tuple(raw.children),
            region=raw.region,
            is_region=raw.is_region,
            mode=raw.mode.key if raw.mode else "",
            number=raw.number,
            initial=raw.initial,
            history=cast(Keeping, self.modes.choice(table.get("history"), "history", kept, "")),
            final=final == "true",
            rank=self.modes.whole(table.get("priority"), "priority", 0, 0, 1000),
        )

    def _signals(self) -> dict[str, Signal]:
        found: dict[str, Signal] = {}
        for entry in self.modes.named(self.root.get("events"), "events"):
            table = self.modes.table(entry.node, f"events.{entry.key}", ("from",))
            comes = self.modes.choice(table.get("from"), "from", ("input",), "")
            found[entry.key] = Signal(entry.key, len(found) + 1, comes == "input")
        return found

    def _order(self) -> str:
        allowed = ("outer_first", "inner_first")
        return self.modes.choice(self.root.get("order"), "order", allowed, "outer_first")

    def _micro_steps(self, signals: Mapping[str, Signal], modes: Iterable[Mode]) -> int:
        """One, or as many as modes where one tick may have several events to take."""
        raised = any(way.raises for mode in modes for way in mode.transitions)
        several = raised or sum(signal.is_input for signal in signals.values()) > 1
        count = max(2, sum(raw.number is not None for raw in self.raw))
        node = self.root.get("micro_steps")
        given = self.modes.whole(
            node, "micro_steps", min(count, MOST_MICRO_STEPS) if several else 1, 1, MOST_MICRO_STEPS
        )
        if node is not None and raised and given < 2:
            label = "an event that is raised is taken in the next micro-step: one is too few"
            self.problems.error("form", node.span, label)
        return given

    def _as_region(self, chart: Chart, node: Node) -> Region:
        modes = {}
        for leaf in chart.leaves(node.region):
            mode = self.raw[leaf.index].mode
            assert mode is not None
            modes[mode.name] = mode
        check_numbers(modes.values(), self.problems)
        active = chart.first(node, ())
        initial = next(n for n in active if n.region == node.region and n.number is not None)
        start = self.raw[initial.index].mode
        assert start is not None
        inactive = (
            None if node.parent == ROOT else min(-1, *(mode.number - 1 for mode in modes.values()))
        )
        return Region(node.region, modes, start.name, self.raw[node.index].span, inactive)
