"""Contact: what the charts of the rivals in Python read and count, as their user would write it."""

from __future__ import annotations

WAIT = 5
"""Ticks for which a guard must hold after the first one at which it does."""


class Contact:
    """Guards over the inputs of a tick; the two waits are counters, and so are transitions."""

    def __init__(self) -> None:
        """Start without having waited."""
        self.theta = self.torque = 0.0
        self.high = self.low = self.fired = 0

    def is_driven(self) -> bool:
        """Tell whether the upper end was held for the wait."""
        self.high = self.high + 1 if self.theta >= 0.02 else 0
        return self.high > WAIT

    def is_coasted(self) -> bool:
        """Tell whether the lower end was held for the wait."""
        self.low = self.low + 1 if self.theta <= -0.02 else 0
        return self.low > WAIT

    def pulls_back(self) -> bool:
        """Tell whether the drive contact ends."""
        return self.torque < -1.0

    def pushes(self) -> bool:
        """Tell whether the coast contact ends."""
        return self.torque > 1.0

    def switch(self) -> None:
        """A transition: waits start anew."""
        self.high = self.low = 0
        self.fired += 1
