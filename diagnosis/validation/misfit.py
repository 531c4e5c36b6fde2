"""Misfit: the error of free simulation against a recording."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Misfit:
    """Errors of free simulation before and after, over the signal's deviation and in SI."""

    nrmse_before: float
    nrmse_after: float
    rmse_before: float
    rmse_after: float
