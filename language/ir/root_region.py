"""Root region: the name of the root region, which is the only region of most automata."""

from __future__ import annotations

CHART = "chart"
"""Name of the region of the modes at the root."""
