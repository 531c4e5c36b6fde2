"""Error codes: the permanent code and the meaning of each kind of problem (docs/problems.md)."""

from __future__ import annotations

from collections.abc import Mapping

CODES: Mapping[str, tuple[str, str]] = {
    # Text and files.
    "unreadable": ("MW101", "A file cannot be read."),
    "binary": ("MW102", "A file is not text in UTF-8."),
    "empty": ("MW103", "A file is empty."),
    "huge": ("MW104", "A file or a model is larger than what is accepted."),
    "depth": ("MW105", "A text is nested too deeply."),
    "yaml": ("MW106", "A text is not valid YAML."),
    "yaml-feature": ("MW107", "A feature of YAML is used that is not part of the language."),
    "key": ("MW108", "A key is a list or a mapping."),
    "duplicate": ("MW109", "A name is used twice."),
    "unknown-key": ("MW110", "A key has no meaning at this place."),
    "version": ("MW111", "A file does not say its version of the language and its kind."),
    "missing": ("MW112", "A required key or value is missing."),
    "form": ("MW113", "A value has another form than its key requires."),
    "choice": ("MW114", "A text is not one of the possible values."),
    "name": ("MW115", "A name is unknown or is not a valid name."),
    "outside": ("MW116", "A spec names a file outside of its project."),
    # Modes and transitions.
    "priority": ("MW201", "Two guards of one mode can be true together and no priority decides."),
    "refire": ("MW202", "Transitions fire again and again at the same instant."),
    "unreached": ("MW203", "No sequence of transitions enters a mode."),
    "writer": ("MW204", "A variable has two writers, or a writer that is not allowed."),
    "wait": ("MW205", "A wait is not a fixed time, is negative or is too long."),
    "unused": ("MW206", "A declared name is never read."),
    "unwritten": ("MW207", "A variable is never written."),
    "faults": ("MW208", "There are more fault bits than a word holds."),
    "rewind": ("MW209", "A transition cannot go back in time like this."),
    "cycle": ("MW210", "Transitions form a cycle at one instant or in one tick."),
    "dead": ("MW211", "A guard is never true, so its transition never fires."),
    "shadowed": ("MW212", "Whenever a guard is true, another transition fires first."),
    "timer": ("MW213", "A wait never elapses."),
    "near": ("MW214", "Two waits differ by less than a period."),
    "stuck": ("MW215", "No transition out of a mode ever fires."),
    "zeno": ("MW216", "Modes can change infinitely often in a finite time."),
    "overlap": ("MW220", "Two rows of a truth table can be true together."),
    "incomplete": ("MW221", "A table does not cover every case."),
    "target": ("MW230", "A transition of a chart cannot have these targets."),
    # Expressions, units, values.
    "expression": ("MW301", "A text is not an expression."),
    "power": ("MW302", "An exponent is not a small whole number."),
    "number": ("MW303", "A number is written in a way that other tools read differently."),
    "unit": ("MW304", "A unit is unknown or is not suitable here."),
    "dimension": ("MW305", "Units are not compatible."),
    "type": ("MW306", "An expression has another type than is required."),
    "arguments": ("MW307", "A function has a wrong number or kind of arguments."),
    "values": ("MW308", "The values of an enumeration or of parameters are not valid."),
    "value": ("MW309", "A value is not finite or is not a value of its number type."),
    "range": ("MW310", "A range is empty, or something lies outside of it."),
    "overflow": ("MW311", "A whole number may leave its type."),
    "domain": (
        "MW312",
        "A divisor may be 0, or the argument of a root, logarithm or power may be negative.",
    ),
    "constant": ("MW313", "An expression that must be constant reads a value that changes."),
    "loop": ("MW314", "Values depend on each other in a cycle."),
    "balance": ("MW315", "A balance is not linear in the derivative of its state."),
    "table": ("MW316", "A lookup table is not complete or is not used as a table."),
    "order": ("MW317", "Values that must ascend do not ascend."),
    "past": ("MW318", "An assignment may give a value past the range of its target."),
    # Overlays: variants, effects, calibrations.
    "overlay": (
        "MW401",
        "An overlay removes a missing key, or overrides a value by the same value.",
    ),
    "variant": ("MW402", "A variant extends itself, or extends another document than it states."),
    "effect": ("MW403", "An effect does not fit its place."),
    # Observers, runs, methods.
    "model": ("MW501", "An automaton needs a model, or has none of that kind."),
    "observer": ("MW502", "An observer is not complete, or cannot be solved."),
    "run": ("MW503", "A run of the model is not complete."),
    "method": ("MW504", "A method of integration does not fit the flow."),
    "derivative": ("MW505", "An expression has no derivative at a point."),
    "stability": ("MW506", "A step is above the largest stable one."),
    "step": ("MW507", "A step is too long for its method."),
    # Systems, scenarios, studies.
    "connection": ("MW601", "A connection, a sensor or an input of a system does not fit."),
    "sampling": ("MW602", "A study draws other variants than its text suggests."),
    "event": ("MW603", "A measure of a study waits for an event that cannot occur."),
    # Recordings and results.
    "column": ("MW701", "A column of a recording is missing, duplicated or empty."),
    "row": ("MW702", "A row of a recording has another number of cells."),
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
