"""Company: effects that were accepted beside the first one where that acts.

They take up what its form gets wrong. Physics does come in pairs; but so does what imitates an
effect that the library lacks.
"""

from __future__ import annotations

from diagnosis.bench import Bench
from diagnosis.layers import has_parameters
from diagnosis.location import acting
from diagnosis.naming import place_path
from diagnosis.search import Tried
from diagnosis.selection import Selection


def company_of(bench: Bench, selection: Selection) -> tuple[Tried, ...]:
    """Return what was accepted beside the first effect at its place, or where that acts."""
    first, *others = selection.accepted
    return tuple(one for one in others if _where(bench, first) & _where(bench, one))


def has_hidden(selection: Selection) -> bool:
    """Tell whether an input that explains anything at all was accepted."""
    return any(not has_parameters(tried.layer) for tried in selection.accepted)


def _where(bench: Bench, tried: Tried) -> set[str]:
    section, _, place = (path := place_path(tried.layer)).partition(".")
    return {path, acting(bench, section, place)}
