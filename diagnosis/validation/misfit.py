"""Misfit: the error of free simulation against a recording."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Misfit:
    """Root mean square errors of free simulation before and after a diagnosis.

    They are given relative to the standard deviation of the recorded signal, and in SI.
    """

    nrmse_before: float
    nrmse_after: float
    rmse_before: float
    rmse_after: float
