"""Condition: an expression of a test, its modes and running numbers found and checked."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from fractions import Fraction
from typing import Any

from expectation.expected import Condition, Flag, Place, Running, Stay
from expectation.places import (
    fault_bits,
    fault_words,
    mode_signals,
    nearest_mode,
    nearest_path,
    path_of,
    require_mode_output,
    said,
    stays,
    unknown_output,
)
from language.declaration import Formula
from language.dimension import DimensionCheck
from language.document import Scalar
from language.experiment import System
from language.kind import Enumeration, Kind, Whole
from language.problem import Problems, nearest
from language.scope import Scope
from language.signal_kind import signal_kinds
from language.syntax import Application, Broken, Name, Not, Number, Relation, Tree
from language.units import NUMBER, SECOND, fits

RUNNING = ("count", "first", "rms")
MODES_HINT = (
    "compare it with the name of a mode, like `est.mode == drive`, or write `in(est.drive)`"
)


class ConditionReader:
    """Reads the expressions of a test over the signals and modes of a system."""

    def __init__(self, problems: Problems, system: System) -> None:
        """Report into `problems`."""
        self.problems = problems
        self.system = system
        self.words = fault_words(system)
        self.kinds = signal_kinds(system) | dict.fromkeys(self.words, Whole(0))
        self.modes = stays(system)
        self.regions = {
            s: p for name in system.instances for s, p in mode_signals(system, name).items()
        }
        self.literals = _literals(self.kinds)

    def condition(self, scalar: Scalar, formula: Formula) -> Condition | None:
        """Return a condition; None with the problem reported."""
        return self._read(scalar.text, formula.tree, formula.key, truth=True)

    def _read(self, text: str, tree: Tree, key: str, truth: bool) -> Condition | None:
        told = len(self.problems.found)
        found = _Found(self)
        made = found.resolved(tree)
        if len(self.problems.found) > told:
            return None
        names: dict[str, Kind | None] = {**found.signals, **found.kinds}
        names.update({name: kind for name, (kind, _) in self.literals.items()})
        check = DimensionCheck(Scope(names, place="in a test"), self.problems)
        kind = check.kind(made)
        if kind is not None and truth and kind != "truth":
            label = f"`{text}` is a quantity: what is expected is the case or not"
            self.problems.error("type", tree.span, label, "compare it: `x > 0`")
        if kind == "truth" and not truth:
            label = "`rms` is of a quantity, this is true or false"
            self.problems.error("type", tree.span, label)
        if len(self.problems.found) > told:
            return None
        literals = {name: place for name, (_, place) in self.literals.items()}
        return Condition(
            Formula(made, key), text, found.signals, found.stays, found.flags, found.running,
            literals, kind or NUMBER,
        )  # fmt: skip

    def full(self, name: str) -> str:
        """Return a signal's whole name: in a test of an automaton it stands alone."""
        alone = self.system.alone
        if alone and "." not in name and f"{alone}.{name}" in {**self.kinds, **self.regions}:
            name = f"{alone}.{name}"
        output = self.system.outputs.get(name)
        return output if isinstance(output, str) and output in self.regions else name

    def inner(self, text: str, tree: Tree, truth: bool) -> Condition | None:
        """Return what a running number reads; None with the problem reported."""
        return self._read(text, tree, "running", truth)


