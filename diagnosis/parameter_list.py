"""Parameter list: what a diagnosis did to each parameter, as texts."""

from __future__ import annotations

from dataclasses import dataclass

from diagnosis.digits import change, with_spread
from diagnosis.dossier import Dossier
from diagnosis.fit import note_of
from diagnosis.naming import quantities_of
from diagnosis.selection import Selection
from language.document import Scalar, Table

ASTRAY, CLEARLY, MOST_ASTRAY = 0.03, 3.0, 5
"""Part of a value, and standard deviations, from which recalibration was led astray; most told."""


@dataclass(frozen=True)
class ParameterRow:
    """A parameter: its values as texts, how far they are from what was declared, what it is."""

    name: str
    unit: str
    declared: str
    before: str
    after: str
    change: str
    about: str
    note: str


def parameter_rows(dossier: Dossier, selection: Selection) -> list[ParameterRow]:
    """Return each fitted parameter: declared, recalibrated, and with what was found."""
    before, after = quantities_of(selection.base), quantities_of(selection.model)
    brought = {
        layer.named(own): text_of(entry, "about")
        for layer in (tried.layer for tried in selection.accepted)
        for own, entry in _parameters(layer.effect.body)
    }
    coordinates = {one.name: one for one in selection.model.candidate.uncertain}
    rows = []
    for name, now in after.items():
        declared = dossier.automaton.parameters.get(name)
        value = None if declared is None or declared.value is None else float(declared.value)
        rows.append(
            ParameterRow(
                name,
                "" if now.unit == "1" else now.unit,
                "new" if value is None else f"{value:.5g}",
                with_spread(before[name].value, before[name].std) if name in before else "",
                with_spread(now.value, now.std),
                "" if value is None else _moved(value, now.value),
                about_of(dossier, "parameters", name) or brought.get(name, ""),
                note_of(now, coordinates[name]),
            )
        )
    return rows


def _parameters(body: Table) -> list[tuple[str, Table]]:
    table = body.get("parameters")
    entries = table if isinstance(table, Table) else ()
    return [(entry.key, entry.node) for entry in entries if isinstance(entry.node, Table)]


def astray(selection: Selection) -> str:
    """Return how far recalibration without the effects takes parameters, the farthest first."""
    before, after = quantities_of(selection.base), quantities_of(selection.model)
    found = []
    for name, one in before.items():
        now = after.get(name)
        if now is None or now.value <= 0.0 or one.value <= 0.0:
            continue
        part = one.value / now.value - 1.0
        if abs(part) >= ASTRAY and abs(one.value - now.value) > CLEARLY * now.std:
            found.append((abs(part), f"{name} {change(now.value, one.value)}"))
    return ", ".join(text for _, text in sorted(found, reverse=True)[:MOST_ASTRAY])


def _moved(declared: float, now: float) -> str:
    return change(declared, now) if declared > 0.0 else ""


def about_of(dossier: Dossier, section: str, name: str) -> str:
    """Return what the spec says a parameter, input or state is; empty where it says nothing."""
    table = dossier.case.document.root.get(section)
    entry = table.get(name) if isinstance(table, Table) else None
    return text_of(entry, "about") if isinstance(entry, Table) else ""


def text_of(table: Table, key: str) -> str:
    """Return the text of a key; empty where there is none."""
    node = table.get(key)
    return node.text if isinstance(node, Scalar) else ""


def fixed(dossier: Dossier) -> list[str]:
    """Return the parameters that have no range, with their values: they were taken as exact."""
    return [
        f"{name} = {float(one.value):.5g}"
        for name, one in dossier.automaton.parameters.items()
        if one.range is None and one.value is not None and one.type == "real"
    ]
