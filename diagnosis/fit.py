"""Fit: parameters of an automaton from recordings, and how well these determine them.

What each recording has of its own - where states start, slow disturbances - is taken up by the
observer that foresees it from sample to sample, not by the parameters.
"""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from diagnosis.case import Case, case_bench, read_series
from diagnosis.dossier import hashes
from diagnosis.estimate import Estimate, looked_at
from diagnosis.naming import correlations_of, quantities_of
from diagnosis.point import point_of
from diagnosis.search import Tell
from diagnosis.series import compared
from diagnosis.simulation import misfits
from diagnosis.uncertain import Uncertain
from diagnosis.variant import value_text
from diagnosis.verdict import Misfit, Quantity
from diagnosis.ways import better_way, ways_of
from language.document import Document, Table
from language.load import automaton_of
from language.model import Automaton
from language.problem import Problems, Source, Span, nearest
from language.tree import put

AT_THE_END = 1e-3
"""Part of its range from an end within which a parameter is at it."""
UNDETERMINED = 0.8
"""Part of the prior's standard deviation that is left where data say next to nothing."""
STRONG = 0.9
"""Correlation from which two parameters are hardly told apart."""


@dataclass(frozen=True)
class Fitted:
    """A fitted parameter: what was declared, its value [SI], and how far data determine it.

    `left` is its standard deviation as a part of its prior's: 1 where data say nothing. `strongest`
    is the parameter that it is correlated with most, with the correlation.
    """

    name: str
    declared: float
    quantity: Quantity
    left: float
    note: str
    strongest: tuple[str, float] | None = None


@dataclass(frozen=True)
class Fit:
    """Parameters fitted to recordings; `misfits` of free simulation, as declared and as fitted.

    `correlations` are those of pairs, the strongest first; `inputs` are hashes of the files.
    """

    automaton: Automaton
    parameters: tuple[Fitted, ...]
    correlations: Mapping[tuple[str, str], float]
    misfits: Mapping[str, Misfit]
    inputs: Mapping[str, str]
    estimate: Estimate = field(repr=False)

    @property
    def undetermined(self) -> tuple[str, ...]:
        """The parameters of which these data say next to nothing."""
        return tuple(one.name for one in self.parameters if not one.left <= UNDETERMINED)

    def calibration(self, name: str, date: str = "") -> str:
        """Return the fit as a calibration file, values in SI."""
        lines = ["language: 1", f"calibration: {name}", f"of: {self.automaton.name}"]
        lines.append(f"from: {json.dumps(', '.join(self.inputs), ensure_ascii=False)}")
        lines += [f"date: {date}"] if date else []
        lines.append("parameters:")
        for one in self.parameters:
            value = value_text(one.quantity.value, self.automaton.parameters[one.name])
            unit = "" if one.quantity.unit == "1" else f" {one.quantity.unit}"
            note = f"  # {one.note}" if one.note else ""
            std = f", std: {one.quantity.std:.3g}{unit}" if math.isfinite(one.quantity.std) else ""
            text = f"{{value: {value}{std}}}"
            lines.append(f"  {one.name}: {text}{note}")
        return "\n".join(lines) + "\n"


def fit(case: Case, parameters: Sequence[str] | None = None, tell: Tell = lambda text: None) -> Fit:
    """Return a case's parameters (all that have a range, or those named) fitted to its recordings.

    Raises SpecError, ValueError, ToolMissing.
    """
    automaton = automaton_of(case.document, case.project)
    if parameters is not None:
        document = only(case.document, automaton, parameters)
        case = dataclasses.replace(case, document=document)
        automaton = automaton_of(document, case.project)
    seen = compared(case.mapping, automaton)
    if not seen:
        raise ValueError(f"map `{case.mapping.name}` compares no output of `{automaton.name}`")
    case = dataclasses.replace(case, effects=())
    series = [one for path in case.train for one in read_series(path, case, automaton, seen)]
    bench, found = better_way(ways_of(case_bench(case, automaton, series, seen), tell))
    if not found.candidate.uncertain:
        raise ValueError(f"no parameter of `{automaton.name}` has a `range` to be fitted in")
    start = point_of(found.candidate, len(bench.series), {})
    declared = looked_at(found.candidate, bench.series, found.noises, start)
    return Fit(
        automaton,
        _fitted(automaton, found),
        correlations_of(found),
        misfits(declared, found, bench.series),
        hashes(case, case.train),
        found,
    )


def only(document: Document, automaton: Automaton, names: Sequence[str]) -> Document:
    """Return an expanded document in which no other parameters have a range. Raises SpecError."""
    problems = Problems()
    for name in names:
        parameter = automaton.parameters.get(name)
        if parameter is None:
            label = f"`{automaton.name}` has no parameter `{name}`"
            hint = nearest(name, automaton.parameters)
            asked = Source("command line", (name,))
            problems.error("name", Span(asked, 1, 1, max(1, len(name))), label, hint)
        elif parameter.range is None or parameter.value is None:
            label = f"`{name}` has no range to be fitted in"
            problems.error("range", parameter.span, label, "`range: [low, high]` beside its value")
    problems.stop_if_any()
    root = document.root
    for name in automaton.parameters:
        table = _parameter(root, name)
        if name not in names and table is not None and "range" in table.entries:
            rest = {key: entry for key, entry in table.entries.items() if key != "range"}
            root = put(root, ("parameters", name), Table(rest, table.span))
    return dataclasses.replace(document, root=root)


def _parameter(root: Table, name: str) -> Table | None:
    section = root.get("parameters")
    node = section.get(name) if isinstance(section, Table) else None
    return node if isinstance(node, Table) else None


def _fitted(automaton: Automaton, found: Estimate) -> tuple[Fitted, ...]:
    strongest: dict[str, tuple[str, float]] = {}
    for (first, second), together in correlations_of(found).items():
        strongest.setdefault(first, (second, together))
        strongest.setdefault(second, (first, together))
    coordinates = {one.name: one for one in found.candidate.uncertain}
    fitted = []
    for name, quantity in quantities_of(found).items():
        value = automaton.parameters[name].value
        assert value is not None
        one = coordinates[name]
        left, note = spread_of(quantity, one), note_of(quantity, one)
        fitted.append(Fitted(name, float(value), quantity, left, note, strongest.get(name)))
    return tuple(fitted)


def note_of(now: Quantity, coordinate: Uncertain) -> str:
    """Return what is to be said of a fitted parameter; empty where there is nothing."""
    width = AT_THE_END * (coordinate.high - coordinate.low)
    if min(now.value - coordinate.low, coordinate.high - now.value) < width:
        return "at the end of its range"
    if not spread_of(now, coordinate) <= UNDETERMINED:
        return "these data do not determine it"
    return ""


def spread_of(now: Quantity, coordinate: Uncertain) -> float:
    """Return the standard deviation of a fitted parameter as a part of its prior's."""
    slope = coordinate.sd * (now.value if coordinate.is_log else 1.0)
    return now.std / abs(slope) if slope else 1.0
