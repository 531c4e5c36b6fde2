"""Moment: what names are at one instant in one mode, and after transitions of that instant.

Every expression is lowered as for a Program; what it needs of equations becomes steps before it.
Of parallel regions each equation is chosen by the region's own mode, which is a variable here. What
functions with memory give is any value: an edge only where its condition is as it says.
"""

from __future__ import annotations

import copy
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from fractions import Fraction

from language.action import place_of
from language.activity import is_active, is_complete
from language.chart import Chart, Node
from language.chart_target import mode_paths
from language.constants import exact_value
from language.declaration import Formula
from language.graph import post_order
from language.lower import WHOLE_TYPES, assigned, expression
from language.memory import ticks_of, type_of
from language.model import Automaton, Mode, Transition
from language.number import rounded
from language.once import once
from language.operation import Binary, Compare, Expr, Ref, Select, Unary, Value, whole
from language.parameter import constant_names
from language.precedence import node_of
from language.program import mode_variable
from language.question import Extent, Step
from language.syntax import EDGES, MEMORY, Application, Tree, memory_key, walk

ELAPSED = "memory.elapsed"
"""The time since the entry of the mode: in ticks of a sampled automaton, else in seconds."""


@dataclass
class Story:
    """What is computed at an instant, in order, and what is known of it besides."""

    steps: list[Step] = field(default_factory=list)
    facts: list[Expr] = field(default_factory=list)
    extents: dict[str, Extent] = field(default_factory=dict)
    moments: int = 0


