"""Conditions: resolve and type-check the expressions of a test.

References to modes, fault bits and running statistics become names that the evaluation of a run
defines.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from fractions import Fraction
from typing import Any

from expectation.expectations import (
    Condition,
    FaultFlag,
    ModePredicate,
    RegionRef,
    RunningStatistic,
)
from expectation.name_resolution import (
    fault_bits,
    fault_words,
    format_region,
    mode_predicates,
    mode_signals,
    path_of_mode,
    require_mode_output,
    suggest_mode,
    suggest_output,
    suggest_path,
)
from language.expressions.syntax_tree import (
    ErrorNode,
    FunctionCall,
    Name,
    Not,
    NumberLiteral,
    Relation,
    SyntaxTree,
)
from language.expressions.units import PURE_NUMBER, SECOND, are_compatible
from language.loading.signal_types import signal_types
from language.model.declaration import Formula
from language.model.system import System
from language.text.diagnostic import Problems, Span, suggest_name
from language.text.document import ScalarNode
from language.typecheck.function_calls import alternatives_hint
from language.typecheck.infer import TypeChecker
from language.typecheck.name_environment import NameEnvironment
from language.typecheck.types import EnumType, ExprType, IntType

RUNNING_FUNCTIONS = ("count", "first", "rms")
"""Functions over the run from its start to the present instant."""
MODES_HINT = (
    "compare it with the name of a mode, like `est.mode == drive`, or write `in(est.drive)`"
)
"""Hint for a mode signal that is used as a number."""


class ConditionReader:
    """Reader of the expressions of a test over the signals and modes of a system.

    `words` are the fault words with their instances, `kinds` the types of signals, `modes` the
    predicates by mode name, `regions` the regions by mode signal, `literals` the values of
    enumerations.
    """

    def __init__(self, problems: Problems, system: System) -> None:
        """Collect the names of the system; problems are reported to `problems`."""
        self.problems = problems
        self.system = system
        self.words = fault_words(system)
        self.kinds = signal_types(system) | dict.fromkeys(self.words, IntType(0))
        self.modes = mode_predicates(system)
        self.regions = {
            s: p for name in system.instances for s, p in mode_signals(system, name).items()
        }
        self.literals = _enumeration_literals(self.kinds)

    def read_condition(self, scalar: ScalarNode, formula: Formula) -> Condition | None:
        """Return the condition of an expression that is true or false.

        `scalar` gives its text, `formula` its syntax tree. Returns None if a problem was reported:
        an unknown name, a wrong type, or a quantity instead of a truth value.
        """
        return self._read(scalar.text, formula.tree, formula.key, truth=True)

    def _read(self, text: str, tree: SyntaxTree, key: str, truth: bool) -> Condition | None:
        """Return the condition of a resolved and typed tree; None if a problem was reported.

        `truth` states whether the expression must be true or false, or a quantity.
        """
        problem_count = len(self.problems.reported)
        resolver = _NameResolver(self)
        resolved_tree = resolver.resolve(tree)
        if len(self.problems.reported) > problem_count:
            return None
        names: dict[str, ExprType | None] = {**resolver.signals, **resolver.kinds}
        names.update({name: kind for name, (kind, _) in self.literals.items()})
        check = TypeChecker(NameEnvironment(names, location="in a test"), self.problems)
        kind = check.infer_type(resolved_tree)
        if kind is not None and truth and kind != "truth":
            label = f"`{text}` is a quantity: what is expected is the case or not"
            self.problems.error("type", tree.span, label, "compare it: `x > 0`")
        if kind == "truth" and not truth:
            label = "`rms` is of a quantity, this is true or false"
            self.problems.error("type", tree.span, label)
        if len(self.problems.reported) > problem_count:
            return None
        literals = {name: place for name, (_, place) in self.literals.items()}
        return Condition(
            Formula(resolved_tree, key),
            text,
            resolver.signals,
            resolver.mode_predicates,
            resolver.flags,
            resolver.running,
            literals,
            kind or PURE_NUMBER,
        )

    def full_name(self, name: str) -> str:
        """Return the full name of a signal, `instance.signal`.

        In a system with a single instance, a name without a dot gets its prefix if that is a
        signal. An output of the system that is a mode signal is replaced by its source. Any other
        name, known or not, is returned unchanged.
        """
        alone = self.system.sole_instance
        if alone and "." not in name and f"{alone}.{name}" in {**self.kinds, **self.regions}:
            name = f"{alone}.{name}"
        output = self.system.outputs.get(name)
        return output if isinstance(output, str) and output in self.regions else name

    def read_operand(self, text: str, tree: SyntaxTree, truth: bool) -> Condition | None:
        """Return the operand of a running statistic; None if a problem was reported.

        With `truth` it must be true or false, else a quantity. `text` is the name of the statistic.
        """
        return self._read(text, tree, "running", truth)


class _NameResolver:
    """Resolver of the names in one expression.

    Its attributes collect the signals, mode predicates, fault bits and running statistics.
    """

    def __init__(self, reader: ConditionReader) -> None:
        self.reader = reader
        self.problems = reader.problems
        self.signals: dict[str, ExprType] = {}
        self.mode_predicates: dict[str, ModePredicate] = {}
        self.flags: dict[str, FaultFlag] = {}
        self.running: dict[str, RunningStatistic] = {}
        self.kinds: dict[str, ExprType] = {}

    def resolve(self, tree: SyntaxTree) -> SyntaxTree:
        """Return the tree with modes, fault bits and running statistics replaced by names.

        Invalid parts become error nodes, with the problem reported.
        """
        match tree:
            case Relation("==" | "!=", left, right, span):
                for mode, name in ((left, right), (right, left)):
                    place = self._find_region(mode)
                    if place:
                        stay = self._resolve_mode_comparison(place, name)
                        return stay if tree.operator == "==" else Not(stay, span)
            case FunctionCall(("in" | "fault") as function, (_, _, *_), span):
                label = f"`{function}` takes 1 argument(s), not {len(tree.arguments)}"
                self._error("arguments", tree, label, alternatives_hint(function))
                return ErrorNode(span)
            case FunctionCall("in", (argument,), _):
                return self._resolve_in(tree, argument)
            case FunctionCall("fault", (argument,), span):
                return self._resolve_fault(argument, span)
            case FunctionCall(function, _, _) if function in RUNNING_FUNCTIONS:
                return self._resolve_running(tree)
            case Name():
                return self._resolve_signal(tree)
        return _map_children(tree, self.resolve)

    def _find_region(self, tree: SyntaxTree) -> RegionRef | None:
        """Return the region whose mode a name denotes; None for other trees."""
        if not isinstance(tree, Name):
            return None
        return self.reader.regions.get(self.reader.full_name(tree.path))

    def _resolve_mode_comparison(self, region_ref: RegionRef, tree: SyntaxTree) -> SyntaxTree:
        """Return the name of the predicate `region.mode == mode`.

        Return an error node if the mode is unknown.
        """
        instance, region = region_ref
        if isinstance(tree, Name):
            stay = self.reader.modes.get(f"{instance}.{path_of_mode(region, tree.path)}")
            if stay and stay.region_ref == region_ref:
                return self._add_mode_predicate(stay, tree.path, tree)
        name = tree.path if isinstance(tree, Name) else "this"
        hint = suggest_mode(name, region_ref, self.reader.system)
        self._error("name", tree, f"`{name}` is not a mode of `{format_region(region_ref)}`", hint)
        return ErrorNode(tree.span)

    def _resolve_in(self, tree: FunctionCall, argument: SyntaxTree) -> SyntaxTree:
        """Return the name of the predicate `in(mode)`; an error node if the mode is unknown."""
        path = argument.path if isinstance(argument, Name) else ""
        stay = self.reader.modes.get(path)
        if stay is None:
            label = f"`{path}` is not a mode of an instance of `{self.reader.system.name}`"
            hint = suggest_path(path, self.reader.modes)
            self._error("name", argument, label, hint)
            return ErrorNode(tree.span)
        return self._add_mode_predicate(stay, path, tree)

    def _resolve_fault(self, argument: SyntaxTree, span: Span) -> SyntaxTree:
        """Return the name of one bit of a fault word, e.g. `fault(est.range_T)`.

        The instance may be omitted if there is only one. Reports unknown faults, and fault words
        that are not outputs.
        """
        path = argument.path if isinstance(argument, Name) else ""
        system = self.reader.system
        head, _, name = path.rpartition(".")
        instance = head or system.sole_instance or ""
        bits = fault_bits(system, instance)
        if name not in bits:
            label = f"`{path}` is not a fault of an instance of `{system.name}`"
            known = [
                f"{each}.{bit}" for each in system.instances for bit in fault_bits(system, each)
            ]
            self._error("name", argument, label, suggest_path(path, [*bits, *known]))
            return ErrorNode(span)
        signal = next((word for word, of in self.reader.words.items() if of == instance), None)
        if signal is None:
            automaton = system.instances[instance].automaton.name
            label = f"the faults of `{instance}` are not an output"
            self._error(
                "missing", argument, label, f"add `faults` to the `outputs` of `{automaton}`"
            )
            return ErrorNode(span)
        made = f"fault {instance} {name}"
        self.flags[made] = FaultFlag(signal, bits[name])
        self.kinds[made] = "truth"
        return Name(made, span)

    def _add_mode_predicate(
        self, predicate: ModePredicate, mode: str, at: SyntaxTree
    ) -> SyntaxTree:
        """Store a mode predicate under a new name and return the name."""
        self._require_mode_output(predicate.region_ref, at)
        name = f"in {'.'.join(predicate.region_ref)} {mode}"
        self.mode_predicates[name] = predicate
        self.kinds[name] = "truth"
        return Name(name, at.span)

    def _require_mode_output(self, region_ref: RegionRef, at: SyntaxTree) -> None:
        """Report a chart that does not output its modes."""
        require_mode_output(self.reader.system, region_ref[0], at.span, self.problems)

    def _resolve_running(self, tree: FunctionCall) -> SyntaxTree:
        """Return the name of a running statistic; an error node if its arguments are invalid."""
        function, arguments = tree.function, tree.arguments
        most = 2 if function == "rms" else 1
        if not 1 <= len(arguments) <= most:
            label = f"`{function}` takes {most} argument(s), not {len(arguments)}"
            self._error("arguments", tree, label)
            return ErrorNode(tree.span)
        since = self._read_start_time(arguments[1]) if len(arguments) == 2 else Fraction(0)
        place = self._find_region(arguments[0])
        operand: Condition | RegionRef | None = place
        if place is not None:
            self._require_mode_output(place, tree)
        if place is None or function != "count":
            operand = self.reader.read_operand(function, arguments[0], truth=function != "rms")
        if operand is None:
            return ErrorNode(tree.span)
        name = f"{function} {len(self.running)}"
        self.running[name] = RunningStatistic(function, operand, since)  # type: ignore[arg-type]
        self.kinds[name] = IntType(0) if function == "count" else SECOND
        if function == "rms" and isinstance(operand, Condition):
            self.kinds[name] = operand.kind
        return Name(name, tree.span)

    def _read_start_time(self, tree: SyntaxTree) -> Fraction:
        """Return the start [s] of a root mean square; 0 after a report for other quantities."""
        if isinstance(tree, NumberLiteral) and (
            are_compatible(tree.unit.dimension, SECOND) or tree.is_bare_zero
        ):
            return tree.value
        self._error("number", tree, "the mean begins at a time, like `rms(x, 0.1 s)`")
        return Fraction(0)

    def _resolve_signal(self, tree: Name) -> SyntaxTree:
        """Return a name node with the full name of a signal.

        Return an error node for unknown names and for modes.
        """
        name = self.reader.full_name(tree.path)
        if name in self.reader.kinds:
            self.signals[name] = self.reader.kinds[name]
            return Name(name, tree.span)
        if name in self.reader.literals:
            return tree
        if name in self.reader.regions:
            self._error("type", tree, f"`{tree.path}` is a mode, not a number", MODES_HINT)
        else:
            label = f"`{tree.path}` is not a signal of `{self.reader.system.name}`"
            known = [*self.reader.kinds, *self.reader.regions]
            hint = suggest_output(self.reader.system, name) or suggest_name(name, known)
            self._error("name", tree, label, hint)
        return ErrorNode(tree.span)

    def _error(self, kind: str, at: SyntaxTree, label: str, help: str = "") -> None:
        """Report a problem at the place of a tree."""
        self.problems.error(kind, at.span, label, help)


def _map_children(tree: SyntaxTree, change: Callable[[SyntaxTree], SyntaxTree]) -> SyntaxTree:
    """Return a tree whose direct children are replaced by the results of a function."""
    parts: dict[str, Any] = {}
    for field in dataclasses.fields(tree):
        value = getattr(tree, field.name)
        if isinstance(value, SyntaxTree):
            parts[field.name] = change(value)
        elif field.name == "arguments":
            parts[field.name] = tuple(change(part) for part in value)
    return dataclasses.replace(tree, **parts) if parts else tree


def _enumeration_literals(kinds: dict[str, ExprType]) -> dict[str, tuple[ExprType, int]]:
    """Return type and number of each enumeration value among the types of signals."""
    found: dict[str, tuple[ExprType, int]] = {}
    for kind in kinds.values():
        if isinstance(kind, EnumType):
            found.update({value: (kind, place) for place, value in enumerate(kind.values)})
    return found
