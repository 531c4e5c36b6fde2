"""Scale: how much acts at a place, so that what is missing there can be told as a part of it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from diagnosis.bench import Bench
from diagnosis.estimate import Estimate
from diagnosis.joined import burnt
from diagnosis.layers import drift
from language.place import Misfit, place_of

Reals = NDArray[np.float64]
KINDS = {"flow": "balance", "elements": "element", "outputs": "output"}
"""Sections of places to kinds of drifts."""


def scale_of(bench: Bench, section: str, place: str, model: Estimate) -> float:
    """Return the root mean square [SI] of what acts at a place; 0 where that cannot be told.

    Of a balance what accelerates it, of an element its elastic torque, of an output the signal.
    """
    if section == "outputs":
        column = bench.seen.index(place)
        return float(np.nanstd(np.concatenate([one.measured[:, column] for one in bench.series])))
    holes = holes_of(bench, section, place)
    factor = _value(bench, model, holes.get("inertia" if section == "flow" else "stiffness", ""))
    name = place if section == "flow" else holes.get("twist", "")
    states = model.candidate.predictor.states
    if factor is None or name not in states:
        return 0.0
    runs = zip(bench.series, model.outcome.predictions, strict=True)
    rows = [run.states[burnt(one) : run.done] for one, run in runs]
    if section == "flow":
        period = float(bench.period)
        moved = [np.diff(one[:, states.index(name)]) / period for one in rows]
        return factor * _rms(np.concatenate(moved))
    gap = holes.get("gap", "")
    slack = [one[:, states.index(gap)] if gap in states else 0.0 for one in rows]
    twist = [one[:, states.index(name)] - free for one, free in zip(rows, slack, strict=True)]
    return factor * _rms(np.concatenate(twist))


def unit_of(bench: Bench, section: str, place: str) -> str:
    """Return the unit of what is unknown at a place."""
    return holes_of(bench, section, place).get("unit" if section == "outputs" else "force", "")


def holes_of(bench: Bench, section: str, place: str) -> dict[str, str]:
    """Return what effects find at a place, as texts; nothing where no drift can be laid."""
    kind = KINDS.get(section)
    if kind is None:
        return {}
    found = place_of(bench.document.root, drift(kind, place).effect, place)
    if isinstance(found, Misfit):
        return {}
    return {name: value for name, value in found.holes.items() if isinstance(value, str)}


def _value(bench: Bench, model: Estimate, text: str) -> float | None:
    """Return the value of a coefficient that is a parameter."""
    known = model.values(0).get(text)
    declared = bench.automaton.parameters.get(text)
    if known is not None or declared is None or declared.value is None:
        return known
    return float(declared.value)


def _rms(values: Reals) -> float:
    return float(np.sqrt(np.mean(values**2))) if len(values) else 0.0