class Moment:
    """A mode of one region at an instant; `after` a transition comes the next one."""

    def __init__(
        self,
        automaton: Automaton,
        mode: Mode,
        story: Story | None = None,
        carried: Mapping[str, Expr] | None = None,
    ) -> None:
        """Begin an instant, or go on with the values that a transition left."""
        self.automaton = automaton
        self.mode = mode
        self.story = story or Story()
        self.tag = f" {self.story.moments}" if self.story.moments else ""
        self.elapsed = ELAPSED
        self.story.moments += 1
        self.known: dict[str, Expr] = dict(constant_names(automaton))
        for name, thing in automaton.inputs.items():
            self.known[name] = Ref(f"input.{name}", thing.type in WHOLE_TYPES)
        for name, variable in automaton.carried.items():
            self.known[name] = Ref(place_of(automaton, name), variable.type in WHOLE_TYPES)
        self.known.update(carried or {})
        self.known.update(self._modes())

    def expression(self, tree: Tree) -> Expr:
        """Return an expression of this moment. Raises KeyError where a name is not known here."""
        self._define([tree])
        return expression(tree, self.known)

    def guard(self, transition: Transition) -> Expr:
        """Return when a transition is enabled, events aside: where it completes, by the modes."""
        chart = self.automaton.tree
        node = node_of(self.automaton, self.automaton.source(transition))
        if transition.completes and chart and node:
            return is_complete(chart, node, "mode")
        return self.expression(transition.when.tree)

    def seen_by(self, outer: Mode) -> Moment:
        """Return this moment as a mode around ours has it: it is active for as long, or longer."""
        seen = copy.copy(self)
        seen.known = {key: value for key, value in self.known.items() if key[:6] != "after "}
        seen.elapsed = f"{ELAPSED} {outer.key}"
        ages = Ref(seen.elapsed, True), Ref(ELAPSED, True)
        self.story.extents.update((age.name, Extent("whole", low=Fraction(0))) for age in ages)
        self.story.facts.append(Compare(">=", *ages))
        return seen

    def after(self, transition: Transition) -> Moment:
        """Return the moment after a transition: exit, reset and entry, each read as a whole."""
        target = self.automaton.target(transition)
        carried = self._stage(self.mode.exit, {})
        carried = self._stage(transition.reset, carried)
        there = Moment(self.automaton, target, self.story, {**self._carried(), **carried})
        if target.entry:
            entered = there._stage(target.entry, {})
            there = Moment(self.automaton, target, self.story, {**there._carried(), **entered})
        return there

    def _carried(self) -> dict[str, Expr]:
        return {name: self.known[name] for name in self.automaton.carried}

    def _stage(self, formulas: Mapping[str, Formula], carried: dict[str, Expr]) -> dict[str, Expr]:
        """Return what is carried after a stage; its equations are those of this moment."""
        self._define(formula.tree for formula in formulas.values())
        known = {**self.known, **carried}
        found = dict(carried)
        for name, formula in formulas.items():
            is_whole = self.automaton.carried[name].type in WHOLE_TYPES
            target = f"{place_of(self.automaton, name)} {len(self.story.steps)}"
            value = assigned(formula.tree, known, is_whole)
            self.story.steps.append((target, value))
            found[name] = Ref(target, is_whole)
        return found

    def _modes(self) -> dict[str, Expr]:
        """Return what `in(...)` is: of our own region it is certain, of others any mode."""
        model = self.automaton.model
        found = _modes_of_run(model, self.story.extents) if model else {}
        if self.automaton.tree:
            return {**found, **self._modes_of_chart(self.automaton.tree)}
        for region in self.automaton.all_regions:
            own = region.name == self.mode.region
            selector = Ref(f"mode.{region.name}", True)
            if not own:
                self.story.extents[selector.name] = _any_mode(region.modes.values())
            for name, mode in region.modes.items():
                is_in: Expr = Compare("==", selector, whole(mode.number))
                found[f"in {region.name}.{name}"] = Value(name == self.mode.name) if own else is_in
        return found

    def _modes_of_chart(self, chart: Chart) -> dict[str, Expr]:
        """Return what `in(...)` is inside a chart: around our own mode only what holds it."""
        own = next(node for node in chart.nodes if node.mode == self.mode.key)
        for region in self.automaton.all_regions:
            leaves = chart.leaves(region.name)
            around = chart.region_node(region.name).holds(own.index)
            here = [leaf for leaf in leaves if leaf.holds(own.index) or own.holds(leaf.index)]
            numbers = [
                leaf.number for leaf in (here if around else leaves) if leaf.number is not None
            ]
            if not around and region.inactive is not None:
                numbers.append(region.inactive)
            name = mode_variable("mode", region.name)
            self.story.extents[name] = Extent("whole", numbers=tuple(numbers))
        found: dict[str, Expr] = {}
        for path, (node, active) in _active(chart).items():
            found[f"in {path}"] = Value(True) if node.holds(own.index) else active
        return found

    def _define(self, trees: Iterable[Tree]) -> None:
        """Make the equations known that some expressions need, each after those that it reads."""
        trees = list(trees)
        needed: dict[str, list[tuple[int | None, str, Formula]]] = {}
        stack = [name for tree in trees for name in _reads(tree)]
        while stack:
            name = stack.pop()
            if name in needed or name in self.known:
                continue
            needed[name] = list(self._alternatives(name))
            stack += [read for _, _, formula in needed[name] for read in formula.reads]
        reads = {n: [r for _, _, f in found for r in f.reads] for n, found in needed.items()}
        for name in post_order(reads):
            if needed[name]:
                self._equation(name, needed[name])
        for tree in trees:
            self.remember(tree)

    def _alternatives(self, name: str) -> Iterator[tuple[int | None, str, Formula]]:
        """Yield the formulas that an equation can have: our mode's, else by another region's."""
        if name in self.mode.equations:
            yield None, self.mode.region, self.mode.equations[name]
            return
        for region in self.automaton.all_regions:
            for mode in region.modes.values() if region.name != self.mode.region else ():
                if name in mode.equations:
                    yield mode.number, region.name, mode.equations[name]

    def _equation(self, name: str, found: list[tuple[int | None, str, Formula]]) -> None:
        is_whole = found[0][2].whole
        value: Expr | None = None
        for number, region, formula in reversed(found):
            self.remember(formula.tree)
            own = assigned(formula.tree, self.known, formula.whole)
            if value is None or number is None:
                value = own
            else:
                is_in = Compare("==", Ref(f"mode.{region}", True), whole(number))
                value = Select(is_in, own, value)
        assert value is not None
        target = f"equation.{name}{self.tag}"
        self.story.steps.append((target, value))
        self.known[name] = Ref(target, is_whole)

    def remember(self, tree: Tree) -> None:
        """Make the functions with memory known; what is inside of one comes first."""
        for part in reversed(walk(tree)):
            if isinstance(part, Application) and part.function in MEMORY:
                key = memory_key(part)
                if key not in self.known:
                    self.known[key] = self._remembered(part)

    def _remembered(self, part: Application) -> Expr:
        automaton = self.automaton
        if self.tag and part.function in (*EDGES, "every"):
            return Value(False)  # nothing was seen before in this activation
        if part.function == "after":
            if self.tag:
                return Value(_time_of(automaton, part) <= 0)
            if automaton.is_sampled:
                return self._aged(part)
            self.story.extents[ELAPSED] = Extent(low=Fraction(0))
            time = expression(part.arguments[0], constant_names(automaton))
            return Compare(">=", Ref(ELAPSED), time)
        if part.function in ("rising", "falling"):
            level = expression(part.arguments[0], self.known)
            now = level if part.function == "rising" else Unary("not", level)
            return Binary("and", self._changed(part), now)
        name = f"memory.{part.function}_{len(self.story.extents)}{self.tag}"
        if part.function in ("changed", "every"):
            self.story.extents[name] = Extent("truth")
            if part.function == "every" and automaton.is_sampled:
                aged = self._aged(part)
                if ticks_of(automaton, part.arguments[0]) == 1:
                    return aged  # each tick after the first
                self.story.facts.append(Binary("or", Unary("not", Ref(name)), aged))
            return Ref(name)
        kind = type_of(automaton, part.arguments[0])
        self.story.extents[name] = replace(self._extent_of(part.arguments[0]), type=kind)
        return Ref(name, kind == "whole")

    def _changed(self, part: Application) -> Expr:
        """Return whether a condition changed, which is what a rise and a fall of it share."""
        change = Application("changed", part.arguments, part.span)
        key = memory_key(change)
        if key not in self.known:
            self.known[key] = self._remembered(change)
        return self.known[key]

    def _aged(self, part: Application) -> Expr:
        """Return that a mode has been active for the whole ticks of a time."""
        self.story.extents[self.elapsed] = Extent("whole", low=Fraction(0))
        ticks = whole(ticks_of(self.automaton, part.arguments[0]))
        return Compare(">=", Ref(self.elapsed, True), ticks)

    def _extent_of(self, tree: Tree) -> Extent:
        """Return the bounds of a name that is delayed."""
        path = getattr(tree, "path", "")
        thing = self.automaton.inputs.get(path) or self.automaton.carried.get(path)
        if thing is None or thing.range is None:
            return Extent()
        low, high = (Fraction(rounded(bound, self.automaton.numbers)) for bound in thing.range)
        return Extent(low=low, high=high)


