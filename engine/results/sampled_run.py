"""Sampled run: the protocol of sampled signals with modes and events that plots read."""

from __future__ import annotations

import fnmatch
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from language.ir.root_region import CHART

SignalArray = NDArray[np.float64] | NDArray[np.int64]
"""Samples of a signal (n_samples,): reals, or integers for modes, counters and truth values."""


@dataclass(frozen=True)
class Event:
    """Transition, range violation or invariant violation at a time [s].

    `micro_step` counts the micro-steps at that instant. A transition `to: []` of a chart has an
    empty target. For the kinds `range` and `invariant`, `transition` names the signal or invariant,
    `message` describes it, and `source` and `target` are the mode.
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
    """Samples of signals over time, as `Trajectory` has them."""

    @property
    def name(self) -> str:
        """Name of the run."""

    @property
    def times(self) -> NDArray[np.float64]:
        """Times of the samples (n_samples,) [s]."""

    @property
    def signals(self) -> Mapping[str, SignalArray]:
        """Samples of each signal (n_samples,), in SI."""

    @property
    def units(self) -> Mapping[str, str]:
        """SI unit of each signal."""

    @property
    def modes(self) -> Mapping[str, Mapping[int, str]]:
        """Names of the modes of each mode signal, by number."""

    @property
    def events(self) -> tuple[Event, ...]:
        """Transitions and violations, in the order of time."""

    @property
    def piecewise_constant(self) -> frozenset[str]:
        """Signals that change at single instants only."""


def matches_any(name: str, patterns: Sequence[str]) -> bool:
    """Return whether a name matches one of the patterns of fnmatch; True without patterns."""
    return not patterns or any(fnmatch.fnmatchcase(name, pattern) for pattern in patterns)
