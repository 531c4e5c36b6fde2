"""Observer and run: what carries the states of a sampled automaton over one tick."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING

from language.declaration import Formula
from language.document import Entry, Node, Table
from language.model import Automaton, Observer, Run
from language.problem import Span, nearest

if TYPE_CHECKING:
    from language.reader import Reader

WRITTEN_KEYS = ("inputs", "A", "B", "C", "f")
OBSERVER_KEYS = (
    "kalman",
    "of",
    "at",
    *WRITTEN_KEYS,
    "measures",
    "predict",
    "correct",
    "unknown_instant",
)
KALMAN_KEYS = ("states", "gain", "covariance", "covariance_range")
NOISE_KEYS = ("process_noise", "measurement_noise")
RUN_KEYS = ("of", "method", "substeps", "events", "follow", "linearise")
METHODS = ("euler", "midpoint", "rk4", "exact", "exponential")
KEEPING = ("steady", "keep")
MAX_SUBSTEPS = 100
MAX_EVENTS = 100

Matrix = dict[str, dict[str, Formula]]


def read_observer(reader: Reader, node: Node, key: str, model: Automaton | None) -> Observer:
    """Read an observer of a mode of the model, or one with written matrices."""
    table = reader.table(node, key, (*OBSERVER_KEYS, *NOISE_KEYS))
    kalman = reader.table(table.get("kalman"), f"{key}.kalman", KALMAN_KEYS)
    gain = reader.choice(kalman.get("gain"), "gain", ("steady", "recursive"), "steady")
    runs = reader.choice(table.get("predict"), "predict", ("matrix", "runs"), "matrix") == "runs"
    _complete(reader, table, node.span)
    if gain == "steady":
        _without_covariance(reader, table, kalman, runs)
    instants = _instants(reader, table.get("unknown_instant"), f"{key}.unknown_instant")
    states = tuple(item.text for item in reader.items(kalman.get("states"), "states"))
    measures = _measures(reader, table.get("measures"), f"{key}.measures")
    of_node = table.get("of")
    of = _mode_of_model(reader, of_node, "an observer", node.span, model) if of_node else None
    _one_source(reader, table)
    _each_once(reader, states, table.entries.get("kalman"))
    noise = _measurement_noise(reader, table, key, measures)
    rows = columns = set(states)
    correct = table.get("correct")
    inputs = tuple(item.text for item in reader.items(table.get("inputs"), "inputs"))
    return Observer(
        states=states,
        inputs=inputs,
        measures=measures,
        a=_matrix(reader, table.get("A"), f"{key}.A", rows, columns),
        b=_matrix(reader, table.get("B"), f"{key}.B", rows, set(inputs)),
        c=_matrix(reader, table.get("C"), f"{key}.C", set(measures), columns),
        f=_vector(reader, table.get("f"), f"{key}.f", rows),
        process_noise=_vector(reader, table.get("process_noise"), f"{key}.process_noise", rows),
        measurement_noise=noise,
        key=key,
        span=of_node.span if of_node else node.span,
        of=of,
        at=_point(reader, table.get("at"), f"{key}.at", model),
        runs=runs,
        gain=gain,
        covariance=reader.choice(kalman.get("covariance"), "covariance", KEEPING, "steady"),
        correct=reader.text(correct, "correct", node.span) if correct else None,
        limits=_limits(reader, kalman.get("covariance_range"), f"{key}.covariance_range", rows),
        unknown_instant=instants,
    )


def _measurement_noise(
    reader: Reader, table: Table, key: str, measures: Mapping[str, str]
) -> dict[str, Formula]:
    """Return the noise of each measurement; where any is given, each has one."""
    given = table.entries.get("measurement_noise")
    path = f"{key}.measurement_noise"
    noise = _vector(reader, table.get("measurement_noise"), path, set(measures))
    for name in measures:
        if given and name not in noise:
            label = f"`{name}` has no measurement noise"
            reader.problems.error("observer", given.span, label)
    return noise


def _each_once(reader: Reader, states: Iterable[str], entry: Entry | None) -> None:
    for name, count in Counter(states).items():
        if count > 1 and entry:
            label = f"the observer has the state `{name}` {count} times"
            reader.problems.error("observer", entry.span, label)


def _measures(reader: Reader, node: Node | None, key: str) -> dict[str, str]:
    found = {}
    for entry in reader.named(node, key):
        found[entry.key] = reader.text(entry.node, f"measures.{entry.key}", entry.span)
    return found


def _complete(reader: Reader, table: Table, span: Span) -> None:
    if "kalman" not in table.entries:
        reader.problems.error("missing", span, "`kalman: {states: [...]}` is missing")
    for name in ("measures", *NOISE_KEYS):
        if name not in table.entries:
            reader.problems.error("missing", span, f"`{name}` is missing in the observer")


def _without_covariance(reader: Reader, table: Table, kalman: Table, runs: bool) -> None:
    """A steady gain has no covariance that anything could change."""
    for name in ("covariance", "covariance_range", "unknown_instant"):
        found = kalman.entries.get(name) or table.entries.get(name)
        if found:
            label = f"`{name}` belongs to `gain: recursive`"
            reader.problems.error("observer", found.span, label)
    if runs:
        label = "`predict: runs` needs `gain: recursive`: the run's mode changes the covariance"
        reader.problems.error("observer", table.entries["predict"].span, label)


def _instants(reader: Reader, node: Node | None, key: str) -> dict[str, Formula]:
    """Read within what time the new value of an input was taken: `{T_em: 10 ms}`."""
    found = {}
    for entry in reader.named(node, key):
        formula = reader.expression(entry.node, f"{key}.{entry.key}", entry.span)
        if formula:
            found[entry.key] = formula
    return found


def _limits(
    reader: Reader, node: Node | None, key: str, names: set[str]
) -> dict[str, tuple[Formula, Formula]]:
    """Read the limits of variances: `{w_em: [low, high]}` in the square of the state's unit."""
    found = {}
    for entry in reader.table(node, key):
        if not _known(reader, entry, key, names):
            continue
        bounds = [reader.expression(n, key, n.span) for n in reader.items(entry.node, entry.key)]
        if len(bounds) == 2 and bounds[0] and bounds[1]:
            found[entry.key] = (bounds[0], bounds[1])
        else:
            reader.problems.error("form", entry.span, "limits of a variance are `[low, high]`")
    return found