@once
def _active(chart: Chart) -> dict[str, tuple[Node, Expr]]:
    """Return the modes of a chart by their paths, with whether each is active."""
    paths = mode_paths(chart).items()
    return {path: (node, is_active(chart, node, "mode")) for path, node in paths}


def _time_of(automaton: Automaton, part: Application) -> Fraction:
    """Return the time of `after` exactly [s]."""
    return exact_value(Formula(part.arguments[0], ""), automaton)


def _reads(tree: Tree) -> list[str]:
    return list(Formula(tree, "").reads)


def _modes_of_run(model: Automaton, extents: dict[str, Extent]) -> dict[str, Expr]:
    """Return what `in(model.mode)` is: a run may be in any mode of the model."""
    found: dict[str, Expr] = {}
    for region in model.all_regions:
        selector = Ref(f"run.{region.name}", True)
        extents[selector.name] = _any_mode(region.modes.values())
        for name, mode in region.modes.items():
            is_in = Compare("==", selector, whole(mode.number))
            found[f"in {model.name}.{region.name}.{name}"] = is_in
            if region.name == model.chart.name:
                found[f"in {model.name}.{name}"] = is_in
    return found


def _any_mode(modes: Iterable[Mode]) -> Extent:
    """Return the numbers of some modes, with the names that a witness shows."""
    by_number = {mode.number: mode.name for mode in modes}
    names: tuple[str, ...] = ()
    if min(by_number) >= 0:
        names = tuple(by_number.get(number, "") for number in range(max(by_number) + 1))
    return Extent("whole", numbers=tuple(by_number), names=names)
