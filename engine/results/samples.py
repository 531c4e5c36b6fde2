"""Samples: signals over time with modes and events, as plots and comparisons read them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from language.ir.regions import CHART

if TYPE_CHECKING:
    pass

SignalArray = NDArray[np.float64] | NDArray[np.int64]


@dataclass(frozen=True)
class Event:
    """A transition: time [s], micro-step at that instant, and what changed.

    In a chart a transition `to: []` has no target: nothing is entered.
    Of another `kind` is a signal that left its range, or an invariant that ceased to hold:
    `transition` names it, `message` says how, `source` and `target` are both the mode.
    """

    time: float
    micro_step: int
    instance: str
    transition: str
    source: str
    target: str
    region: str = CHART
    kind: Literal["transition", "range", "invariant"] = "transition"
    message: str = ""


class SampledRun(Protocol):
    """Samples of signals over time, as `Trajectory` holds them: what a plot reads."""

    @property
    def name(self) -> str:
        """The name of the run."""

    @property
    def times(self) -> NDArray[np.float64]:
        """The times of the samples (n_samples,) [s]."""

    @property
    def signals(self) -> Mapping[str, SignalArray]:
        """The samples of each signal (n_samples,), in SI."""

    @property
    def units(self) -> Mapping[str, str]:
        """The SI unit of each signal."""

    @property
    def modes(self) -> Mapping[str, Mapping[int, str]]:
        """The names of the modes of each mode signal, by number."""

    @property
    def events(self) -> tuple[Event, ...]:
        """The transitions and violations, in the order of time."""
