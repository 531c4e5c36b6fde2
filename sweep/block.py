"""Block: the variants from one number to before another, simulated and measured."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from engine.batch import Batch, BatchResult, InputTable, Runner
from language.experiment import Scenario, System
from language.problem import SpecError
from sweep.case import Case, case_of
from sweep.measure import Measure, columns_of
from sweep.measuring import Cell, measured
from sweep.observation import observed
from sweep.point import points_of
from sweep.structure import stimulated, structured
from sweep.study import Study
from sweep.study_reader import signals_of

MOST_EVENTS = 64
"""Events that are kept of a variant at first; one with more is run again."""
MOST_VALUES = 4_000_000
"""Rows times signals times variants of one batch: 32 MB."""
MOST_PLANS = 50
"""Variants of one batch whose inputs step at times of their own: each has all its instants."""

DONE, FAULT, STOPPED, REFUSED = "done", "fault", "stopped", "refused"
"""What became of a variant: fine; a fault bit is set; the run stopped; it cannot be simulated."""


@dataclass(frozen=True)
class Row:
    """One variant: its place in the study, what varies, what became of it, its measures."""

    number: int
    variant: str
    scenario: str
    sample: int
    replicate: int
    seed: int
    values: Mapping[str, float]
    status: str
    message: str
    measures: Mapping[str, Cell]


@dataclass(frozen=True)
class Block:
    """The variants from `start` to before `stop`."""

    start: int
    stop: int


@dataclass(frozen=True)
class _Group:
    """Cases that share a system and, but for values of steps, a scenario."""

    system: System
    scenario: Scenario
    cases: list[Case]
    steps: list[Scenario]


def block_rows(study: Study, block: Block, run: Runner) -> list[Row]:
    """Return the rows of a block in the order of their numbers."""
    cases = [case_of(study, point) for point in points_of(study, block.start, block.stop)]
    rows: dict[int, Row] = {}
    for group in _groups(study, cases, rows):
        for part in _parts(study, group):
            for row in _group_rows(study, part, run):
                rows[row.number] = row
    return [rows[number] for number in range(block.start, block.stop)]


def _groups(study: Study, cases: Sequence[Case], rows: dict[int, Row]) -> Iterable[_Group]:
    """Yield the cases by what they share; one that is refused has its row at once."""
    found: dict[object, _Group] = {}
    for case in cases:
        if case.refused:
            rows[case.point.number] = _row(study, case, REFUSED, case.refused)
            continue
        kind = study.kinds[case.point.kind]
        course = kind.courses[study.scenarios[case.point.scenario]]
        try:
            scenario = stimulated(course, kind.system, case.structure)
        except SpecError as error:
            rows[case.point.number] = _row(study, case, REFUSED, error.problems[0].label)
            continue
        other = tuple((t, v) for t, v in case.structure if t.kind != "input")
        swept = tuple(t for t in case.values if t.kind in ("parameter", "initial"))
        key = (case.point.kind, case.point.scenario, other, swept, _shape(scenario))
        if key not in found:
            found[key] = _Group(structured(kind.system, other), scenario, [], [])
        found[key].cases.append(case)
        found[key].steps.append(scenario)
    yield from found.values()


def _shape(scenario: Scenario) -> object:
    """Return what scenarios of one batch have in common: the formulas of inputs in time.

    Lines between points are numbers of a plan, as steps are; a formula is compiled.
    """
    return repr(
        [
            (name, [(k, piece.formula) for k, piece in enumerate(stimulus.pieces) if piece.formula])
            for name, stimulus in scenario.inputs.items()
            if stimulus.varies
        ]
    )


def _parts(study: Study, group: _Group) -> Iterable[_Group]:
    """Yield a group in parts whose recorded rows fit into memory."""
    every = group.scenario.every
    rows = int((group.scenario.horizon or 0) / every) + 1
    each = max(1, rows * len(signals_of(study.measures)))
    size = max(1, MOST_VALUES // each)
    if not _step_together(group):
        size = min(size, MOST_PLANS)
    for first in range(0, len(group.cases), size):
        last = first + size
        yield dataclasses.replace(
            group, cases=group.cases[first:last], steps=group.steps[first:last]
        )


def _group_rows(study: Study, group: _Group, run: Runner) -> list[Row]:
    """Return the rows of a group; where its batch is refused, of each of its cases alone."""
    batch = _batch(study, group)
    try:
        result = run(batch)
        if result.event_counts.max(initial=0) > batch.most_events:
            most = int(result.event_counts.max())
            result = run(dataclasses.replace(batch, most_events=most))
    except SpecError as error:
        if len(group.cases) == 1:
            return [_row(study, group.cases[0], REFUSED, error.problems[0].label)]
        alone = [
            dataclasses.replace(group, cases=[case], steps=[scenario])
            for case, scenario in zip(group.cases, group.steps, strict=True)
        ]
        return [row for each in alone for row in _group_rows(study, each, run)]
    return [_result_row(study, group, result, place) for place in range(len(group.cases))]


def _batch(study: Study, group: _Group) -> Batch:
    cases, signals = group.cases, signals_of(study.measures)
    shared = [t for t in cases[0].values if t.kind in ("parameter", "initial")]
    arrays = {
        target: np.array([case.values[target] for case in cases], dtype=np.float64)
        for target in shared
    }
    kept = signals or group.system.signals[:1]
    together = _step_together(group)
    return Batch(
        system=group.system,
        scenario=dataclasses.replace(group.scenario, signals=kept),
        count=len(cases),
        parameters={".".join(t.path): a for t, a in arrays.items() if t.kind == "parameter"},
        initial={".".join(t.path): a for t, a in arrays.items() if t.kind == "initial"},
        inputs=_tables(group) if together else {},
        courses=() if together else tuple(scenario.inputs for scenario in group.steps),
        seeds=np.array([case.seed for case in cases], dtype=np.int64),
        outputs=signals,
        most_events=MOST_EVENTS,
    )


def _tables(group: _Group) -> dict[str, InputTable]:
    """Return the inputs whose steps have other values in some cases."""
    found = {}
    for name, stimulus in group.scenario.inputs.items():
        pieces = [scenario.inputs[name].pieces for scenario in group.steps]
        if any(each != pieces[0] for each in pieces):
            starts = tuple(piece.start for piece in stimulus.pieces)
            values = np.array([[_real(piece.value) for piece in each] for each in pieces])
            found[name] = InputTable(starts, values)
    return found


def _step_together(group: _Group) -> bool:
    """Tell whether the inputs of all cases step at the same times, and vary alike in between."""
    return all(
        [piece.start for piece in scenario.inputs[name].pieces]
        == [piece.start for piece in stimulus.pieces]
        and (scenario.inputs[name] == stimulus or not stimulus.varies)
        for scenario in group.steps
        for name, stimulus in group.scenario.inputs.items()
    )


def _real(value: Fraction) -> float:
    return value.numerator / value.denominator


def _result_row(study: Study, group: _Group, result: BatchResult, place: int) -> Row:
    case = group.cases[place]
    if place in result.stopped:
        return _row(study, case, STOPPED, result.stopped[place])
    horizon = group.scenario.horizon
    assert horizon is not None
    found = measured(study.measures, observed(result, place, float(horizon)))
    if place in result.faults:
        bits = ", ".join(f"`{fault}`" for fault in result.faults[place])
        return _row(study, case, FAULT, f"a fault bit is set: {bits}", found)
    return _row(study, case, DONE, "", found)


def _row(
    study: Study, case: Case, status: str, message: str, found: Mapping[str, Cell] | None = None
) -> Row:
    point = case.point
    return Row(
        number=point.number,
        variant=study.kinds[point.kind].name,
        scenario=study.scenarios[point.scenario],
        sample=point.sample,
        replicate=point.replicate,
        seed=case.seed,
        values=point.values,
        status=status,
        message=message,
        measures=found if found is not None else _nothing(study.measures),
    )


def _nothing(measures: Sequence[Measure]) -> dict[str, Cell]:
    return {column.name: None for measure in measures for column in columns_of(measure)}
