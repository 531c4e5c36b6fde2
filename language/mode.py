"""Mode reader: the modes of an automaton with their transitions, templates laid under them."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable

from language.declaration import Formula
from language.document import Entry, Node, Table
from language.model import CHART, Automaton, Balance, Invariant, Mode, Observer, Region, Run
from language.names import check_region_name
from language.observer import read_observer, read_run
from language.overlay import lay, without
from language.parse import parse_balance
from language.problem import Problems, Span, nearest
from language.reader import Reader
from language.site import Site
from language.syntax import Arithmetic, Broken, Tree
from language.transition_reader import TransitionReader

INNER_KEYS = ("modes", "regions", "initial", "final", "history", "priority", "transition_table")
"""Keys of a mode in a chart."""
MODE_KEYS = ("number", "equations", "flow", "terms", "update", "observer", "runs", "transitions")
REGION_KEYS = ("initial", "modes", "transition_table")
ALWAYS = "always"
"""The mode of an automaton that has none of its own."""
ACTION_KEYS = ("entry", "exit", "invariant")


class ModeReader(Reader):
    """Reads the modes of an automaton, `root`; `model` is what their runs may run."""

    def __init__(self, problems: Problems, model: Automaton | None, root: Table) -> None:
        """Report into `problems`."""
        super().__init__(problems)
        self.model = model
        self.root = root
        self.templates = self.table(root.get("templates"), "templates")
        events = self.table(root.get("events"), "events")
        self.ways = TransitionReader(problems, tuple(events.entries))

    def regions(self, at: Span) -> tuple[Region, ...]:
        """Return the chart and the regions beside it; one mode `always` where none is written."""
        entries = self.root_regions()
        chart = next((entry for entry in entries if entry.key == CHART), None)
        beside = tuple(self._region(entry) for entry in entries if entry is not chart)
        if chart is not None:
            return (self._region(chart), *beside)
        modes = self._modes(self.root.get("modes"), CHART, "")
        if not modes:
            always = Entry(ALWAYS, at, Table({}, at))
            modes = {ALWAYS: self.mode(always, Site(f"modes.{ALWAYS}", CHART, 0))}
        return (Region(CHART, modes, self._initial(self.root, modes, at), at), *beside)

    def root_regions(self) -> list[Entry]:
        """Return the regions at the root; the modes of one called `chart` stand nowhere else."""
        entries = list(self.table(self.root.get("regions"), "regions"))
        for entry in entries:
            check_region_name(entry.key, entry.span, self.problems)
        if any(entry.key == CHART for entry in entries):
            for key in ("modes", "initial"):
                if key in self.root.entries:
                    label = f"`{key}` stands at the root and in region `{CHART}`"
                    self.problems.error("duplicate", self.root.entries[key].span, label)
        return entries

    def _region(self, entry: Entry) -> Region:
        table = self.table(entry.node, f"regions.{entry.key}", REGION_KEYS)
        modes = self._modes(table.get("modes"), entry.key, f"regions.{entry.key}.")
        if not modes:
            self.problems.error("missing", entry.span, "a region has at least one mode in `modes`")
            self.problems.stop_if_any()
        return Region(entry.key, modes, self._initial(table, modes, entry.span), entry.span)

    def _modes(self, node: Node | None, region: str, base: str) -> dict[str, Mode]:
        """Return the modes of a region; their key paths begin with `base`."""
        modes: dict[str, Mode] = {}
        for entry in self.named(node, "modes"):
            table = self.like(self.table(entry.node, f"modes.{entry.key}"))
            site = Site(f"{base}modes.{entry.key}", region, len(modes))
            modes[entry.key] = self.mode(Entry(entry.key, entry.span, table), site)
        check_numbers(modes.values(), self.problems)
        return modes

    def _initial(self, table: Table, modes: dict[str, Mode], at: Span) -> str:
        node = table.get("initial")
        if node is None and len(modes) == 1:
            return next(iter(modes))
        if node is None:
            told = f"like `initial: {next(iter(modes))}`" if modes else ""
            self.problems.error("missing", at, "`initial` is missing", told)
        name = self.text(node, "initial", at) if node else ""
        if name and name not in modes and node is not None:
            label = f"there is no mode `{name}`"
            self.problems.error("name", node.span, label, nearest(name, modes))
        return name

    def like(self, mode: Table) -> Table:
        """Return the keys of a mode laid over the template that it is like, if it is like one."""
        node = mode.get("like")
        if node is None:
            return mode
        name = self.text(node, "like", node.span)
        template = self.templates.get(name)
        if not isinstance(template, Table):
            label = f"there is no template `{name}`"
            self.problems.error("name", node.span, label, nearest(name, self.templates.entries))
            return without(mode, "like")
        return lay(template, without(mode, "like"), self.problems, template=True)

    def mode(self, entry: Entry, site: Site) -> Mode:
        """Return a mode that has what the one around it hands down, else what the root says."""
        key, above = site.key, site.above
        table = self.table(entry.node, key, (*MODE_KEYS, *ACTION_KEYS, *INNER_KEYS))
        invariants = self._invariants(table.get("invariant"), f"{key}.invariant")
        ways = self.ways.transitions(table.get("transitions"), entry.key, site)
        return Mode(
            name=entry.key,
            number=self.whole(table.get("number"), "number", site.position, -100, 100),
            equations=self._equations(table, site),
            flow=self._flow(table, site),
            update=self._updates(table, site),
            observer=self._observer(table.get("observer"), site),
            run=self._run(table.get("runs"), site),
            transitions=tuple(ways),
            key=key,
            span=entry.span,
            region=site.region,
            entry=self.formulas(table.get("entry"), f"{key}.entry"),
            exit=self.formulas(table.get("exit"), f"{key}.exit"),
            invariants={**(above.invariants if above else {}), **invariants},
        )

    def _shared(self, site: Site) -> Table:
        """Return what the root says of every mode: of those of the chart that stand alone."""
        is_outermost = site.region == CHART and site.above is None
        return self.root if is_outermost else Table({}, self.root.span)

    def _equations(self, table: Table, site: Site) -> dict[str, Formula]:
        found = dict(site.above.equations) if site.above else {}
        found |= self.formulas(self._shared(site).get("equations"), "equations")
        own = self.formulas(table.get("equations"), f"{site.key}.equations")
        return self._joined(found, own, "an equation for every mode")

    def _updates(self, table: Table, site: Site) -> dict[str, Formula]:
        handed = dict(site.above.update) if site.above else {}
        own = self.formulas(table.get("update"), f"{site.key}.update")
        return self._joined(handed, own, "an update in a mode around this one")

    def _joined(
        self, given: dict[str, Formula], own: dict[str, Formula], what: str
    ) -> dict[str, Formula]:
        """Return both; what a mode gives a second time is reported."""
        for name, formula in own.items():
            if name in given:
                label = f"`{name}` has {what} already"
                hint = f"it is given at {given[name].span}"
                self.problems.error("duplicate", formula.span, label, hint)
        return given | own

    def _flow(self, table: Table, site: Site) -> dict[str, Balance]:
        """Return the balances of a mode, with the terms that are added to them."""
        shared = self._shared(site)
        found = dict(site.above.flow) if site.above else {}
        found |= self._balances(shared.get("flow"), "flow")
        found |= self._balances(table.get("flow"), f"{site.key}.flow")
        self._add_terms(found, shared.get("terms"), "terms")
        self._add_terms(found, table.get("terms"), f"{site.key}.terms")
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

    def _observer(self, node: Node | None, site: Site) -> Observer | None:
        if node is None:
            return site.above.observer if site.above else None
        return read_observer(self, node, f"{site.key}.observer", self.model)

    def _run(self, node: Node | None, site: Site) -> Run | None:
        if node is None:
            return site.above.run if site.above else None
        return read_run(self, node, f"{site.key}.runs", self.model)

    def _balances(self, node: Node | None, key: str) -> dict[str, Balance]:
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
            terms = self.formulas(entry.node, f"{key}.{entry.key}")
            if entry.key not in flow:
                label = f"there is no balance of `{entry.key}` that a term could be added to"
                self.problems.error("name", entry.span, label, nearest(entry.key, flow))
                continue
            balance = flow[entry.key]
            right = balance.right
            for formula in terms.values():
                right = Arithmetic("+", right, formula.tree, formula.span)
            flow[entry.key] = dataclasses.replace(balance, right=right)


def check_numbers(modes: Iterable[Mode], problems: Problems) -> None:
    """Report each mode of a region that has the number of an earlier one."""
    names: dict[int, str] = {}
    for mode in modes:
        if mode.number in names:
            label = f"number {mode.number} is that of mode `{names[mode.number]}`"
            free = next(number for number in range(len(names) + 1) if number not in names)
            hint = f"another `number`, like {free}; without one, modes count from 0"
            problems.error("duplicate", mode.span, label, hint)
        names.setdefault(mode.number, mode.name)
