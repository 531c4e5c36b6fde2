"""Codes: the number of each kind of problem, which stays, and what it means (docs/problems.md)."""

from __future__ import annotations

from collections.abc import Mapping

CODES: Mapping[str, tuple[str, str]] = {
    # Text and files.
    "unreadable": ("MW101", "A file cannot be read."),
    "binary": ("MW102", "A file is not text in UTF-8."),
    "empty": ("MW103", "A file holds nothing."),
    "huge": ("MW104", "A file or a model is larger than what is accepted."),
    "depth": ("MW105", "Something is nested too deeply."),
    "yaml": ("MW106", "A text is not YAML."),
    "yaml-feature": ("MW107", "A feature of YAML that other tools read differently is not used."),
    "key": ("MW108", "A key is a list or a mapping."),
    "duplicate": ("MW109", "Two things have one name."),
    "unknown-key": ("MW110", "A key means nothing at this place."),
    "version": ("MW111", "A file does not say its version of the language and its kind."),
    "missing": ("MW112", "Something has to be there."),
    "form": ("MW113", "A value has another form than its key asks for."),
    "choice": ("MW114", "A text is none of those that are possible here."),
    "name": ("MW115", "A name is not known, or not one."),
    "outside": ("MW116", "A spec names a file outside of its project."),
    # Modes and transitions.
    "priority": ("MW201", "Two guards of one mode can hold together and no priority decides."),
    "refire": ("MW202", "Transitions fire again at the same instant, for ever."),
    "unreached": ("MW203", "No chain of transitions enters a mode."),
    "writer": ("MW204", "Two things write one variable, or none of them may."),
    "wait": ("MW205", "A wait is not a fixed time, is negative or is too long."),
    "unused": ("MW206", "Something is read nowhere."),
    "unwritten": ("MW207", "A variable is written nowhere."),
    "faults": ("MW208", "There are more fault bits than a word holds."),
    "rewind": ("MW209", "A transition cannot go back in time like this."),
    "cycle": ("MW210", "Transitions go round for ever at the same instant, or in one tick."),
    "dead": ("MW211", "A guard never holds, so its transition never fires."),
    "shadowed": ("MW212", "Other transitions fire first whenever a guard holds."),
    "timer": ("MW213", "A wait never elapses."),
    "near": ("MW214", "Two waits are nearer to each other than a period."),
    "stuck": ("MW215", "No transition out of a mode ever fires."),
    "zeno": ("MW216", "Modes can change infinitely often in a finite time."),
    "overlap": ("MW220", "Two rows of a truth table hold together."),
    "incomplete": ("MW221", "A table says nothing of some case."),
    "target": ("MW230", "A transition of a chart cannot have these targets."),
    # Expressions, units, values.
    "expression": ("MW301", "A text is not an expression."),
    "power": ("MW302", "An exponent is not a small whole number."),
    "number": ("MW303", "A number is written in a way that other tools read differently."),
    "unit": ("MW304", "A unit is not known, or not fit for this."),
    "dimension": ("MW305", "Units do not fit together."),
    "type": ("MW306", "A real, a whole number, a truth value or an enumeration is another one."),
    "arguments": ("MW307", "A function has other arguments."),
    "values": ("MW308", "The values of an enumeration or of parameters are not fit."),
    "value": ("MW309", "A value is not finite, or not one of its type of number."),
    "range": ("MW310", "A range is empty, or something lies outside of it."),
    "overflow": ("MW311", "A whole number may leave its type."),
    "domain": (
        "MW312",
        "A divisor may be 0, or a root, a logarithm or a power be one of what is below 0.",
    ),
    "constant": ("MW313", "What has to be constant reads something that changes."),
    "loop": ("MW314", "Values follow from each other in a circle."),
    "balance": ("MW315", "A balance is not linear in the derivative of its state."),
    "table": ("MW316", "A table is not whole, or is not read as it should be."),
    "order": ("MW317", "What has to ascend does not."),
    "past": ("MW318", "An assignment may give a value past the range of its target."),
    # Layers: variants, effects, calibrations.
    "overlay": (
        "MW401",
        "A layer removes what is not there, or overrides a value by the same one.",
    ),
    "variant": ("MW402", "A variant extends itself, or lies over something else than it says."),
    "effect": ("MW403", "An effect does not fit its place."),
    # Observers, runs, methods.
    "model": ("MW501", "An automaton needs a model, or has none of that kind."),
    "observer": ("MW502", "An observer is not complete, or cannot be solved."),
    "run": ("MW503", "A run of the model lacks something."),
    "method": ("MW504", "A method of integration does not fit the flow."),
    "derivative": ("MW505", "An expression has no derivative at a point."),
    "stability": ("MW506", "A step is above the largest stable one."),
    "step": ("MW507", "A step is too long for its method."),
    # Systems, scenarios, studies.
    "connection": ("MW601", "A connection, a sensor or an input of a system does not fit."),
    "sampling": ("MW602", "A study draws other variants than it seems to."),
    "event": ("MW603", "A measure of a study waits for an event that cannot be."),
    # Recordings and results.
    "column": ("MW701", "A column of a recording is absent, doubled or empty."),
    "row": ("MW702", "A row of a recording has another number of cells."),
    "time": ("MW703", "A time stamp is absent, is not a number or does not ascend."),
    "store": ("MW704", "A folder does not hold the results of a study."),
}
"""Code and meaning by kind; a code is never given again, and a kind keeps its code."""


NO_CODE = ("", "")


def code_of(kind: str) -> str:
    """Return the code of a kind of problem."""
    return CODES.get(kind, NO_CODE)[0]


def meaning_of(kind: str) -> str:
    """Return what a kind of problem means, as a sentence."""
    return CODES.get(kind, NO_CODE)[1]
