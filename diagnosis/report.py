"""Report: a diagnosis as files - verdict, variant, figures, and one page that holds it all."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from importlib import resources
from pathlib import Path
from typing import Any

import jinja2

from diagnosis import listing, wording
from diagnosis.cards import cards_of
from diagnosis.change import changes
from diagnosis.digits import probability
from diagnosis.dossier import Dossier, verdict_json
from diagnosis.drawing import drawings_of, embedded
from diagnosis.finding import told
from diagnosis.parameter_list import astray, fixed, parameter_rows, text_of
from diagnosis.remainder import left_words, whiteness_rows
from diagnosis.rerun import SCENARIO, WINDOW, commands, made_by, scenario_text, window_table
from diagnosis.shown import Shown, shown_of
from diagnosis.sources import sources, tools
from language.known import unit_text


def report_files(dossier: Dossier, variant: str, folder: Path = Path()) -> dict[str, bytes]:
    """Return the files of a diagnosis by name, as they are in `folder`; the verdict is the last."""
    shown = shown_of(dossier)
    drawings = drawings_of(dossier, shown) if shown else []
    files = {"variant.yaml": variant.encode()}
    if dossier.diagnosis and dossier.diagnosis.description:
        formula = dossier.diagnosis.description.formula
        files[f"{formula.layer.effect.name}.yaml"] = formula.text.encode()
    for one in drawings:
        files[f"{one.name}.svg"] = one.picture.data("svg")
        files[f"{one.name}.png"] = one.picture.data("png")
    if shown:
        inputs = {n: unit_text(i.unit.dimension) for n, i in dossier.automaton.inputs.items()}
        files[WINDOW] = window_table(shown[0].window, inputs).encode()
        files[SCENARIO] = scenario_text(dossier, shown[0].window).encode()
    svg = {one.name: embedded(one, files[f"{one.name}.svg"]) for one in drawings}
    context = {
        **_about_verdict(dossier, shown),
        **_about_models(dossier, shown),
        **_about_data(dossier),
        **_about_use(dossier, folder),
        "variant": variant,
        "drawings": {one.name: one for one in drawings},
        "svg": svg,
    }
    files["report.html"] = _page(context).encode()
    verdict = json.dumps(verdict_json(dossier.verdict), indent=2, allow_nan=False) + "\n"
    files["verdict.json"] = verdict.encode()
    return files


def _about_verdict(dossier: Dossier, shown: Sequence[Shown]) -> dict[str, Any]:
    verdict, found = dossier.verdict, dossier.diagnosis
    layers = [one.layer for one in found.selection.accepted] if found else []
    return {
        "name": dossier.name,
        "about": text_of(dossier.case.document.root, "about"),
        "verdict": verdict,
        "has_model": bool(layers),
        "laid": [layer.id for layer in layers],
        "headline": listing.in_parts(wording.headline(dossier)),
        "cards": cards_of(dossier, shown[0].after if shown else ()),
        "location": wording.location(dossier) if found else "",
        "messages": verdict.messages,
        "abouts": _abouts(dossier),
        "changes": changes(dossier.case.document, layers),
        "places": listing.place_rows(verdict.location[0]) if verdict.location else [],
        "rivals": [wording.effect_at(one) for one in verdict.ambiguous_with],
        "separation": wording.separation(dossier),
        "signals": list(zip(shown[0].runs.signals, shown[0].units, strict=True)) if shown else [],
    }


def _abouts(dossier: Dossier) -> list[tuple[str, str, str]]:
    """Return name, what it is, and how it shows, of each accepted effect."""
    found = dossier.diagnosis
    accepted = found.selection.accepted if found else ()
    effects = [one.layer.effect for one in accepted]
    return [(one.name.replace("_", " "), one.about, one.signature) for one in effects]


def _about_models(dossier: Dossier, shown: Sequence[Shown]) -> dict[str, Any]:
    found = dossier.diagnosis
    if found is None:
        return {"fit": [], "candidates": [], "unfitted": [], "parameters": [], "whiteness": []}
    selection = found.selection
    one = shown[0]
    return {
        "fit": [row for s in shown for row in listing.fit_rows(dossier, s.words, s.part, s.runs)],
        "noise": listing.noise_words(selection, one.runs.signals, one.units),
        "candidates": listing.candidate_rows(dossier, selection),
        "unfitted": listing.unfitted(dossier, selection),
        "other": probability(dossier.verdict.other),
        "parameters": parameter_rows(dossier, selection),
        "astray": astray(selection),
        "whiteness": whiteness_rows(one.before, one.after, one.units, not selection.accepted),
        "whiteness_of": one.words,
        "left": left_words(one.before, one.after, not selection.accepted),
    }


def _about_data(dossier: Dossier) -> dict[str, Any]:
    return {
        "unread": dossier.diagnosis.unread if dossier.diagnosis else (),
        "findings": [(s, listing.in_parts(text)) for s, text in told(dossier.findings)],
        "recordings": listing.recording_rows(dossier),
        "untestable": listing.untestable(dossier),
        "fixed": fixed(dossier),
        "thresholds": dossier.case.thresholds,
    }


def _about_use(dossier: Dossier, folder: Path) -> dict[str, Any]:
    return {
        "commands": commands(dossier, folder),
        "made_by": made_by(dossier, folder),
        "tools": tools(),
        "sources": sources(dossier),
    }


def _page(context: Mapping[str, Any]) -> str:
    folder = resources.files("diagnosis").joinpath("templates")
    environment = jinja2.Environment(
        loader=jinja2.FunctionLoader(lambda name: folder.joinpath(name).read_text("utf-8")),
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        autoescape=True,
    )
    return environment.get_template("report.html.jinja").render(context)
