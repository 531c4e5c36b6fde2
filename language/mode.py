"""Mode reader: the modes of an automaton with their transitions, templates laid under them."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from typing import Literal, cast

from language.chart import Keeping
from language.declaration import Formula
from language.document import Entry, Items, Node, Scalar, Table
from language.model import CHART, Automaton, Balance, Invariant, Mode, Region, Rewind, Transition
from language.names import check_region_name
from language.observer import read_observer, read_run
from language.overlay import lay, without
from language.parse import parse_balance
from language.problem import Problems, Span, nearest
from language.reader import Reader
from language.syntax import Arithmetic, Broken, Tree, Truth

INNER_KEYS = ("modes", "regions", "initial", "final", "history", "priority", "transition_table")
"""Keys of a mode in a chart."""
MODE_KEYS = ("number", "equations", "flow", "terms", "update", "observer", "runs", "transitions")
REGION_KEYS = ("initial", "modes", "transition_table")
ALWAYS = "always"
"""The mode of an automaton that has none of its own."""
ACTION_KEYS = ("entry", "exit", "invariant")
TRANSITION_KEYS = ("to", "when", "wait", "priority", "reset", "memory", "rewind")
CHART_WAY_KEYS = ("event", "raise", "history", "internal")
Remembering = Literal["reset", "continue"]


class ModeReader(Reader):
    """Reads modes; `model` is what their runs may run."""

    def __init__(self, problems: Problems, model: Automaton | None) -> None:
        """Report into `problems`."""
        super().__init__(problems)
        self.model = model
        self.completing = False
        self.events: tuple[str, ...] = ()

    def regions(self, tree: Table, at: Span) -> tuple[Region, ...]:
        """Return the chart and the regions beside it; one mode `always` where none is written."""
        entries = list(self.table(tree.get("regions"), "regions"))
        for entry in entries:
            check_region_name(entry.key, entry.span, self.problems)
        chart = next((entry for entry in entries if entry.key == CHART), None)
        beside = tuple(self._region(entry, tree) for entry in entries if entry is not chart)
        if chart is not None:
            for key in ("modes", "initial"):
                if key in tree.entries:
                    label = f"`{key}` stands at the root and in region `{CHART}`"
                    self.problems.error("duplicate", tree.entries[key].span, label)
            return (self._region(chart, tree), *beside)
        modes = self._modes(tree.get("modes"), CHART, tree)
        if not modes:
            entry = Entry(ALWAYS, at, Table({}, at))
            modes = {ALWAYS: self._mode(entry, Table({}, at), tree, 0, CHART)}
        return (Region(CHART, modes, self._initial(tree, modes, at), at), *beside)

    def _region(self, entry: Entry, root: Table) -> Region:
        table = self.table(entry.node, f"regions.{entry.key}", REGION_KEYS)
        modes = self._modes(table.get("modes"), entry.key, root)
        if not modes:
            self.problems.error("missing", entry.span, "a region has at least one mode in `modes`")
            self.problems.stop_if_any()
        return Region(entry.key, modes, self._initial(table, modes, entry.span), entry.span)

    def _modes(self, node: Node | None, region: str, root: Table) -> dict[str, Mode]:
        templates = self.table(root.get("templates"), "templates")
        modes: dict[str, Mode] = {}
        numbers: dict[int, str] = {}
        for entry in self.named(node, "modes"):
            table = self._like(self.table(entry.node, f"modes.{entry.key}"), templates)
            mode = self._mode(entry, table, root, len(modes), region)
            modes[entry.key] = mode
            if mode.number in numbers:
                label = f"number {mode.number} is that of mode `{numbers[mode.number]}`"
                free = next(n for n in range(len(numbers) + 1) if n not in numbers)
                hint = f"another `number`, like {free}; without one, modes count from 0"
                self.problems.error("duplicate", mode.span, label, hint)
            numbers.setdefault(mode.number, mode.name)
        return modes

    def _initial(self, table: Table, modes: dict[str, Mode], at: Span) -> str:
        node = table.get("initial")
        if node is None and len(modes) == 1:
            return next(iter(modes))
        name = self.text(node, "initial", at)
        if name and name not in modes and node is not None:
            label = f"there is no mode `{name}`"
            self.problems.error("name", node.span, label, nearest(name, modes))
        return name

    def _like(self, mode: Table, templates: Table) -> Table:
        node = mode.get("like")
        if node is None:
            return mode
        name = self.text(node, "like", node.span)
        template = templates.get(name)
        if not isinstance(template, Table):
            label = f"there is no template `{name}`"
            self.problems.error("name", node.span, label, nearest(name, templates.entries))
            return without(mode, "like")
        return lay(template, without(mode, "like"), self.problems, template=True)

    def _mode(self, entry: Entry, body: Table, root: Table, position: int, region: str) -> Mode:
        key = f"modes.{entry.key}" if region == CHART else f"regions.{region}.modes.{entry.key}"
        return self.inner_mode(entry, body, root, position, region, key, None)

    def inner_mode(
        self,
        entry: Entry,
        body: Table,
        root: Table,
        position: int,
        region: str,
        key: str,
        above: Mode | None,
    ) -> Mode:
        """Return a mode that has what the mode `above` hands down, else what the root says."""
        table = self.table(body, key, (*MODE_KEYS, *ACTION_KEYS, *INNER_KEYS))
        shared = root if region == CHART and above is None else Table({}, root.span)
        handed = above.equations if above else {}
        equations = {**handed, **self._formulas(shared.get("equations"), "equations")}
        for name, formula in self._formulas(table.get("equations"), f"{key}.equations").items():
            if name in equations:
                label = f"`{name}` has an equation for every mode already"
                hint = f"it is given at {equations[name].span}"
                self.problems.error("duplicate", formula.span, label, hint)
            equations[name] = formula
        flow = {**(above.flow if above else {}), **self._flow(shared.get("flow"), "flow")}
        flow.update(self._flow(table.get("flow"), f"{key}.flow"))
        self._add_terms(flow, shared.get("terms"), "terms")
        self._add_terms(flow, table.get("terms"), f"{key}.terms")
        update = self._formulas(table.get("update"), f"{key}.update")
        for name, formula in update.items():
            if above and name in above.update:
                label = f"`{name}` has an update in a mode around this one already"
                hint = f"it is given at {above.update[name].span}"
                self.problems.error("duplicate", formula.span, label, hint)
        observer_node, run_node = table.get("observer"), table.get("runs")
        observer, run = (above.observer, above.run) if above else (None, None)
        if observer_node:
            observer = read_observer(self, observer_node, f"{key}.observer", self.model)
        if run_node:
            run = read_run(self, run_node, f"{key}.runs", self.model)
        invariants = self._invariants(table.get("invariant"), f"{key}.invariant")
        return Mode(
            name=entry.key,
            number=self.whole(table.get("number"), "number", position, -100, 100),
            equations=equations,
            flow=flow,
            update={**(above.update if above else {}), **update},
            observer=observer,
            run=run,
            transitions=tuple(self._transitions(table.get("transitions"), entry.key, key, region)),
            key=key,
            span=entry.span,
            region=region,
            entry=self._formulas(table.get("entry"), f"{key}.entry"),
            exit=self._formulas(table.get("exit"), f"{key}.exit"),
            invariants={**(above.invariants if above else {}), **invariants},
        )

    def _formulas(self, node: Node | None, key: str) -> dict[str, Formula]:
        found = {}
        for entry in self.named(node, key):
            formula = self.expression(entry.node, f"{key}.{entry.key}", entry.span)
            if formula:
                found[entry.key] = formula
        return found

    def _invariants(self, node: Node | None, key: str) -> dict[str, Invariant]:
        found = {}
        for entry in self.named(node, key):
            table = self.table(entry.node, f"{key}.{entry.key}", ("that", "message"))
            that = self.expression(table.get("that"), f"{key}.{entry.key}.that", entry.span)
            message = table.get("message")
            text = self.text(message, "message", entry.span) if message else f"`{entry.key}`"
            if that:
                found[entry.key] = Invariant(that, text)
        return found

    def _flow(self, node: Node | None, key: str) -> dict[str, Balance]:
        found = {}
        for entry in self.named(node, key):
            scalar = self.scalar(entry.node, f"{key}.{entry.key}", entry.span)
            if scalar is None:
                continue
            left: Tree = Broken(scalar.span)
            right: Tree = left
            with self.problems.collecting():
                left, right = parse_balance(scalar)
            found[entry.key] = Balance(entry.key, left, right, f"{key}.{entry.key}")
        return found

    def _add_terms(self, flow: dict[str, Balance], node: Node | None, key: str) -> None:
        """Add named summands to the right sides of balances, in the order of layers."""
        for entry in self.named(node, key):
            terms = self._formulas(entry.node, f"{key}.{entry.key}")
            if entry.key not in flow:
                label = f"there is no balance of `{entry.key}` that a term could be added to"
                self.problems.error("name", entry.span, label, nearest(entry.key, flow))
                continue
            balance = flow[entry.key]
            right = balance.right
            for formula in terms.values():
                right = Arithmetic("+", right, formula.tree, formula.span)
            flow[entry.key] = dataclasses.replace(balance, right=right)

    def _transitions(
        self, node: Node | None, source: str, mode: str, region: str
    ) -> Iterator[Transition]:
        for entry in self.named(node, "transitions"):
            key = f"{mode}.transitions.{entry.key}"
            table = self.table(entry.node, key, (*TRANSITION_KEYS, *CHART_WAY_KEYS))
            to = table.get("to")
            targets = self._words(to, "to") if to else (entry.key,)
            events = self._events(table, "event")
            when = self._guard(table, key, entry, bool(events))
            wait_node = table.get("wait")
            wait = self.expression(wait_node, f"{key}.wait", entry.span) if wait_node else None
            priority_node = table.get("priority")
            priority = self.whole(priority_node, "priority", 0, 0, 1000) if priority_node else None
            keeping = ("reset", "continue")
            memory = self.choice(table.get("memory"), "memory", keeping, "reset")
            history = self.choice(table.get("history"), "history", ("shallow", "deep"), "")
            internal = self.choice(table.get("internal"), "internal", ("true", "false"), "false")
            if when:
                yield Transition(
                    name=entry.key,
                    source=source,
                    target=targets[0] if targets else source,
                    when=when,
                    wait=wait,
                    priority=priority,
                    reset=self._formulas(table.get("reset"), f"{key}.reset"),
                    key=key,
                    span=to.span if to else entry.span,
                    region=region,
                    memory=cast(Remembering, memory),
                    rewind=self._rewind(table.get("rewind"), f"{key}.rewind"),
                    targets=targets,
                    events=events,
                    raises=self._events(table, "raise"),
                    history=cast(Keeping, history),
                    internal=internal == "true",
                    completes="when" not in table.entries and not events,
                )

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
                hint = nearest(item.text, self.events) or "events are declared under `events`"
                self.problems.error("name", item.span, label, hint)
        return found

    def _guard(self, table: Table, key: str, entry: Entry, on_event: bool) -> Formula | None:
        """Return the guard; an event needs none, nor does the end of a mode with modes inside."""
        node = table.get("when")
        if node is None and (on_event or self.completing):
            return Formula(Truth(True, entry.span), f"{key}.when")
        return self.expression(node, f"{key}.when", entry.span)

    def _rewind(self, node: Node | None, key: str) -> Rewind | None:
        """Read how far back a transition reaches, and to what."""
        if node is None:
            return None
        table = self.table(node, key, ("until", "within"))
        parts = [
            self.expression(table.get(part), f"{key}.{part}", node.span)
            for part in ("until", "within")
        ]
        return Rewind(parts[0], parts[1], node.span) if parts[0] and parts[1] else None
