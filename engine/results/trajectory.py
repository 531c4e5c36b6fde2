"""Trajectory: the sampled signals, modes and events of one run."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from engine.results.sampled_run import Event, SignalArray
from language.ir.program import Program
from language.text.arguments import (
    PathTexts,
    TimeWindow,
    optional,
    to_some_texts,
    to_text,
    to_time_window,
)
from language.text.diagnostic import MissingToolError, suggest_name

if TYPE_CHECKING:
    from engine.results.plot import Picture

TIME_HEADER = "t [s]"
"""Header of the first column of a table of samples."""


@dataclass(frozen=True)
class Trajectory:
    """Samples of signals (n_samples,) in SI, and all events.

    `signals` are keyed `instance.output`; mode signals are integers, and `modes` gives their names.
    `stopped` is the reason why the run ended before the horizon, else None. `faults` are the
    latched fault bits as `instance: fault`; runs with a fault are excluded from accuracy
    measurements (rule 18). `piecewise_constant` are the signals that change at single instants
    only, such as the outputs of sampled automata. `fault_instants` gives the time and the mode at
    which each of `faults` was set first, as a text; a compiled run does not record them.
    """

    name: str
    times: NDArray[np.float64]
    signals: Mapping[str, SignalArray]
    units: Mapping[str, str]
    modes: Mapping[str, Mapping[int, str]]
    events: tuple[Event, ...]
    stopped: str | None = None
    faults: tuple[str, ...] = ()
    piecewise_constant: frozenset[str] = frozenset()
    fault_instants: Mapping[str, str] = field(default_factory=dict)

    def events_of(self, instance: str) -> tuple[Event, ...]:
        """Return the events of one instance, in the order of time.

        Raises ValueError for a name without event and without signal. A run in which the names of
        signals lack the instance, such as a replay, gives an empty tuple instead.
        """
        found = tuple(event for event in self.events if event.instance == instance)
        if not found and all("." in name for name in self.signals):
            known = {name.partition(".")[0]: None for name in self.signals}
            known.update((event.instance, None) for event in self.events)
            if known and to_text(instance, "instance") not in known:
                hint = suggest_name(instance, known) or f"instances: {', '.join(known)}"
                raise ValueError(f"no event and no signal is of an instance `{instance}`: {hint}")
        return found

    def csv(self) -> str:
        """Return the samples as CSV text with the header `column_headers`, commas and line feeds.

        Reals are the shortest decimals that read back exactly; integers have no point.
        """
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(column_headers(self))
        columns = [values.tolist() for values in (self.times, *self.signals.values())]
        writer.writerows(zip(*columns, strict=True))
        return text.getvalue()

    def frame(self) -> Any:
        """Return a pandas DataFrame indexed by time: reals in SI, modes as categories of names.

        The index is named `TIME_HEADER`; other integer signals stay integers. `attrs["units"]` has
        the units. Raises MissingToolError without pandas.
        """
        try:
            import pandas
        except ImportError:
            raise MissingToolError(
                "a frame needs the package `pandas`: pip install 'modewright[frame]'"
            ) from None
        index = pandas.Index(self.times, name=TIME_HEADER)
        columns = {
            name: pandas.Categorical.from_codes(
                np.searchsorted(sorted(self.modes[name]), values),
                [self.modes[name][number] for number in sorted(self.modes[name])],
            )
            if name in self.modes
            else values
            for name, values in self.signals.items()
        }
        frame = pandas.DataFrame(columns, index=index)
        frame.attrs["units"] = dict(self.units)
        return frame

    def plot(self, signals: PathTexts | None = None, span: TimeWindow | None = None) -> Picture:
        """Return a picture of signals by unit, modes and events (`draw_overview`).

        `signals` is a pattern such as `plant.*` or a list of patterns; None means all signals.
        `span` is the shown time [s], by default the whole run. Raises ValueError for an empty list
        and for a pattern that matches no signal.
        """
        from engine.results.plot import draw_overview

        patterns = optional(to_some_texts, signals, "signals") or ()
        return draw_overview([self], patterns, optional(to_time_window, span, "span"))


def column_headers(trajectory: Trajectory) -> list[str]:
    """Return the headers of a table of samples.

    They are `TIME_HEADER`, then `name [unit]` of each signal in the order of `signals`.
    """
    return [TIME_HEADER, *(f"{name} [{trajectory.units[name]}]" for name in trajectory.signals)]


def column_array(kind: str, values: Sequence[float | int | bool]) -> SignalArray:
    """Return the values of a signal (n_samples,): float64 if `kind` is `real`, else int64."""
    if kind == "real":
        return np.array(values, dtype=np.float64)
    return np.array(values, dtype=np.int64)


def fault_names(name: str, program: Program, word: int) -> tuple[str, ...]:
    """Return the names of the bits set in a fault word as `instance: fault`, lowest bit first.

    `name` is the instance; bit k is fault k of the Program. Other bits are ignored.
    """
    return tuple(f"{name}: {fault}" for bit, fault in enumerate(program.faults) if word >> bit & 1)
