"""Mode reader: the modes of an automaton, with templates and inherited dynamics."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable

from language.expressions.name_rules import check_region_name
from language.expressions.parser import parse_balance
from language.expressions.syntax_tree import Arithmetic, ErrorNode, SyntaxTree
from language.ir.root_region import CHART
from language.model.automaton import Automaton, Balance, Invariant, Mode, ModelRun, Observer, Region
from language.model.declaration import Formula
from language.readers.base_reader import Reader
from language.readers.observer_reader import read_observer, read_run
from language.readers.transition_reader import ModeContext, TransitionReader
from language.text.diagnostic import Problems, Span, suggest_name
from language.text.document import Entry, MappingNode, YamlNode
from language.text.overlay import apply_overlay, without_keys

INNER_KEYS = ("modes", "regions", "initial", "final", "history", "priority", "transition_table")
"""Keys of a mode that only charts have."""
MODE_KEYS = ("number", "equations", "flow", "terms", "update", "observer", "runs", "transitions")
REGION_KEYS = ("initial", "modes", "transition_table")
IMPLICIT_MODE = "always"
"""The name of the only mode of an automaton that declares no modes."""
ACTION_KEYS = ("entry", "exit", "invariant")


class ModeReader(Reader):
    """Reads the modes of an automaton.

    `root` is the tree of the automaton, and `model` the model whose modes it may run.
    """

    def __init__(self, problems: Problems, model: Automaton | None, root: MappingNode) -> None:
        """Report into `problems`; read the templates and the names of events at `root`.

        `model` is the continuous automaton whose modes may be run and observed, or None.
        """
        super().__init__(problems)
        self.model = model
        self.root = root
        self.templates = self.read_mapping(root.get("templates"), "templates")
        events = self.read_mapping(root.get("events"), "events")
        self.transition_reader = TransitionReader(problems, tuple(events.entries))

    def read_regions(self, span: Span) -> tuple[Region, ...]:
        """Return the region `chart`, then the other regions of the root in the order of the file.

        `chart` consists of the `modes` at the root, or is a region of that name. Without modes at
        the root it has the single mode `always`, placed at `span`. Modes inside modes are not read
        (see `ChartReader`). Raises SpecError for a region without a mode; other problems are
        reported.
        """
        entries = self.root_region_entries()
        chart = next((entry for entry in entries if entry.key == CHART), None)
        parallel = tuple(self._read_region(entry) for entry in entries if entry is not chart)
        if chart is not None:
            return (self._read_region(chart), *parallel)
        modes = self._read_modes(self.root.get("modes"), CHART, "")
        if not modes:
            always = Entry(IMPLICIT_MODE, span, MappingNode({}, span))
            modes = {
                IMPLICIT_MODE: self.read_mode(
                    always, ModeContext(f"modes.{IMPLICIT_MODE}", CHART, 0)
                )
            }
        return (Region(CHART, modes, self._read_initial(self.root, modes, span), span), *parallel)

    def root_region_entries(self) -> list[Entry]:
        """Return the entries of `regions` at the root in the order of the file.

        Wrong names are reported and kept. If a region is called `chart`, `modes` and `initial` at
        the root are reported as duplicates.
        """
        entries = list(self.read_mapping(self.root.get("regions"), "regions"))
        for entry in entries:
            check_region_name(entry.key, entry.span, self.problems)
        if any(entry.key == CHART for entry in entries):
            for key in ("modes", "initial"):
                if key in self.root.entries:
                    label = f"`{key}` is given at the root and in region `{CHART}`"
                    self.problems.error("duplicate", self.root.entries[key].span, label)
        return entries

    def _read_region(self, entry: Entry) -> Region:
        """Return a parallel region. Raises SpecError if it has no mode."""
        table = self.read_mapping(entry.node, f"regions.{entry.key}", REGION_KEYS)
        modes = self._read_modes(table.get("modes"), entry.key, f"regions.{entry.key}.")
        if not modes:
            self.problems.error("missing", entry.span, "a region has at least one mode in `modes`")
            self.problems.raise_if_errors()
        return Region(entry.key, modes, self._read_initial(table, modes, entry.span), entry.span)

    def _read_modes(self, node: YamlNode | None, region: str, key_prefix: str) -> dict[str, Mode]:
        """Return the modes of a region by name; their key paths begin with `key_prefix`."""
        modes: dict[str, Mode] = {}
        for entry in self.named_entries(node, "modes"):
            table = self.apply_template(self.read_mapping(entry.node, f"modes.{entry.key}"))
            site = ModeContext(f"{key_prefix}modes.{entry.key}", region, len(modes))
            modes[entry.key] = self.read_mode(Entry(entry.key, entry.span, table), site)
        check_mode_numbers(modes.values(), self.problems)
        return modes

    def _read_initial(self, table: MappingNode, modes: dict[str, Mode], span: Span) -> str:
        """Return the name of the initial mode; a missing or unknown name is reported.

        A region with a single mode needs no `initial`.
        """
        node = table.get("initial")
        if node is None and len(modes) == 1:
            return next(iter(modes))
        if node is None:
            hint = f"like `initial: {next(iter(modes))}`" if modes else ""
            self.problems.error("missing", span, "`initial` is missing", hint)
        name = self.read_reference(node, "initial") if node else ""
        if name and name not in modes and node is not None:
            label = f"there is no mode `{name}`"
            self.problems.error("name", node.span, label, suggest_name(name, modes))
        return name

    def apply_template(self, mode: MappingNode) -> MappingNode:
        """Return the mapping of a mode merged over the template that `like` names, without `like`.

        Keys of the mode have precedence, at any depth. A mode without `like` is returned unchanged.
        An unknown template is reported, and the mode is returned without `like`. A `like` inside
        the template is not applied.
        """
        node = mode.get("like")
        if node is None:
            return mode
        name = self.read_string(node, "like", node.span)
        template = self.templates.get(name)
        if not isinstance(template, MappingNode):
            label = f"there is no template `{name}`"
            self.problems.error(
                "name", node.span, label, suggest_name(name, self.templates.entries)
            )
            return without_keys(mode, "like")
        return apply_overlay(template, without_keys(mode, "like"), self.problems, is_template=True)

    def read_mode(self, entry: Entry, context: ModeContext) -> Mode:
        """Return a mode with the dynamics that it inherits from `context.parent` or from the root.

        The key of `entry` is its name; without `number` it has the number `context.position`.
        Equations and updates are merged with the inherited ones (a name in both is reported). An
        own balance or invariant replaces an inherited one of the same name; observer and run are
        inherited if the mode has none. Only outermost modes of `chart` have the equations, flow and
        terms of the root. Templates are not applied here; problems are reported.
        """
        key, parent = context.key, context.parent
        table = self.read_mapping(entry.node, key, (*MODE_KEYS, *ACTION_KEYS, *INNER_KEYS))
        invariants = self._read_invariants(table.get("invariant"), f"{key}.invariant")
        transitions = self.transition_reader.read_transitions(
            table.get("transitions"), entry.key, context
        )
        return Mode(
            name=entry.key,
            number=self.read_integer(table.get("number"), "number", context.position, -100, 100),
            equations=self._read_equations(table, context),
            flow=self._read_flow(table, context),
            update=self._read_updates(table, context),
            observer=self._read_observer(table.get("observer"), context),
            run=self._read_run(table.get("runs"), context),
            transitions=tuple(transitions),
            key=key,
            span=entry.span,
            region=context.region,
            entry=self.read_formulas(table.get("entry"), f"{key}.entry"),
            exit=self.read_formulas(table.get("exit"), f"{key}.exit"),
            invariants={**(parent.invariants if parent else {}), **invariants},
        )

    def _root_sections(self, context: ModeContext) -> MappingNode:
        """Return the root for a mode of the region `chart` without a parent, else an empty mapping.

        `equations`, `flow` and `terms` of the root hold in all these modes.
        """
        is_outermost = context.region == CHART and context.parent is None
        return self.root if is_outermost else MappingNode({}, self.root.span)

    def _read_equations(self, table: MappingNode, context: ModeContext) -> dict[str, Formula]:
        """Return the inherited and own equations; equations that are given twice are reported."""
        inherited = dict(context.parent.equations) if context.parent else {}
        inherited |= self.read_formulas(self._root_sections(context).get("equations"), "equations")
        own = self.read_formulas(table.get("equations"), f"{context.key}.equations")
        return self._merge_formulas(inherited, own, "an equation for every mode")

    def _read_updates(self, table: MappingNode, context: ModeContext) -> dict[str, Formula]:
        """Return the inherited and own updates; updates that are given twice are reported."""
        inherited = dict(context.parent.update) if context.parent else {}
        own = self.read_formulas(table.get("update"), f"{context.key}.update")
        return self._merge_formulas(inherited, own, "an update in a mode around this one")

    def _merge_formulas(
        self, inherited: dict[str, Formula], own: dict[str, Formula], what: str
    ) -> dict[str, Formula]:
        """Return the union; a name in both is reported, and the own formula wins."""
        for name, formula in own.items():
            if name in inherited:
                label = f"`{name}` has {what} already"
                hint = f"it is given at {inherited[name].span}"
                self.problems.error("duplicate", formula.span, label, hint)
        return inherited | own

    def _read_flow(self, table: MappingNode, context: ModeContext) -> dict[str, Balance]:
        """Return the balances of a mode by state, with all terms added to their right sides.

        An own balance replaces an inherited one.
        """
        shared = self._root_sections(context)
        flow = dict(context.parent.flow) if context.parent else {}
        flow |= self._read_balances(shared.get("flow"), "flow")
        flow |= self._read_balances(table.get("flow"), f"{context.key}.flow")
        self._add_terms(flow, shared.get("terms"), "terms")
        self._add_terms(flow, table.get("terms"), f"{context.key}.terms")
        return flow

    def _read_invariants(self, node: YamlNode | None, key: str) -> dict[str, Invariant]:
        """Return the invariants of a mode by name; one with a wrong condition is left out."""
        invariants = {}
        for entry in self.named_entries(node, key):
            table = self.read_mapping(entry.node, f"{key}.{entry.key}", ("that", "message"))
            that = self.read_expression(table.get("that"), f"{key}.{entry.key}.that", entry.span)
            message = table.get("message")
            text = self.read_string(message, "message", entry.span) if message else f"`{entry.key}`"
            if that:
                invariants[entry.key] = Invariant(that, text)
        return invariants

    def _read_observer(self, node: YamlNode | None, context: ModeContext) -> Observer | None:
        """Return the observer of a mode, by default that of its parent."""
        if node is None:
            return context.parent.observer if context.parent else None
        return read_observer(self, node, f"{context.key}.observer", self.model)

    def _read_run(self, node: YamlNode | None, context: ModeContext) -> ModelRun | None:
        """Return the model run of a mode, by default that of its parent."""
        if node is None:
            return context.parent.run if context.parent else None
        return read_run(self, node, f"{context.key}.runs", self.model)

    def _read_balances(self, node: YamlNode | None, key: str) -> dict[str, Balance]:
        """Return the balances of a section by state; one that cannot be parsed has error nodes."""
        balances = {}
        for entry in self.named_entries(node, key):
            scalar = self.read_scalar(entry.node, f"{key}.{entry.key}", entry.span)
            if scalar is None:
                continue
            left: SyntaxTree = ErrorNode(scalar.span)
            right: SyntaxTree = left
            with self.problems.collect_errors():
                left, right = parse_balance(scalar)
            balances[entry.key] = Balance(entry.key, left, right, f"{key}.{entry.key}")
        return balances

    def _add_terms(self, flow: dict[str, Balance], node: YamlNode | None, key: str) -> None:
        """Add named summands to the right sides of balances of `flow`, in the order of the file.

        A term for a state without a balance is reported.
        """
        for entry in self.named_entries(node, key):
            terms = self.read_formulas(entry.node, f"{key}.{entry.key}")
            if entry.key not in flow:
                label = f"there is no balance of `{entry.key}` that a term could be added to"
                self.problems.error("name", entry.span, label, suggest_name(entry.key, flow))
                continue
            balance = flow[entry.key]
            right = balance.right
            for formula in terms.values():
                right = Arithmetic("+", right, formula.tree, formula.span)
            flow[entry.key] = dataclasses.replace(balance, right=right)


def check_mode_numbers(modes: Iterable[Mode], problems: Problems) -> None:
    """Report each mode of one region whose number an earlier mode has; the hint is a free number.

    The hint is the smallest number from 0 on that no mode before it has.
    """
    names: dict[int, str] = {}
    for mode in modes:
        if mode.number in names:
            label = f"number {mode.number} is that of mode `{names[mode.number]}`"
            free = next(number for number in range(len(names) + 1) if number not in names)
            hint = f"another `number`, like {free}; without one, modes count from 0"
            problems.error("duplicate", mode.span, label, hint)
        names.setdefault(mode.number, mode.name)
