"""Observer reader: Kalman filters and model runs, which carry states over a tick."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING

from language.model.automaton import Automaton, ModelRun, Observer
from language.model.declaration import Formula
from language.text.diagnostic import Span, suggest_name
from language.text.document import Entry, MappingNode, YamlNode

if TYPE_CHECKING:
    from language.readers.base_reader import Reader

MATRIX_KEYS = ("inputs", "A", "B", "C", "f")
OBSERVER_KEYS = (
    "kalman",
    "of",
    "at",
    *MATRIX_KEYS,
    "measures",
    "predict",
    "correct",
    "unknown_instant",
)
KALMAN_KEYS = ("states", "gain", "covariance", "covariance_range")
NOISE_KEYS = ("process_noise", "measurement_noise")
RUN_KEYS = ("of", "method", "substeps", "events", "follow", "linearise")
METHODS = ("euler", "midpoint", "rk4", "exact", "exponential")
"""Methods of integration of a model run and of a continuous automaton."""
COVARIANCE_OPTIONS = ("steady", "keep")
MAX_SUBSTEPS = 100
"""Largest number of steps of the method within a tick."""
MAX_EVENTS = 100
"""Largest number of located transitions within a tick."""

FormulaMatrix = dict[str, dict[str, Formula]]
"""The coefficients of a matrix by row and column name."""


def read_observer(reader: Reader, node: YamlNode, key: str, model: Automaton | None) -> Observer:
    """Return the observer at a node: from a mode of the model (`of`) or with written matrices.

    `key` is its key path. Defaults: `gain: steady`, `predict: matrix`, `covariance: steady`; absent
    matrices and vectors are empty, absent `of` and `correct` are None.

    Reported, not raised: missing `kalman`, `measures`, `process_noise` or `measurement_noise`,
    matrices beside `of`, keys of a recursive covariance with a steady gain, repeated states, a
    measurement without noise, and unknown rows, columns or modes (left out).
    """
    table = reader.read_mapping(node, key, (*OBSERVER_KEYS, *NOISE_KEYS))
    kalman = reader.read_mapping(table.get("kalman"), f"{key}.kalman", KALMAN_KEYS)
    gain = reader.read_choice(kalman.get("gain"), "gain", ("steady", "recursive"), "steady")
    runs = (
        reader.read_choice(table.get("predict"), "predict", ("matrix", "runs"), "matrix") == "runs"
    )
    _check_required_keys(reader, table, node.span)
    if gain == "steady":
        _reject_covariance_keys(reader, table, kalman, runs)
    instants = reader.read_formulas(table.get("unknown_instant"), f"{key}.unknown_instant")
    states = tuple(item.text for item in reader.read_list(kalman.get("states"), "states"))
    measures = _read_measures(reader, table.get("measures"), f"{key}.measures")
    of_node = table.get("of")
    of = _read_model_mode(reader, of_node, "an observer", node.span, model) if of_node else None
    _check_matrix_source(reader, table)
    _check_unique_states(reader, states, table.entries.get("kalman"))
    noise = _read_measurement_noise(reader, table, key, measures)
    rows = columns = set(states)
    correct = table.get("correct")
    inputs = tuple(item.text for item in reader.read_list(table.get("inputs"), "inputs"))
    return Observer(
        states=states,
        inputs=inputs,
        measures=measures,
        a=_read_matrix(reader, table.get("A"), f"{key}.A", rows, columns),
        b=_read_matrix(reader, table.get("B"), f"{key}.B", rows, set(inputs)),
        c=_read_matrix(reader, table.get("C"), f"{key}.C", set(measures), columns),
        f=_read_vector(reader, table.get("f"), f"{key}.f", rows),
        process_noise=_read_vector(
            reader, table.get("process_noise"), f"{key}.process_noise", rows
        ),
        measurement_noise=noise,
        key=key,
        span=of_node.span if of_node else node.span,
        of=of,
        at=_read_operating_point(reader, table.get("at"), f"{key}.at", model),
        predicts_by_run=runs,
        gain=gain,
        covariance=reader.read_choice(
            kalman.get("covariance"), "covariance", COVARIANCE_OPTIONS, "steady"
        ),
        correct=reader.read_string(correct, "correct", node.span) if correct else None,
        variance_limits=_read_variance_limits(
            reader, kalman.get("covariance_range"), f"{key}.covariance_range", rows
        ),
        unknown_instant=instants,
    )


def _read_measurement_noise(
    reader: Reader, table: MappingNode, key: str, measures: Mapping[str, str]
) -> dict[str, Formula]:
    """Return the noise of each measurement by name.

    If some measurements have noise, those without it are reported.
    """
    noise_entry = table.entries.get("measurement_noise")
    path = f"{key}.measurement_noise"
    noise = _read_vector(reader, table.get("measurement_noise"), path, set(measures))
    for name in measures:
        if noise_entry and name not in noise:
            label = f"`{name}` has no measurement noise"
            reader.problems.error("observer", noise_entry.span, label)
    return noise


def _check_unique_states(reader: Reader, states: Iterable[str], entry: Entry | None) -> None:
    """Report states that the list of states contains more than once."""
    for name, count in Counter(states).items():
        if count > 1 and entry:
            label = f"the observer has the state `{name}` {count} times"
            reader.problems.error("observer", entry.span, label)


def _read_measures(reader: Reader, node: YamlNode | None, key: str) -> dict[str, str]:
    """Return the measured input by the name of each measurement."""
    measures = {}
    for entry in reader.named_entries(node, key):
        measures[entry.key] = reader.read_string(entry.node, f"measures.{entry.key}", entry.span)
    return measures


def _check_required_keys(reader: Reader, table: MappingNode, span: Span) -> None:
    """Report required keys that are missing in an observer."""
    if "kalman" not in table.entries:
        reader.problems.error("missing", span, "`kalman: {states: [...]}` is missing")
    for name in ("measures", *NOISE_KEYS):
        if name not in table.entries:
            reader.problems.error("missing", span, f"`{name}` is missing in the observer")


def _reject_covariance_keys(
    reader: Reader, table: MappingNode, kalman: MappingNode, runs: bool
) -> None:
    """Report the keys of a recursive covariance in an observer with a steady-state gain."""
    for name in ("covariance", "covariance_range", "unknown_instant"):
        entry = kalman.entries.get(name) or table.entries.get(name)
        if entry:
            label = f"`{name}` belongs to `gain: recursive`"
            reader.problems.error("observer", entry.span, label)
    if runs:
        label = "`predict: runs` needs `gain: recursive`: the run's mode changes the covariance"
        reader.problems.error("observer", table.entries["predict"].span, label)


def _read_variance_limits(
    reader: Reader, node: YamlNode | None, key: str, names: set[str]
) -> dict[str, tuple[Formula, Formula]]:
    """Return the lower and upper limit of the variance of each state: `{w_em: [low, high]}`.

    They are in the square of the unit of the state.
    """
    limits = {}
    for entry in reader.read_mapping(node, key):
        if not _check_row_name(reader, entry, key, names):
            continue
        bounds = [
            reader.read_expression(n, key, n.span) for n in reader.read_list(entry.node, entry.key)
        ]
        if len(bounds) == 2 and bounds[0] and bounds[1]:
            limits[entry.key] = (bounds[0], bounds[1])
        else:
            reader.problems.error("form", entry.span, "limits of a variance are `[low, high]`")
    return limits


def _check_matrix_source(reader: Reader, table: MappingNode) -> None:
    """Report matrices that are written although `of` takes them from the model."""
    written = [name for name in MATRIX_KEYS if name in table.entries]
    for name in written if "of" in table.entries else []:
        label = f"`{name}` is taken from the model, because `of` is given"
        help = f"leave out `{name}`, or remove `of` by `of: {{remove: true}}`"
        reader.problems.error("observer", table.entries[name].span, label, help)


def read_run(reader: Reader, node: YamlNode, key: str, model: Automaton | None) -> ModelRun:
    """Return the run of a mode of the model that the node describes; `key` is its key path.

    Defaults: `method: rk4`, `substeps: 1` (1 to MAX_SUBSTEPS), `events: 4` (1 to MAX_EVENTS),
    `follow: true`. `linearise` is None without the key, else the formulas of its `at` by state or
    input of the model. A missing model or an unknown mode is reported and gives the mode "".
    """
    table = reader.read_mapping(node, key, RUN_KEYS)
    mode = _read_model_mode(reader, table.get("of"), "a run", node.span, model) or ""
    point: dict[str, Formula] = {}
    if "linearise" in table.entries:
        options = reader.read_mapping(table.get("linearise"), f"{key}.linearise", ("at",))
        point = _read_operating_point(reader, options.get("at"), f"{key}.linearise.at", model)
    return ModelRun(
        mode=mode,
        method=reader.read_choice(table.get("method"), "method", METHODS, "rk4"),
        substeps=reader.read_integer(table.get("substeps"), "substeps", 1, 1, MAX_SUBSTEPS),
        events=reader.read_integer(table.get("events"), "events", 4, 1, MAX_EVENTS),
        key=key,
        span=node.span,
        follow=reader.read_choice(table.get("follow"), "follow", ("true", "false"), "true")
        == "true",
        linearise=point if "linearise" in table.entries else None,
        method_span=(table.get("method") or node).span,
    )


def _read_model_mode(
    reader: Reader, node: YamlNode | None, what: str, span: Span, model: Automaton | None
) -> str | None:
    """Return the mode that `<model>.<mode>` names, or None with a problem reported."""
    of = reader.read_string(node, "of", span)
    location = node.span if node else span
    name, _, mode = of.rpartition(".")
    if model is None:
        reader.problems.error("run", location, f"{what} needs `model:` at the top of the automaton")
    elif name != model.name or mode not in model.modes:
        known = [f"{model.name}.{known}" for known in model.modes]
        label = f"`{of}` is not a mode of the model"
        reader.problems.error("name", location, label, suggest_name(of, known))
    else:
        return mode
    return None


def _read_matrix(
    reader: Reader, node: YamlNode | None, key: str, rows: set[str], columns: set[str]
) -> FormulaMatrix:
    """Return the coefficients of a matrix by row and column name; unknown names are reported."""
    matrix = {}
    for entry in reader.read_mapping(node, key):
        if _check_row_name(reader, entry, key, rows):
            matrix[entry.key] = _read_vector(reader, entry.node, f"{key}.{entry.key}", columns)
    return matrix


def _read_operating_point(
    reader: Reader, node: YamlNode | None, key: str, model: Automaton | None
) -> dict[str, Formula]:
    """Return the values of `at` by state or input of the model; other names are reported."""
    names = {*model.states, *model.inputs} if model else set()
    point = {}
    for entry in reader.read_mapping(node, key):
        if entry.key not in names:
            label = f"`at` gives values of states and inputs of the model, `{entry.key}` is none"
            reader.problems.error("name", entry.span, label, suggest_name(entry.key, names))
        elif formula := reader.read_expression(entry.node, f"{key}.{entry.key}", entry.span):
            point[entry.key] = formula
    return point


def _read_vector(
    reader: Reader, node: YamlNode | None, key: str, names: set[str]
) -> dict[str, Formula]:
    """Return the expressions of a mapping by row name; unknown names are reported."""
    vector = {}
    for entry in reader.read_mapping(node, key):
        if _check_row_name(reader, entry, key, names):
            formula = reader.read_expression(entry.node, f"{key}.{entry.key}", entry.span)
            if formula:
                vector[entry.key] = formula
    return vector


def _check_row_name(reader: Reader, entry: Entry, key: str, names: set[str]) -> bool:
    """Tell whether the key of an entry is in `names`; report it otherwise."""
    if entry.key in names:
        return True
    label = f"`{entry.key}` is not a row or column of `{key.rpartition('.')[2]}`"
    reader.problems.error("name", entry.span, label, suggest_name(entry.key, names))
    return False
