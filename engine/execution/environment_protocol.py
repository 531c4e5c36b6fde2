"""Around: what surrounds a continuous automaton while it flows."""

from __future__ import annotations

from fractions import Fraction
from typing import Protocol


class Environment(Protocol):
    """What surrounds a continuous automaton: who sets its inputs and who watches it."""

    has_observers: bool
    has_constant_inputs: bool

    def interpolate_inputs(self, start: Fraction, stop: Fraction) -> None:
        """Set the inputs for a flow from `start` to `stop`."""

    def set_inputs(self, time: Fraction) -> None:
        """Set the inputs to what they are at a time of that flow."""

    def observe_boundary(self, time: Fraction) -> None:
        """See the outputs at the start of a flow, and at its end before anything jumps."""

    def sample_outputs(self, time: Fraction) -> None:
        """See the outputs at a time that was asked for."""


class ConstantEnvironment:
    """Surroundings in which nothing changes and nobody watches."""

    has_observers = False
    has_constant_inputs = True

    def interpolate_inputs(self, start: Fraction, stop: Fraction) -> None:
        """Leave the inputs as they are."""

    def set_inputs(self, time: Fraction) -> None:
        """Leave the inputs as they are."""

    def observe_boundary(self, time: Fraction) -> None:
        """See nothing."""

    def sample_outputs(self, time: Fraction) -> None:
        """See nothing."""
