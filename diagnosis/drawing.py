"""Drawing: the figures of a report, with what they say in words."""

from __future__ import annotations

import html
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from diagnosis import wording
from diagnosis.actor import acting
from diagnosis.digits import per_cent, significant
from diagnosis.dossier import Dossier
from diagnosis.locus_picture import locus_picture
from diagnosis.missing_picture import missing_picture
from diagnosis.place_sentence import PLACES
from diagnosis.plan_picture import plan_picture
from diagnosis.scale import unit_of
from diagnosis.shown import Shown
from diagnosis.shuffle_picture import shuffle_picture
from diagnosis.whiteness_picture import whiteness_picture
from diagnosis.window_picture import window_picture
from diagnosis.worst_window import WorstWindow
from engine.plot import Picture
from language.known import unit_text

HEAD = re.compile(r"^.*?<svg ", re.DOTALL)
METADATA = re.compile(r"<metadata>.*?</metadata>", re.DOTALL)
OWN_NAME = re.compile(r'(\bid="|href="#|url\(#)')
"""Where an SVG names its parts: names of several figures in one page must differ."""


@dataclass(frozen=True)
class Drawing:
    """A figure: the name of its files, its caption, and what it shows to those who see it not."""

    name: str
    caption: str
    alternative: str
    picture: Picture = field(repr=False)


def drawings_of(dossier: Dossier, shown: Sequence[Shown]) -> list[Drawing]:
    """Return the worst window of each set of recordings, what is left, and the places."""
    assert dossier.diagnosis
    is_same = not dossier.diagnosis.selection.accepted
    inputs = {name: unit_text(i.unit.dimension) for name, i in dossier.automaton.inputs.items()}
    found = []
    for one in shown:
        caption = window_words(one.window, is_same)
        picture = window_picture(one.window, inputs, is_same)
        found.append(Drawing(f"window_{one.part}", caption, caption, picture))
    found.append(_whiteness(shown[0], is_same))
    if any(locus.gain > 0.0 for locus in dossier.verdict.location):
        found.append(_places(dossier))
        found += _missing(dossier, inputs)
    found += _shuffle(dossier, shown[0])
    if dossier.diagnosis.plan is not None and dossier.diagnosis.plan.tells:
        signals = list(zip(shown[0].window.signals, shown[0].window.units, strict=True))
        caption = f"{dossier.diagnosis.plan.sentence()}; what each would show of it"
        picture = plan_picture(dossier.diagnosis.plan, inputs, signals)
        found.append(Drawing("plan", f"{caption[0].upper()}{caption[1:]}.", caption, picture))
    return found


def window_words(window: WorstWindow, is_same: bool) -> str:
    """Return how much is missed at most in a window where the models are alone."""
    alone = window.times >= window.alone
    texts = []
    for k, (name, unit) in enumerate(zip(window.signals, window.units, strict=True)):
        sizes = []
        for run in (window.before, window.after):
            missed = np.abs(window.measured[alone, k] - run[alone, k])
            sizes.append(float(np.nanmax(missed)) if np.isfinite(missed).any() else np.nan)
        text = f"{name} by up to {significant(sizes[0], 2)} {unit}"
        texts.append(text if is_same else f"{text} without, {significant(sizes[1], 2)} {unit} with")
    words = window.words[0].upper() + window.words[1:]
    return f"{words}. Left alone the model misses {'; '.join(texts)}."


def _whiteness(one: Shown, is_same: bool) -> Drawing:
    parts = []
    for before, after in zip(one.before, one.after, strict=True):
        text = f"{before.signal} {per_cent(before.foretold)}"
        parts.append(text if is_same else f"{text} without, {per_cent(after.foretold)} with")
    caption = (
        f"What is missed from one sample to the next ({one.words} recordings): its correlation "
        f"with itself a time later. Its own past tells of it: {'; '.join(parts)}; of white noise "
        "nothing."
    )
    picture = whiteness_picture(one.before, one.after, is_same)
    return Drawing("whiteness", caption, caption, picture)


def _shuffle(dossier: Dossier, shown: Shown) -> list[Drawing]:
    """Return how the frequency goes with the amplitude, where the model has another one."""
    text = wording.oscillation(dossier)
    if not text or dossier.diagnosis is None:
        return []
    found = dossier.diagnosis.shuffles
    units = dict(zip(shown.window.signals, shown.window.units, strict=True))
    caption = f"How the frequency goes with the amplitude: {text}."
    return [Drawing("shuffle", caption, caption, shuffle_picture(found, units[found[0].signal]))]


def _places(dossier: Dossier) -> Drawing:
    loci = dossier.verdict.location
    caption = "Where an unknown torque, force or error would explain most, before effects are laid"
    ranked = ", ".join(f"{one.path} {max(one.gain, 0.0):.0f}" for one in loci)
    alternative = f"{caption}, in nats: {ranked}."
    return Drawing("places", f"{caption}.", alternative, locus_picture(loci))


def _missing(dossier: Dossier, inputs: Mapping[str, str]) -> list[Drawing]:
    """Return what the base lacks over time, in the recording in which that is loud for longest."""
    best = dossier.verdict.location[0]
    if dossier.diagnosis is None or dossier.verdict.verdict == "nothing_missing":
        return []
    if not best.windows:
        return []
    bench = dossier.diagnosis.bench
    names = [one.name for one in bench.series]
    place = names.index(best.windows[0][2])
    section, _, name = acting(bench, best.section, best.place).partition(".")
    unit = unit_of(bench, section, name)
    what = f"missing {PLACES[section]} {name}"
    is_beside = best.free is not None and bool(best.free.candidate.layers)
    when = "beside the effects that were found" if is_beside else "before effects are laid"
    caption = (
        f"What is {what} over time, {when}: the unknown that would explain what is recorded in "
        f"{names[place]}, give or take three standard deviations."
    )
    series, unknown = bench.series[place], best.unknown[place]
    picture = missing_picture(best, series, unknown, what, unit, inputs)
    return [Drawing("missing", caption, caption, picture)]


def embedded(drawing: Drawing, data: bytes) -> str:
    """Return an SVG as a part of a page: with its words, its names like no other's."""
    label = html.escape(drawing.alternative, quote=True)
    text = OWN_NAME.sub(rf"\g<1>{drawing.name}-", METADATA.sub("", data.decode()))
    return HEAD.sub(f'<svg role="img" aria-label="{label}" ', text, count=1)
