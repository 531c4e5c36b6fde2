"""Environment of a continuous automaton: the source of its inputs and sink of its outputs."""

from __future__ import annotations

from fractions import Fraction
from typing import Protocol


class Environment(Protocol):
    """Source of the inputs and sink of the outputs of a continuous automaton.

    `has_observers` tells whether `observe_boundary` is needed, `has_constant_inputs` whether inputs
    are constant during a flow.
    """

    has_observers: bool
    has_constant_inputs: bool

    def interpolate_inputs(self, start: Fraction, stop: Fraction) -> None:
        """Set the inputs for a flow from `start` to `stop` [s]."""

    def set_inputs(self, time: Fraction) -> None:
        """Set the inputs to their values at a time [s] of the flow."""

    def observe_boundary(self, time: Fraction) -> None:
        """Read the outputs at the start of a flow, and at its end before transitions fire."""

    def sample_outputs(self, time: Fraction) -> None:
        """Record the outputs at a requested time [s]."""


class ConstantEnvironment:
    """Environment with constant inputs that records nothing."""

    has_observers = False
    has_constant_inputs = True

    def interpolate_inputs(self, start: Fraction, stop: Fraction) -> None:
        """Leave the inputs unchanged."""

    def set_inputs(self, time: Fraction) -> None:
        """Leave the inputs unchanged."""

    def observe_boundary(self, time: Fraction) -> None:
        """Do nothing."""

    def sample_outputs(self, time: Fraction) -> None:
        """Do nothing."""
