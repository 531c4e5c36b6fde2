"""Manoeuvres: time courses of the inputs for an experiment, scaled to the recorded inputs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cache
from importlib import resources
from typing import Any

import numpy as np
import yaml

from diagnosis.data.array_types import Reals
from diagnosis.data.sampled_recording import SampledRecording
from diagnosis.estimation.model_set import ModelSet
from language.expressions.units import Dimension
from language.overlays.name_types import TreeTypes

FORCE_UNITS = ("N*m", "N")


@dataclass(frozen=True)
class Manoeuvre:
    """A manoeuvre as a sampled recording; measured are only the initial outputs."""

    name: str
    series: SampledRecording = field(repr=False)


def manoeuvres_for(model_set: ModelSet) -> list[Manoeuvre]:
    """Return the manoeuvres of `manoeuvres.yaml` for the driving input of a model set.

    This is the first varying force or torque, if possible with both signs; the brake is the next
    varying one. Amplitudes are scaled to the largest recorded magnitude of an input.
    """
    whole = np.concatenate([one.inputs for one in model_set.series])
    recorded = dict(zip(model_set.automaton.inputs, whole.T, strict=True))
    forces = [name for name in recorded if _is_force(model_set, name)]
    moved = [name for name in forces if float(np.std(recorded[name])) > 0.0]
    if not moved:
        return []
    both = [name for name in moved if np.min(recorded[name]) < 0.0 < np.max(recorded[name])]
    drive = (both or moved)[0]
    brake = next((name for name in moved if name != drive), None)
    return [
        Manoeuvre(name, _manoeuvre_series(model_set, name, course, drive, brake))
        for name, course in _read_manoeuvres().items()
        if brake is not None or "brake" not in course
    ]


@cache
def _read_manoeuvres() -> Mapping[str, Mapping[str, Any]]:
    """Return the definitions of manoeuvres by name, from `manoeuvres.yaml`."""
    text = resources.files("diagnosis.experiment").joinpath("manoeuvres.yaml").read_text("utf-8")
    menu: Mapping[str, Mapping[str, Any]] = yaml.safe_load(text)
    return menu


def _is_force(model_set: ModelSet, name: str) -> bool:
    """Return whether an input is a force or a torque."""
    kind = TreeTypes(model_set.document.root).type_of_name(name)
    return isinstance(kind, Dimension) and str(kind) in FORCE_UNITS


def _manoeuvre_series(
    model_set: ModelSet, name: str, definition: Mapping[str, Any], drive: str, brake: str | None
) -> SampledRecording:
    """Return a manoeuvre as a recording; other inputs have their recorded median."""
    period = float(model_set.period)
    count = round(definition["drive"][-1][0] / period) + 1
    time = np.arange(count) * period
    names = list(model_set.automaton.inputs)
    whole = np.concatenate([one.inputs for one in model_set.series])
    inputs = np.tile(np.median(whole, axis=0), (count, 1))
    largest = np.max(np.abs(whole), axis=0)
    course = _interpolate(time, definition["drive"]) + _chirp(time, definition.get("sweep"))
    inputs[:, names.index(drive)] = largest[names.index(drive)] * course
    if brake is not None:
        part = _interpolate(time, definition["brake"]) if "brake" in definition else np.zeros(count)
        inputs[:, names.index(brake)] = largest[names.index(brake)] * part
    measured = np.full((count, len(model_set.output_names)), np.nan)
    measured[0] = _initial_outputs(model_set, definition["start"])
    return SampledRecording(
        name,
        model_set.period,
        Fraction(0),
        inputs,
        measured,
        model_set.series[0].is_first_order_hold,
        model_set.series[0].holds,
    )


def _interpolate(time: Reals, points: Sequence[Sequence[float]]) -> Reals:
    """Return the values at `time` on a line through points (time, value)."""
    times, values = np.array(points, dtype=float).T
    return np.asarray(np.interp(time, times, values), dtype=np.float64)


def _chirp(time: Reals, sweep: Sequence[float] | None) -> Reals:
    """Return a linear chirp (frequencies [Hz], amplitude, mean); 0 without a definition."""
    if sweep is None:
        return np.zeros(len(time))
    low, high, amplitude, mean = sweep
    rate = (high - low) / time[-1]
    phase = 2.0 * np.pi * (low + 0.5 * rate * time) * time
    return np.asarray(mean + amplitude * np.sin(phase), dtype=np.float64)


def _initial_outputs(model_set: ModelSet, part: float) -> Reals:
    """Return the recorded outputs whose first is nearest to a part of its largest."""
    rows = np.concatenate([one.measured for one in model_set.series])
    rows = rows[np.all(np.isfinite(rows), axis=1)]
    target = part * float(np.max(np.abs(rows[:, 0])))
    return np.asarray(rows[int(np.argmin(np.abs(rows[:, 0] - target)))], dtype=np.float64)
