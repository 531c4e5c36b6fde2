"""Recording map proposal: the columns of a file for the signals of an automaton.

Each pair of a column and a signal has a score (`score_column`). The assignment with the largest sum
of scores is proposed; a person corrects it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from diagnosis.data_quality.column_score import (
    EXCLUDED,
    ModelSignal,
    ProposedColumn,
    score_column,
)
from diagnosis.data_quality.file_columns import FileColumn, read_file_columns
from diagnosis.data_quality.recording_map_inference import distinct_names
from diagnosis.data_quality.signal_words import read_meaning
from engine.recordings.recording_file import RecordedFile
from language.expressions.syntax_tree import NumberLiteral
from language.model.automaton import Automaton
from language.model.declaration import State

MIN_SCORE = {"input": -1.0, "optional": 4.0, "output": 3.0}
"""Smallest score with which a column is proposed for a signal: an input without and with a default
value, and an output. A continuous automaton has its best output if none reaches the score."""

NEED = 10.0
"""Addition to the score of a signal that the map needs."""

MAX_LEVELS = 4096
"""Largest number of levels of a held signal, those of a word of 12 bits."""

STEP_QUANTILE = 0.1
"""Quantile of the distances of neighbouring levels that is taken as the step of a signal."""


@dataclass(frozen=True)
class MapProposal:
    """The proposed lines of a map; columns and signals without a counterpart are listed."""

    columns: tuple[ProposedColumn, ...]
    unused_columns: tuple[str, ...]
    missing_inputs: tuple[ModelSignal, ...]
    missing_outputs: tuple[ModelSignal, ...]


def propose_columns(file: RecordedFile, automaton: Automaton, time: str) -> MapProposal:
    """Return the columns of a file for the inputs and outputs of an automaton.

    `time` is the time column of all rows, or empty. Columns that look like sensors of one quantity
    are also considered as their mean, and a time column of single channels is assigned to the
    columns that have its blank cells.
    """
    signals = _signals_of(automaton)
    columns = read_file_columns(file, time)
    chosen = [_choose_hold(one, automaton) for one in _assign(columns, signals, automaton)]
    used = {name for one in chosen for name in (*one.column.names, one.column.time)}
    found = {one.signal.name for one in chosen}
    missing = [signal for signal in signals if signal.name not in found]
    return MapProposal(
        tuple(chosen),
        tuple(name for name in distinct_names(file, time) if name not in used),
        tuple(s for s in missing if s.is_input),
        tuple(s for s in missing if not s.is_input),
    )


def _choose_hold(line: ProposedColumn, automaton: Automaton) -> ProposedColumn:
    """Return a line whose input is interpolated if its values are those of a continuous quantity.

    An input of a sampled automaton is held, and so is one with the few levels of a bus signal.
    """
    if not line.signal.is_input or automaton.is_sampled or line.signal.type != "real":
        return line
    levels = np.unique(line.column.values[np.isfinite(line.column.values)])
    if len(levels) < 2:
        return line
    step = float(np.quantile(np.diff(levels), STEP_QUANTILE))
    return replace(line, hold="linear") if np.ptp(levels) > MAX_LEVELS * step else line


def _signals_of(automaton: Automaton) -> list[ModelSignal]:
    """Return the inputs and the outputs of an automaton that are quantities; modes are left out."""
    firsts: dict[str, float] = {}
    for name, state in {**automaton.states, **automaton.discrete}.items():
        tree = state.initial.tree
        if isinstance(tree, NumberLiteral):
            firsts[name] = float(tree.value * tree.unit.factor + tree.unit.offset)
    signals = [
        ModelSignal(
            name, True, item.default is not None, item.unit.dimension, item.unit.text, item.type,
            item.range, None, read_meaning(name), item.values,
        )
        for name, item in automaton.inputs.items()
    ]  # fmt: skip
    variables: dict[str, State] = {**automaton.discrete, **automaton.states}
    for name in automaton.outputs:
        source = automaton.output_source(name)
        dimension = automaton.dimensions.get(source)
        if dimension is None:
            continue
        variable = variables.get(source)
        unit = dimension.display_name if variable is None else variable.unit.text
        range = None if variable is None else variable.range
        meaning = read_meaning(name)
        first = firsts.get(source)
        signals.append(
            ModelSignal(name, False, False, dimension, unit, "real", range, first, meaning)
        )
    return signals


def _assign(
    columns: Sequence[FileColumn], signals: Sequence[ModelSignal], automaton: Automaton
) -> list[ProposedColumn]:
    """Return the assignment with the largest sum of scores, in the order of the signals.

    No column is used twice, neither alone nor in a mean.
    """
    if not columns or not signals:
        return []
    context = frozenset().union(*(signal.meaning.places for signal in signals))
    pairs = [
        [score_column(column, signal, automaton, context) for column in columns]
        for signal in signals
    ]
    scores = np.full((len(signals), len(columns)), EXCLUDED)
    for i, row in enumerate(pairs):
        for j, pair in enumerate(row):
            if pair is not None:
                order = j * (2e-3 if signals[i].is_input else 1e-3)
                scores[i, j] = pair.score - order
    limits = np.array([MIN_SCORE[signal.kind] for signal in signals])
    chosen = _solve(scores, limits, columns)
    if not automaton.is_sampled and all(signals[i].is_input for i in chosen):
        limits = np.where([signal.is_input for signal in signals], limits, EXCLUDED / 2)
        outputs = [i for i in _solve(scores, limits, columns) if not signals[i].is_input]
        if outputs:
            best = max(outputs, key=lambda i: scores[i].max())
            others = [i for i, s in enumerate(signals) if not s.is_input and i != best]
            scores[others] = EXCLUDED
            chosen = _solve(scores, limits, columns)
    return [pair for i, j in sorted(chosen.items()) if (pair := pairs[i][j]) is not None]


def _solve(
    scores: NDArray[np.float64], limits: NDArray[np.float64], columns: Sequence[FileColumn]
) -> dict[int, int]:
    """Return the columns by signal, with the largest sum of scores above the limits.

    `scores` (n_signals, n_columns), `limits` (n_signals,). If a column is used alone and in a mean,
    the use with the smaller score is forbidden and the search repeated.
    """
    scores = scores.copy()
    while True:
        free = np.zeros((len(limits), len(limits)))  # a signal may stay without a column
        is_needed = limits[:, None] <= 0.0
        surplus = scores - np.maximum(limits, 0.0)[:, None]
        gains = np.where(scores >= limits[:, None], surplus + NEED * is_needed, EXCLUDED)
        rows, found = linear_sum_assignment(np.hstack([gains, free]), maximize=True)
        chosen = {
            int(i): int(j)
            for i, j in zip(rows, found, strict=True)
            if j < len(columns) and scores[i, j] >= limits[i]
        }
        clash = next(
            (
                (i, k)
                for i, j in chosen.items()
                for k, m in chosen.items()
                if i < k and set(columns[j].names) & set(columns[m].names)
            ),
            None,
        )
        if clash is None:
            return chosen
        weaker = min(clash, key=lambda i: scores[i, chosen[i]])
        scores[weaker, chosen[weaker]] = EXCLUDED
