"""Block computation: simulate the variants of a block in batches and evaluate their measures."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from engine.batch.batch import Batch, BatchResult, BatchRunner, InputTable
from language.model.system import Scenario, System
from language.text.diagnostic import SpecError
from sweep.definition.measure import Measure, columns_of
from sweep.definition.study import Study
from sweep.definition.study_reader import signals_of
from sweep.design.variant import variants_of
from sweep.design.variant_system import apply_to_scenario, apply_to_system
from sweep.design.variant_values import VariantValues, variant_values_of
from sweep.evaluation.evaluate_measures import Cell, evaluate_measures
from sweep.evaluation.observed_variant import observe_variant
from sweep.store.row import DONE, FAULT, REFUSED, STOPPED, Block, Row

INITIAL_MAX_EVENTS = 64
"""Events that a batch stores for each variant; if one has more, the batch runs again."""

MAX_VALUES = 4_000_000
"""Largest number of stored values (rows * signals * variants) of one batch: 32 MB."""

MAX_PLANS = 50
"""Largest batch if its variants have different step times, since each stores its own time events.
"""


@dataclass(frozen=True)
class _BatchGroup:
    """Variants that share a system and a scenario, except for the values of steps of inputs."""

    system: System
    scenario: Scenario
    cases: list[VariantValues]
    scenarios: list[Scenario]


def compute_rows(study: Study, block: Block, run: BatchRunner) -> list[Row]:
    """Return the rows of a block in the order of the variant numbers.

    `run` simulates a batch. Variants that share system, scenario and kinds of values form one; if
    it is refused (SpecError), each variant is simulated alone. A variant that cannot be simulated
    has the status `refused` and the reason as message, and no measures; so has one that stopped
    (`stopped`).
    """
    cases = [
        variant_values_of(study, point) for point in variants_of(study, block.start, block.stop)
    ]
    rows: dict[int, Row] = {}
    for group in _group_cases(study, cases, rows):
        for part in _split_group(study, group):
            for row in _run_group(study, part, run):
                rows[row.number] = row
    return [rows[number] for number in range(block.start, block.stop)]


def _group_cases(
    study: Study, cases: Sequence[VariantValues], rows: dict[int, Row]
) -> Iterable[_BatchGroup]:
    """Yield groups of variants that one batch can simulate.

    Variants that cannot be simulated are added to `rows` with the status `refused`.
    """
    groups: dict[object, _BatchGroup] = {}
    for case in cases:
        if case.refusal:
            rows[case.variant.number] = _make_row(study, case, REFUSED, case.refusal)
            continue
        kind = study.system_variants[case.variant.system_variant]
        course = kind.scenario_bindings[study.scenarios[case.variant.scenario]]
        try:
            scenario = apply_to_scenario(course, kind.system, case.structural_values)
        except SpecError as error:
            rows[case.variant.number] = _make_row(study, case, REFUSED, error.problems[0].label)
            continue
        other = tuple((t, v) for t, v in case.structural_values if t.kind != "input")
        swept = tuple(t for t in case.values if t.kind in ("parameter", "initial"))
        key = (
            case.variant.system_variant,
            case.variant.scenario,
            other,
            swept,
            _formula_signature(scenario),
        )
        if key not in groups:
            groups[key] = _BatchGroup(apply_to_system(kind.system, other), scenario, [], [])
        groups[key].cases.append(case)
        groups[key].scenarios.append(scenario)
    yield from groups.values()


def _formula_signature(scenario: Scenario) -> object:
    """Return a key that is equal for scenarios whose inputs have the same formulas of time.

    Formulas are compiled, hence the same in a batch; steps and lines between points are data.
    """
    return repr(
        [
            (name, [(k, piece.formula) for k, piece in enumerate(stimulus.pieces) if piece.formula])
            for name, stimulus in scenario.inputs.items()
            if stimulus.varies
        ]
    )


def _split_group(study: Study, group: _BatchGroup) -> Iterable[_BatchGroup]:
    """Yield parts of a group whose stored values do not exceed the memory limits."""
    every = group.scenario.every
    rows = int((group.scenario.horizon or 0) / every) + 1
    each = max(1, rows * len(signals_of(study.measures)))
    size = max(1, MAX_VALUES // each)
    if not _share_step_times(group):
        size = min(size, MAX_PLANS)
    for first in range(0, len(group.cases), size):
        last = first + size
        yield dataclasses.replace(
            group, cases=group.cases[first:last], scenarios=group.scenarios[first:last]
        )


def _run_group(study: Study, group: _BatchGroup, run: BatchRunner) -> list[Row]:
    """Return the rows of a group; if its batch is refused, simulate each variant separately."""
    batch = _build_batch(study, group)
    try:
        result = run(batch)
        if result.event_counts.max(initial=0) > batch.max_events:
            most = int(result.event_counts.max())
            result = run(dataclasses.replace(batch, max_events=most))
    except SpecError as error:
        if len(group.cases) == 1:
            return [_make_row(study, group.cases[0], REFUSED, error.problems[0].label)]
        alone = [
            dataclasses.replace(group, cases=[case], scenarios=[scenario])
            for case, scenario in zip(group.cases, group.scenarios, strict=True)
        ]
        return [row for each in alone for row in _run_group(study, each, run)]
    return [_row_of_result(study, group, result, place) for place in range(len(group.cases))]


def _build_batch(study: Study, group: _BatchGroup) -> Batch:
    """Return the batch of a group with arrays of parameters, initial values, inputs and seeds."""
    cases, signals = group.cases, signals_of(study.measures)
    shared = [t for t in cases[0].values if t.kind in ("parameter", "initial")]
    arrays = {
        target: np.array([case.values[target] for case in cases], dtype=np.float64)
        for target in shared
    }
    kept = signals or group.system.signals[:1]
    together = _share_step_times(group)
    return Batch(
        system=group.system,
        scenario=dataclasses.replace(group.scenario, signals=kept),
        count=len(cases),
        parameters={".".join(t.path): a for t, a in arrays.items() if t.kind == "parameter"},
        initial={".".join(t.path): a for t, a in arrays.items() if t.kind == "initial"},
        inputs=_build_input_tables(group) if together else {},
        variant_inputs=() if together else tuple(scenario.inputs for scenario in group.scenarios),
        seeds=np.array([case.seed for case in cases], dtype=np.int64),
        outputs=signals,
        max_events=INITIAL_MAX_EVENTS,
    )


def _build_input_tables(group: _BatchGroup) -> dict[str, InputTable]:
    """Return the inputs whose values differ between the variants, with arrays (n_variants,
    n_pieces).
    """
    found = {}
    for name, stimulus in group.scenario.inputs.items():
        pieces = [scenario.inputs[name].pieces for scenario in group.scenarios]
        if any(each != pieces[0] for each in pieces):
            starts = tuple(piece.start for piece in stimulus.pieces)
            values = np.array([[float(piece.value) for piece in each] for each in pieces])
            found[name] = InputTable(starts, values)
    return found


def _share_step_times(group: _BatchGroup) -> bool:
    """Return whether the inputs of all variants step at the same times and vary equally in
    between.
    """
    return all(
        [piece.start for piece in scenario.inputs[name].pieces]
        == [piece.start for piece in stimulus.pieces]
        and (scenario.inputs[name] == stimulus or not stimulus.varies)
        for scenario in group.scenarios
        for name, stimulus in group.scenario.inputs.items()
    )


def _row_of_result(study: Study, group: _BatchGroup, result: BatchResult, place: int) -> Row:
    """Return the row of the variant at a place of a batch: stopped, with a fault, or done."""
    case = group.cases[place]
    if place in result.stopped:
        return _make_row(study, case, STOPPED, result.stopped[place])
    horizon = group.scenario.horizon
    assert horizon is not None
    found = evaluate_measures(study.measures, observe_variant(result, place, float(horizon)))
    if place in result.faults:
        bits = ", ".join(f"`{fault}`" for fault in result.faults[place])
        return _make_row(study, case, FAULT, f"a fault bit is set: {bits}", found)
    return _make_row(study, case, DONE, "", found)


def _make_row(
    study: Study,
    case: VariantValues,
    status: str,
    message: str,
    measures: Mapping[str, Cell] | None = None,
) -> Row:
    """Return a row of the store; without measures all its cells are None."""
    point = case.variant
    return Row(
        number=point.number,
        variant=study.system_variants[point.system_variant].name,
        scenario=study.scenarios[point.scenario],
        sample=point.sample,
        replicate=point.replicate,
        seed=case.seed,
        values=point.values,
        status=status,
        message=message,
        measures=measures if measures is not None else _empty_measures(study.measures),
    )


def _empty_measures(measures: Sequence[Measure]) -> dict[str, Cell]:
    """Return None for each column of the measures."""
    return {column.name: None for measure in measures for column in columns_of(measure)}
