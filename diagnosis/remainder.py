"""Remainder: whether what is left is noise, in words and as a table."""

from __future__ import annotations

from collections.abc import Sequence

from diagnosis.digits import format_percent, format_significant
from diagnosis.whiteness import WhitenessTest


def whiteness_rows(
    before: Sequence[WhitenessTest],
    after: Sequence[WhitenessTest],
    units: Sequence[str],
    is_base_only: bool,
) -> list[tuple[str, ...]]:
    """Return a row by signal and model: size, what its past tells, lags outside, chance."""
    models = [("recalibrated", before)] if is_base_only else [("without", before), ("with", after)]
    rows: list[tuple[str, ...]] = []
    for k, unit in enumerate(units):
        for words, found in models:
            one = found[k]
            chance = "< 0.001" if one.p_value < 0.001 else f"{one.p_value:.2g}"
            rows.append(
                (
                    one.signal,
                    words,
                    f"{format_significant(one.rms)} {unit}",
                    format_percent(one.predictable_fraction),
                    f"{one.lags_outside_band} of {len(one.lags)}",
                    chance,
                    one.rating,
                )
            )
    return rows


def describe_residuals(
    before: Sequence[WhitenessTest], after: Sequence[WhitenessTest], is_base_only: bool
) -> list[tuple[str, str]]:
    """Return for each signal what is left of it, in words."""
    says = {
        "white": "noise",
        "nearly white": "next to nothing but noise",
        "coloured": "not noise alone: something else is still missing, or slow",
    }
    found = []
    for old, new in zip(before, after, strict=True):
        was = "" if is_base_only else f" (without {format_percent(old.predictable_fraction)})"
        told = f"its past tells {format_percent(new.predictable_fraction)} of it{was}"
        found.append((new.signal, f"{says[new.rating]}; {told}"))
    return found