class _Found:
    """What one expression reads, found on the way through it."""

    def __init__(self, reader: ConditionReader) -> None:
        self.reader = reader
        self.problems = reader.problems
        self.signals: dict[str, Kind] = {}
        self.stays: dict[str, Stay] = {}
        self.flags: dict[str, Flag] = {}
        self.running: dict[str, Running] = {}
        self.kinds: dict[str, Kind] = {}

    def resolved(self, tree: Tree) -> Tree:
        """Return a tree in which modes and running numbers are names."""
        match tree:
            case Relation("==" | "!=", left, right, span):
                for mode, name in ((left, right), (right, left)):
                    place = self._region(mode)
                    if place:
                        stay = self._compared(place, name)
                        return stay if tree.operator == "==" else Not(stay, span)
            case Application("in", arguments, _):
                return self._in(tree, arguments)
            case Application("fault", arguments, _):
                return self._fault(tree, arguments)
            case Application(function, _, _) if function in RUNNING:
                return self._running(tree)
            case Name():
                return self._signal(tree)
        return _rebuilt(tree, self.resolved)

    def _region(self, tree: Tree) -> Place | None:
        if not isinstance(tree, Name):
            return None
        return self.reader.regions.get(self.reader.full(tree.path))

    def _compared(self, place: Place, tree: Tree) -> Tree:
        instance, region = place
        if isinstance(tree, Name):
            stay = self.reader.modes.get(f"{instance}.{path_of(region, tree.path)}")
            if stay and stay.place == place:
                return self._stay(stay, tree.path, tree)
        name = tree.path if isinstance(tree, Name) else "this"
        hint = nearest_mode(name, place, self.reader.system)
        self._error("name", tree, f"`{name}` is not a mode of `{said(place)}`", hint)
        return Broken(tree.span)

    def _in(self, tree: Application, arguments: tuple[Tree, ...]) -> Tree:
        path = arguments[0].path if len(arguments) == 1 and isinstance(arguments[0], Name) else ""
        stay = self.reader.modes.get(path)
        if stay is None:
            label = f"`{path}` is not a mode of an instance of `{self.reader.system.name}`"
            hint = nearest_path(path, self.reader.modes)
            self._error("name", arguments[0] if arguments else tree, label, hint)
            return Broken(tree.span)
        return self._stay(stay, path, tree)

    def _fault(self, tree: Application, arguments: tuple[Tree, ...]) -> Tree:
        """Return one bit of a fault word: `fault(est.range_T)`, in a test of one alone without."""
        path = arguments[0].path if len(arguments) == 1 and isinstance(arguments[0], Name) else ""
        system = self.reader.system
        head, _, name = path.rpartition(".")
        instance = head or system.alone or ""
        bits = fault_bits(system, instance)
        at = arguments[0] if arguments else tree
        if name not in bits:
            label = f"`{path}` is not a fault of an instance of `{system.name}`"
            known = [
                f"{each}.{bit}" for each in system.instances for bit in fault_bits(system, each)
            ]
            self._error("name", at, label, nearest_path(path, [*bits, *known]))
            return Broken(tree.span)
        signal = next((word for word, of in self.reader.words.items() if of == instance), None)
        if signal is None:
            automaton = system.instances[instance].automaton.name
            label = f"the faults of `{instance}` are not told"
            self._error("missing", at, label, f"add `faults` to the `outputs` of `{automaton}`")
            return Broken(tree.span)
        made = f"fault {instance} {name}"
        self.flags[made] = Flag(signal, bits[name])
        self.kinds[made] = "truth"
        return Name(made, tree.span)

    def _stay(self, stay: Stay, mode: str, at: Tree) -> Tree:
        self._require_modes(stay.place, at)
        name = f"in {'.'.join(stay.place)} {mode}"
        self.stays[name] = stay
        self.kinds[name] = "truth"
        return Name(name, at.span)

    def _require_modes(self, place: Place, at: Tree) -> None:
        require_mode_output(self.reader.system, place[0], at.span, self.problems)

    def _running(self, tree: Application) -> Tree:
        function, arguments = tree.function, tree.arguments
        most = 2 if function == "rms" else 1
        if not 1 <= len(arguments) <= most:
            label = f"`{function}` takes {most} argument(s), not {len(arguments)}"
            self._error("arguments", tree, label)
            return Broken(tree.span)
        since = self._since(arguments[1]) if len(arguments) == 2 else Fraction(0)
        place = self._region(arguments[0])
        of: Condition | Place | None = place
        if place is not None:
            self._require_modes(place, tree)
        if place is None or function != "count":
            of = self.reader.inner(function, arguments[0], truth=function != "rms")
        if of is None:
            return Broken(tree.span)
        name = f"{function} {len(self.running)}"
        self.running[name] = Running(function, of, since)  # type: ignore[arg-type]
        self.kinds[name] = Whole(0) if function == "count" else SECOND
        if function == "rms" and isinstance(of, Condition):
            self.kinds[name] = of.kind
        return Name(name, tree.span)

    def _since(self, tree: Tree) -> Fraction:
        if isinstance(tree, Number) and (fits(tree.unit.dimension, SECOND) or tree.is_bare_zero):
            return tree.value
        self._error("number", tree, "the mean begins at a time, like `rms(x, 0.1 s)`")
        return Fraction(0)

    def _signal(self, tree: Name) -> Tree:
        name = self.reader.full(tree.path)
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
            hint = unknown_output(self.reader.system, name) or nearest(name, known)
            self._error("name", tree, label, hint)
        return Broken(tree.span)

    def _error(self, kind: str, at: Tree, label: str, help: str = "") -> None:
        self.problems.error(kind, at.span, label, help)


def _rebuilt(tree: Tree, change: Callable[[Tree], Tree]) -> Tree:
    """Return a tree whose parts are changed."""
    parts: dict[str, Any] = {}
    for field in dataclasses.fields(tree):
        value = getattr(tree, field.name)
        if isinstance(value, Tree):
            parts[field.name] = change(value)
        elif field.name == "arguments":
            parts[field.name] = tuple(change(part) for part in value)
    return dataclasses.replace(tree, **parts) if parts else tree


def _literals(kinds: dict[str, Kind]) -> dict[str, tuple[Kind, int]]:
    """Return the names of enumerations with their kind and number."""
    found: dict[str, tuple[Kind, int]] = {}
    for kind in kinds.values():
        if isinstance(kind, Enumeration):
            found.update({value: (kind, place) for place, value in enumerate(kind.values)})
    return found
