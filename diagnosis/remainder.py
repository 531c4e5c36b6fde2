"""Remainder: whether what is left is noise, in words and as a table."""

from __future__ import annotations

from collections.abc import Sequence

from diagnosis.digits import per_cent, significant
from diagnosis.whiteness import Whiteness


def whiteness_rows(
    before: Sequence[Whiteness], after: Sequence[Whiteness], units: Sequence[str], is_same: bool
) -> list[tuple[str, ...]]:
    """Return a row by signal and model: size, what its past tells, lags outside, chance."""
    models = [("recalibrated", before)] if is_same else [("without", before), ("with", after)]
    rows: list[tuple[str, ...]] = []
    for k, unit in enumerate(units):
        for words, found in models:
            one = found[k]
            chance = "< 0.001" if one.chance < 0.001 else f"{one.chance:.2g}"
            rows.append(
                (
                    one.signal,
                    words,
                    f"{significant(one.rms)} {unit}",
                    per_cent(one.foretold),
                    f"{one.outside} of {len(one.lags)}",
                    chance,
                    one.words,
                )
            )
    return rows


def left_words(
    before: Sequence[Whiteness], after: Sequence[Whiteness], is_same: bool
) -> list[tuple[str, str]]:
    """Return for each signal what is left of it, in words."""
    says = {
        "white": "noise",
        "nearly white": "next to nothing but noise",
        "coloured": "not noise alone: something else is still missing, or slow",
    }
    found = []
    for old, new in zip(before, after, strict=True):
        was = "" if is_same else f" (without {per_cent(old.foretold)})"
        told = f"its past tells {per_cent(new.foretold)} of it{was}"
        found.append((new.signal, f"{says[new.words]}; {told}"))
    return found
