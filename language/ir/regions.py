"""The name of the region that an automaton without regions has."""

from __future__ import annotations

CHART = "chart"
"""The region of the modes at the root."""
