"""Error codes: the permanent code and the meaning of each kind of problem (docs/problems.md)."""

from __future__ import annotations

from collections.abc import Mapping

CODES: Mapping[str, tuple[str, str]] = {
    # Text and files.
    "unreadable": ("MW101", "A file cannot be read."),
    "binary": ("MW102", "A file is not text in UTF-8."),
    "empty": ("MW103", "A file is empty."),
    "huge": ("MW104", "A file or a model exceeds the accepted size."),
    "depth": ("MW105", "The values of a file are nested too deeply."),
    "yaml": ("MW106", "A file is not valid YAML."),
    "yaml-feature": ("MW107", "A file uses a feature of YAML that is not part of the language."),
    "key": ("MW108", "A key is a list or a mapping instead of a name."),
    "duplicate": ("MW109", "A name is used twice."),
    "unknown-key": ("MW110", "A key has no meaning at this place."),
    "version": ("MW111", "A file does not state the version of the language or its kind."),
    "missing": ("MW112", "A required key or value is missing."),
    "form": ("MW113", "A value does not have the form that its key requires."),
    "choice": ("MW114", "A text is not one of the possible values."),
    "name": ("MW115", "A name is unknown or is not a valid name."),
    "outside": ("MW116", "A spec names a file outside of its project."),
    # Modes and transitions.
    "priority": (
        "MW201",
        "Two guards of a mode can be true together, and their transitions have equal priorities.",
    ),
    "refire": ("MW202", "Transitions fire again and again at the same instant."),
    "unreached": ("MW203", "No sequence of transitions enters a mode."),
    "writer": ("MW204", "A variable is assigned twice, or at a place where this is not allowed."),
    "wait": ("MW205", "A wait is not a fixed time, is negative or is too long."),
    "unused": ("MW206", "A declared name is never read."),
    "unwritten": ("MW207", "A variable is never written."),
    "faults": ("MW208", "There are more fault bits than the word `faults` can hold."),
    "rewind": ("MW209", "A transition has a `rewind` that is not possible."),
    "cycle": ("MW210", "Transitions form a cycle at one instant or in one tick."),
    "dead": ("MW211", "A guard is never true, so its transition never fires."),
    "shadowed": ("MW212", "Whenever a guard is true, another transition fires first."),
    "timer": ("MW213", "A wait never elapses."),
    "near": ("MW214", "Two waits of an automaton differ by less than its period."),
    "stuck": ("MW215", "No transition out of a mode ever fires."),
    "zeno": ("MW216", "Modes can change infinitely often in a finite time."),
    "overlap": ("MW220", "Two rows of a truth table can hold at the same time."),
    "incomplete": ("MW221", "A table does not cover every case."),
    "target": ("MW230", "The targets of a transition in a chart are not valid."),
    # Expressions, units, values.
    "expression": ("MW301", "A text is not an expression."),
    "power": ("MW302", "An exponent is not a small whole number."),
    "number": ("MW303", "A number is written in a way that other tools read differently."),
    "unit": ("MW304", "A unit is unknown or is not suitable here."),
    "dimension": ("MW305", "Units are not compatible."),
    "type": ("MW306", "An expression does not have the required type."),
    "arguments": ("MW307", "A function has a wrong number or kind of arguments."),
    "values": ("MW308", "The values of an enumeration or of parameters are not valid."),
    "value": ("MW309", "A number is missing, is not finite or cannot be represented in its type."),
    "range": ("MW310", "A range is empty, or a value lies outside its range."),
    "overflow": ("MW311", "An integer may exceed the limits of its type."),
    "domain": (
        "MW312",
        "A divisor may be 0, or the argument of a root, logarithm or power may be negative.",
    ),
    "constant": ("MW313", "An expression that must be constant reads a value that changes."),
    "loop": ("MW314", "Values depend on each other in a cycle."),
    "balance": ("MW315", "A balance is not linear in the derivative of its state."),
    "table": ("MW316", "A lookup table is not complete or is not used as a table."),
    "order": ("MW317", "Values are not in ascending order although they must be."),
    "past": ("MW318", "An assigned value may lie outside the range of its target."),
    "temperature": (
        "MW319",
        "A temperature in degC is used as a difference of temperatures.",
    ),
    # Overlays: variants, effects, calibrations.
    "overlay": (
        "MW401",
        "An overlay removes a key that does not exist, or replaces a value by an equal value.",
    ),
    "variant": ("MW402", "A variant extends itself, or does not extend the required base."),
    "effect": ("MW403", "An effect does not fit its place."),
    # Observers, runs, methods.
    "model": ("MW501", "The `model` of an automaton is not suitable."),
    "observer": ("MW502", "An observer is not complete, or cannot be solved."),
    "run": ("MW503", "A run of the model is not complete."),
    "method": ("MW504", "An integration method is not suitable for the flow."),
    "derivative": ("MW505", "An expression has no derivative at a point."),
    "stability": ("MW506", "A step is longer than the largest stable step."),
    "step": ("MW507", "A step is too long for its method."),
    # Systems, scenarios, studies.
    "connection": ("MW601", "A connection, a sensor or an input of a system is not valid."),
    "sampling": ("MW602", "The samples of a study do not have the expected distribution."),
    "event": ("MW603", "A measure of a study names an event that cannot occur."),
    # Recordings and results.
    "column": ("MW701", "A column of a recording is missing, duplicated or empty."),
    "row": ("MW702", "A row of a recording has more or fewer cells than the header."),
    "time": ("MW703", "A time stamp is missing, is not a number or does not ascend."),
    "store": ("MW704", "A folder does not hold the results of a study."),
}
"""Code and meaning of each kind of problem; a code is never reused, and a kind keeps its code."""


NO_CODE = ("", "")


def code_of(kind: str) -> str:
    """Return the code of a kind of problem, like `MW201`, or an empty text for an unknown kind."""
    return CODES.get(kind, NO_CODE)[0]


def meaning_of(kind: str) -> str:
    """Return the meaning of a kind of problem as a sentence; an empty text for an unknown kind."""
    return CODES.get(kind, NO_CODE)[1]
