"""Effect output: print the library of effects."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from diagnosis.model.effect_library import EffectDescription, EquationChange, format_place_kinds
from diagnosis.model.placed_effect import place_path
from diagnosis.result.verdict import VERDICT_ALIASES


def print_effects(screen: Console, effects: Sequence[EffectDescription], at: str | None) -> None:
    """Print a table with a line for each effect.

    With the name `at` of a spec the line has the places of the effect in it, and effects without a
    place are left out; else it has the kinds of places.
    """
    table = Table(
        "effect", f"places of {at}" if at else "fits", "what it is",
        box=None, pad_edge=False, header_style="bold",
    )  # fmt: skip
    for one in effects:
        where = ", ".join(one.places) if at else format_place_kinds(one.effect)
        if where:
            table.add_row(one.effect.name, escape(where), escape(one.effect.about))
    screen.print(table)


def print_effect(screen: Console, entry: EffectDescription, at: str | None) -> None:
    """Print all information about an effect: definition, signature, confusions and references.

    With the name `at` of a spec also its places there and the changed equations of each place.
    Empty parts are left out.
    """
    effect = entry.effect
    lines = [f"{effect.name}: {effect.about}", f"fits {format_place_kinds(effect)}"]
    for name, (other, where) in VERDICT_ALIASES.items():
        if other == effect.name:
            lines.append(f"verdicts call it {name} {where}")
    if at:
        lines.append(f"in {at}: {', '.join(entry.places) or 'nowhere'}")
    lines += ["", *(f"  {line}" for line in entry.lines), ""]
    for place in entry.places:
        lines += [f"applied to {place} of {at}:", *_change_lines(entry.changes[place]), ""]
    parts = {
        "signature": effect.signature,
        "confused with": ", ".join(effect.confused_with),
        "separated by": "; ".join(effect.separated_by),
        "references": "; ".join(effect.references),
    }
    lines += [f"{name}: {text}" for name, text in parts.items() if text]
    for line in lines:
        screen.print(line, highlight=False, markup=False, soft_wrap=True)


def _change_lines(changes: Sequence[EquationChange]) -> list[str]:
    """Return the lines of changed equations."""
    found = []
    for change in changes:
        found.append(f"  {change.path}")
        found += [f"    - {change.before}"] if change.before else []
        found += [f"    + {change.after}"] if change.after else []
    return found


def effect_json(entry: EffectDescription) -> dict[str, Any]:
    """Return an effect as a dict for JSON.

    `places` and `changes` (changed equations by place) are empty if it was described without a
    spec.
    """
    effect = entry.effect
    return {
        "id": effect.name,
        "about": effect.about,
        "fits": format_place_kinds(effect),
        "lines": list(entry.lines),
        "signature": effect.signature,
        "confused_with": list(effect.confused_with),
        "separated_by": list(effect.separated_by),
        "references": list(effect.references),
        "places": [place_path(layer) for layer in entry.placements],
        "changes": {
            layer.place: [vars(change) for change in entry.changes[layer.place]]
            for layer in entry.placements
        },
    }
