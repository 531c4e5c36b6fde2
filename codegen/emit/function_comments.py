"""Function comments: the purpose of a C function, from the name of its block (rule C21)."""

from __future__ import annotations

import re
from collections.abc import Iterable

PURPOSES = {
    "back": "Goes back to the tick in which `until` turned true[, for transition {}]",
    "bound": "Keeps the covariance within its limits[, those of mode {}], else sets a fault bit",
    "choose": "The transition that mode[ {}] requests",
    "commit": "Leaves, resets and enters what the chosen transitions say",
    "columns": "P = T Phi' + Qd, the covariance over one period, through T = Phi P[: {}]",
    "compare_stamps": "Sets a fault where solved numbers belong to another calibration",
    "correct": "Innovations and correction of the observer[ in mode {}]",
    "count": "Counts the ticks that guards[ of mode {}] were true, and its time",
    "cover": "The covariance with which mode[ {}] begins",
    "cubic": "The cubic through both ends of the step, with the rates there",
    "decide": "The truth tables",
    "elapse": "Time passes: what is left of the step and of waits",
    "equations": "Equations[ of mode {}]",
    "guards": "Guards[ of mode {}]",
    "half": "States halfway through the whole step[, in mode {}]: Eh x + Fh pull",
    "hear": "Resolves conflicts between the requests of regions[: {}]",
    "hold": "Holds the states that the model has moved within their ranges",
    "jump": "Transitions[ of mode {}]: the first one that is due is taken",
    "keep": "Keeps the values that are read later: delays, and ticks that are looked back to",
    "latch": "Takes the inputs of now, each within its range",
    "latch_each": "Inputs one by one: a fault bit for each that is not within its range",
    "leap": "The whole step[ in mode {}], if no guard changes in it",
    "leave": "What is forgotten where[ {}] is left",
    "limit": "The next piece of the step: it ends where a wait does",
    "load": "Waits whose guard is false begin anew",
    "locate": "Halves the bracket in which a guard[ of mode {}] turns true; its upper end is kept",
    "look": "Guards[ of mode {}] at work->s after the start of the step",
    "micro_step": "One micro-step: choose, leave, reset, enter",
    "move": "Flows[ in mode {}] over work->h, or until a guard turns true",
    "point": "States at work->s after the start of the step: its polynomial",
    "predict": "Prediction of the observer[ in mode {}] over one period; f_*: rates less A x + B u",
    "pull": "What of the rates[ in mode {}] is not linear in the states: pull = rate - A x",
    "quit": "Leaves region[ {}] with all that is active in it",
    "rates": "Rates of the states[ in mode {}]",
    "remember": "Keeps those inputs of this tick that the next one reads",
    "rest": "The model over work->rest: the rest of a tick[, in mode {}]",
    "rows": "T = Phi P, of the covariance over one period[: {}]",
    "run": "The model over one tick[, in mode {}]",
    "segment": "One piece of the step: flow, then what is due at its end",
    "select_transitions": "The transitions of one micro-step",
    "series": "Coefficients of the polynomial through the step[ in mode {}], 0 of what rests",
    "settle": "Transitions until none is enabled",
    "spread": "The covariance over one period[: {}]",
    "late": "What a change of an input at an unknown instant has done[: {}]",
    "stage": "Stage {} of the method: keeps the rates, and goes to where it needs the next ones",
    "start": "The first tick: states begin, where the spec says so at inputs; nothing advances yet",
    "step": "One step of the method[ in mode {}]: from the states to work->end_*",
    "store": "What updates[ of mode {}] found, stored together",
    "switch": "The transition of the model out of mode {}",
    "through_events": "The step from event to event: taken if a guard changes in it",
    "until": "Whether `until` holds[, for transition {}]",
    "update": "Updates[ of mode {}], from the values of this tick",
    "watch": "The truth of each guard now",
    "whole": "States at the end of the whole step[, in mode {}]: E x + F pull",
}
"""Comments by the first words of the name of a block. `{}` stands for the rest of the name. A part
in brackets is left out if there is no rest."""
OPTIONAL = re.compile(r"\[(.*?)\]")
"""A part of a comment in brackets."""


def describe_function(block: str, modes: Iterable[str] = (), run_modes: Iterable[str] = ()) -> str:
    """Return the comment of the function of a block; an empty text for an unknown name.

    The entry of PURPOSES that is the longest prefix of the name, in words separated by `_`, is
    taken; the rest of the name replaces `{}`. If the rest is a mode and a run mode, separated by
    `_`, the comment names both.
    """
    both = {f"{m}_{r}": f"{m} with the model in {r}" for m in modes for r in run_modes}
    words = block.split("_")
    for count in range(len(words), 0, -1):
        text = PURPOSES.get("_".join(words[:count]))
        if text:
            rest = "_".join(words[count:])
            shown = both.get(rest, rest)
            return OPTIONAL.sub(r"\1" if rest else "", text).replace("{}", shown)
    return ""
