"""Function comments: the purpose of a C function, from the name of its block (rule C21)."""

from __future__ import annotations

import re
from collections.abc import Iterable

PURPOSES = {
    "advance_time": "Time passes: what is left of the step and of waits",
    "bound": "Keeps the covariance within its limits[, those of mode {}], else sets a fault bit",
    "choose": "The transition that mode[ {}] requests",
    "columns": "P = T Phi' + Qd, the covariance over one period, through T = Phi P[: {}]",
    "commit": "Leaves, resets and enters what the chosen transitions say",
    "compare_stamps": "Sets a fault where solved numbers belong to another calibration",
    "correct": "Innovations and correction of the observer[ in mode {}]",
    "count": "Counts the ticks that guards[ of mode {}] were true, and its time",
    "cubic": "The cubic through both ends of the step, with the rates there",
    "dense_guards": "Guards[ of mode {}] at work->s after the start of the step",
    "entry_covariance": "The covariance with which mode[ {}] begins",
    "equations": "Equations[ of mode {}]",
    "evaluate_guards": "The truth of each guard now",
    "evaluate_tables": "The truth tables",
    "fast_path": "The whole step[ in mode {}], if no guard changes in it",
    "flow": "Flows[ in mode {}] over work->h, or until a guard turns true",
    "guards": "Guards[ of mode {}]",
    "half": "States halfway through the whole step[, in mode {}]: Eh x + Fh remainder",
    "input_change": "What a change of an input at an unknown instant has done[: {}]",
    "jump": "Transitions[ of mode {}]: the first one that is due is taken",
    "latch": "Takes the inputs of now, each within its range",
    "latch_each": "Inputs one by one: a fault bit for each that is not within its range",
    "leave": "What is forgotten where[ {}] is left",
    "limit": "The next piece of the step: it ends where a wait does",
    "locate": "Halves the bracket in which a guard[ of mode {}] turns true; its upper end is kept",
    "macro_step": "Transitions until none is enabled",
    "micro_step": "One micro-step: choose, leave, reset, enter",
    "point": "States at work->s after the start of the step: its polynomial",
    "predict": "Prediction of the observer[ in mode {}] over one period; f_*: rates less A x + B u",
    "propagate": "The covariance over one period[: {}]",
    "quit": "Leaves region[ {}] with all that is active in it",
    "rates": "Rates of the states[ in mode {}]",
    "record_history": "Records the values that are read later: delays and earlier ticks",
    "remainder": "What of the rates[ in mode {}] is not linear in the states: rate - A x",
    "resolve_conflicts": "Resolves conflicts between the requests of regions",
    "resolve_request": "Resolves the request of region {}",
    "rest": "The model over work->rest: the rest of a tick[, in mode {}]",
    "restart_waits": "Waits whose guard is false begin anew",
    "retain_inputs": "Keeps those inputs of this tick that the next one reads",
    "rollback": "Goes back to the tick in which `until` turned true[, for transition {}]",
    "rows": "T = Phi P, of the covariance over one period[: {}]",
    "run": "The model over one tick[, in mode {}]",
    "saturate_states": "Holds the states that the model has moved within their ranges",
    "segment": "One piece of the step: flow, then what is due at its end",
    "select_transitions": "The transitions of one micro-step",
    "series": "Coefficients of the polynomial through the step[ in mode {}], 0 of what rests",
    "stage": "Stage {} of the method: keeps the rates, and goes to where it needs the next ones",
    "start": "The first tick: states begin, where the spec says so at inputs; nothing advances yet",
    "step": "One step of the method[ in mode {}]: from the states to work->end_*",
    "store": "What updates[ of mode {}] found, stored together",
    "switch": "The transition of the model out of mode {}",
    "through_events": "The step from event to event: taken if a guard changes in it",
    "until": "Whether `until` holds[, for transition {}]",
    "update": "Updates[ of mode {}], from the values of this tick",
    "whole": "States at the end of the whole step[, in mode {}]: E x + F remainder",
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
