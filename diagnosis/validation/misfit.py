"""The misfit between simulation and recording."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Misfit:
    """Root mean square of what free simulation misses, before and after.

    As a part of the standard deviation of the recorded signal, and in SI.
    """

    nrmse_before: float
    nrmse_after: float
    rmse_before: float
    rmse_after: float
