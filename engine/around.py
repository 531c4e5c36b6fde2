"""Around: what surrounds a continuous automaton while it flows."""

from __future__ import annotations

from fractions import Fraction
from typing import Protocol


class Around(Protocol):
    """What surrounds a continuous automaton: who sets its inputs and who watches it."""

    is_watching: bool
    is_still: bool

    def aim(self, start: Fraction, stop: Fraction) -> None:
        """Set the inputs for a flow from `start` to `stop`."""

    def place(self, time: Fraction) -> None:
        """Set the inputs to what they are at a time of that flow."""

    def watch(self, time: Fraction) -> None:
        """See the outputs at the start of a flow, and at its end before anything jumps."""

    def look(self, time: Fraction) -> None:
        """See the outputs at a time that was asked for."""


class Alone:
    """Surroundings in which nothing changes and nobody watches."""

    is_watching = False
    is_still = True

    def aim(self, start: Fraction, stop: Fraction) -> None:
        """Leave the inputs as they are."""

    def place(self, time: Fraction) -> None:
        """Leave the inputs as they are."""

    def watch(self, time: Fraction) -> None:
        """See nothing."""

    def look(self, time: Fraction) -> None:
        """See nothing."""