def _one_source(reader: Reader, table: Table) -> None:
    """The matrices are taken from the model or written, not both."""
    written = [name for name in WRITTEN_KEYS if name in table.entries]
    for name in written if "of" in table.entries else []:
        label = f"`{name}` is taken from the model: `of` stands beside it"
        help = f"leave out `{name}`, or lay `of: {{remove: true}}` over it"
        reader.problems.error("observer", table.entries[name].span, label, help)


def read_run(reader: Reader, node: Node, key: str, model: Automaton | None) -> Run:
    """Read a run of one mode of the model."""
    table = reader.table(node, key, RUN_KEYS)
    mode = _mode_of_model(reader, table.get("of"), "a run", node.span, model) or ""
    point: dict[str, Formula] = {}
    if "linearise" in table.entries:
        where = reader.table(table.get("linearise"), f"{key}.linearise", ("at",))
        point = _point(reader, where.get("at"), f"{key}.linearise.at", model)
    return Run(
        mode=mode,
        method=reader.choice(table.get("method"), "method", METHODS, "rk4"),
        substeps=reader.whole(table.get("substeps"), "substeps", 1, 1, MAX_SUBSTEPS),
        events=reader.whole(table.get("events"), "events", 4, 1, MAX_EVENTS),
        key=key,
        span=node.span,
        follow=reader.choice(table.get("follow"), "follow", ("true", "false"), "true") == "true",
        linearise=point if "linearise" in table.entries else None,
        method_span=(table.get("method") or node).span,
    )


def _mode_of_model(
    reader: Reader, node: Node | None, what: str, span: Span, model: Automaton | None
) -> str | None:
    """Return the mode that `<model>.<mode>` names, None where that is a problem (reported)."""
    of = reader.text(node, "of", span)
    place = node.span if node else span
    name, _, mode = of.rpartition(".")
    if model is None:
        reader.problems.error("run", place, f"{what} needs `model:` at the top of the automaton")
    elif name != model.name or mode not in model.modes:
        known = [f"{model.name}.{known}" for known in model.modes]
        label = f"`{of}` is not a mode of the model"
        reader.problems.error("name", place, label, nearest(of, known))
    else:
        return mode
    return None


def _matrix(
    reader: Reader, node: Node | None, key: str, rows: set[str], columns: set[str]
) -> Matrix:
    found = {}
    for entry in reader.table(node, key):
        if _known(reader, entry, key, rows):
            found[entry.key] = _vector(reader, entry.node, f"{key}.{entry.key}", columns)
    return found


def _point(
    reader: Reader, node: Node | None, key: str, model: Automaton | None
) -> dict[str, Formula]:
    names = {*model.states, *model.inputs} if model else set()
    found = {}
    for entry in reader.table(node, key):
        if entry.key not in names:
            label = f"`at` gives values of states and inputs of the model, `{entry.key}` is none"
            reader.problems.error("name", entry.span, label, nearest(entry.key, names))
        elif formula := reader.expression(entry.node, f"{key}.{entry.key}", entry.span):
            found[entry.key] = formula
    return found


def _vector(reader: Reader, node: Node | None, key: str, names: set[str]) -> dict[str, Formula]:
    found = {}
    for entry in reader.table(node, key):
        if _known(reader, entry, key, names):
            formula = reader.expression(entry.node, f"{key}.{entry.key}", entry.span)
            if formula:
                found[entry.key] = formula
    return found


def _known(reader: Reader, entry: Entry, key: str, names: set[str]) -> bool:
    if entry.key in names:
        return True
    label = f"`{entry.key}` is not a row or column of `{key.rpartition('.')[2]}`"
    reader.problems.error("name", entry.span, label, nearest(entry.key, names))
    return False
