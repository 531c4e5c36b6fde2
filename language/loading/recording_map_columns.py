"""Recording map columns: the columns of a recording map that an automaton uses, and mismatches."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping

from language.expressions.units import PURE_NUMBER, Dimension, are_compatible
from language.loading.recording_map_reader import column_dimension
from language.model.automaton import Automaton
from language.model.system import ColumnMapping, RecordingMap
from language.text.diagnostic import Problems, suggest_name
from language.typecheck.types import EnumType, ExprType, IntType, TypeName


def pair_columns(
    automaton: Automaton, mapping: RecordingMap, problems: Problems
) -> tuple[list[str], list[str]]:
    """Return the names of the columns that an automaton reads or compares, and of the others.

    Both are in the order of the map. A column with `compare` counts as used; the others are columns
    whose `to` is no input of the automaton, which is no problem, because a map may serve several
    automata.

    Reported are inputs without a column, constant or default, inputs that are fed twice, wrong
    dimensions of columns and constants, and unknown outputs.
    """
    used, left_out = [], []
    fed = set(mapping.constants)
    _check_constants(automaton, mapping, problems)
    for column in mapping.columns.values():
        if column.compare is not None:
            _check_output(automaton, column, problems)
            used.append(column.name)
            continue
        declaration = automaton.inputs.get(column.to or "")
        if declaration is None:
            left_out.append(column.name)
            continue
        _check_dimension(
            column, declaration.unit.dimension, f"input `{declaration.name}`", problems
        )
        if declaration.name in fed:
            problems.error("duplicate", column.span, f"input `{declaration.name}` is fed twice")
        fed.add(declaration.name)
        used.append(column.name)
    for name, declaration in automaton.inputs.items():
        if name not in fed and declaration.default is None:
            label = f"map `{mapping.name}` gives no value for input `{name}` of `{automaton.name}`"
            problems.error("missing", mapping.span, label, suggest_name(name, left_out))
    return used, left_out


def check_pairing(automaton: Automaton, mapping: RecordingMap, problems: Problems) -> None:
    """Report what prevents the comparison of recordings with an automaton.

    In addition to the problems of `pair_columns`, these are columns for unknown inputs, outputs
    that are compared twice, and a map that compares no output. All are errors; nothing is raised.
    """
    _, left_out = pair_columns(automaton, mapping, problems)
    for name in left_out:
        column = mapping.columns[name]
        label = f"`{column.to}` is not an input of `{automaton.name}`"
        help = (
            suggest_name(column.to or "", automaton.inputs)
            or "leave out what the model does not read"
        )
        problems.error("name", column.span, label, help)
    first: dict[str, str] = {}
    for column in mapping.columns.values():
        if column.compare is None:
            continue
        if column.compare in first:
            label = f"output `{column.compare}` is compared with `{first[column.compare]}` already"
            problems.error("duplicate", column.span, label, "each output is measured by one column")
        first.setdefault(column.compare, column.name)
    if not first:
        label = f"map `{mapping.name}` compares no output of `{automaton.name}`"
        hint = f"a column with `compare: {next(iter(automaton.outputs), 'output')}`"
        problems.error("missing", mapping.span, label, hint)


def add_signal_types(
    mapping: RecordingMap, input_types: Mapping[str, ExprType], output_types: Mapping[str, ExprType]
) -> RecordingMap:
    """Return a map whose columns know the types of their signals, for words such as `TRUE`.

    Types of quantities are left out: a column of a real signal has None.
    """
    columns = {}
    for name, column in mapping.columns.items():
        types, signal = (
            (input_types, column.to) if column.compare is None else (output_types, column.compare)
        )
        kind = types.get(signal or "")
        kind = None if isinstance(kind, Dimension) else kind
        columns[name] = dataclasses.replace(column, signal_type=kind)
    return dataclasses.replace(mapping, columns=columns)


def type_columns(automaton: Automaton, mapping: RecordingMap) -> RecordingMap:
    """Return a map whose columns know the types of the inputs and outputs of an automaton.

    The output `mode` is an enumeration of the modes at the positions of their numbers; numbers
    without a mode have an empty name.
    """
    inputs = {
        name: type_of_input(item.type, item.values) for name, item in automaton.inputs.items()
    }
    outputs = {
        name: kind
        for name in automaton.outputs
        if (kind := automaton.name_types.get(automaton.output_source(name))) is not None
    }
    modes = {mode.number: mode.name for mode in automaton.modes.values()}
    names = tuple(modes.get(number, "") for number in range(max(modes, default=-1) + 1))
    for name in automaton.outputs:
        if automaton.output_source(name) == "mode":
            outputs.setdefault(name, EnumType(names))
    return add_signal_types(mapping, inputs, outputs)


def type_of_input(word: TypeName, values: tuple[str, ...]) -> ExprType:
    """Return the type of an input from the word of its declaration; a pure number for `real`."""
    types: dict[TypeName, ExprType] = {
        "bool": "truth",
        "int": IntType(),
        "enum": EnumType(values),
    }
    return types.get(word, PURE_NUMBER)


def _check_output(automaton: Automaton, column: ColumnMapping, problems: Problems) -> None:
    """Report a column that is compared with an unknown output or one of another dimension."""
    output = column.compare or ""
    if output in automaton.outputs:
        expected = automaton.dimensions.get(automaton.output_source(output), PURE_NUMBER)
        _check_dimension(column, expected, f"output `{output}`", problems)
        return
    label = f"`{output}` is not an output of `{automaton.name}`"
    problems.error("name", column.span, label, suggest_name(output, automaton.outputs))


def _check_dimension(
    column: ColumnMapping, expected: Dimension, what: str, problems: Problems
) -> None:
    """Report a column of another dimension than `expected`; `what` names its target."""
    if not are_compatible(column_dimension(column), expected):
        label = f"column `{column.name}` is in `{column_dimension(column).display_name}`"
        problems.error("dimension", column.span, label, f"{what} is in `{expected.display_name}`")


def _check_constants(automaton: Automaton, mapping: RecordingMap, problems: Problems) -> None:
    """Report constants of another dimension than the input of the same name."""
    for name, (_, dimension) in mapping.constants.items():
        declaration = automaton.inputs.get(name)
        if declaration and not are_compatible(dimension, declaration.unit.dimension):
            label = f"constant `{name}` is in `{dimension.display_name}`"
            hint = f"input `{name}` is in `{declaration.unit.dimension.display_name}`"
            problems.error("dimension", mapping.span, label, hint)
