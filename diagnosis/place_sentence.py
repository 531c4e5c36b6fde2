"""Place sentence: where something is missing, how much, when and with what, in one sentence."""

from __future__ import annotations

from collections.abc import Sequence

from diagnosis.actor import acting
from diagnosis.bench import Bench
from diagnosis.locus import Locus
from diagnosis.scale import unit_of

PLACES = {
    "flow": "in the balance of",
    "inputs": "at the input",
    "outputs": "in the signal",
    "elements": "in the element",
}
PARTS = {
    "flow": "of what accelerates it",
    "elements": "of what its spring transmits",
    "outputs": "of the signal's own spread",
}
NOTHING = "nothing asks for a torque or force that the model lacks"
MOST_WINDOWS = 2
LOOSE = 0.3
"""A correlation below this is not told."""


def place_sentence(loci: Sequence[Locus], bench: Bench) -> str:
    """Return where something is missing, in one sentence; the first place is told."""
    best = loci[0] if loci else None
    if best is None or not (best.gain > 0.0 or best.named):
        return NOTHING
    section, _, place = acting(bench, best.section, best.place).partition(".")
    unit = unit_of(bench, section, place)
    size = f"{best.rms:.3g} {unit}".strip() + " rms"
    if best.part > 0.0:
        size += f" ({_per_cent(best.part)} {PARTS[section]})"
    parts = [size, *_when(best), *_with(best)]
    return f"missing {PLACES[best.section]} {best.place}: {', '.join(parts)}"


def _per_cent(part: float) -> str:
    return f"{100.0 * part:.2g} %" if part < 1.0 else f"{100.0 * part:.0f} %"


def _when(locus: Locus) -> list[str]:
    found = []
    mode = max(locus.modes, key=lambda name: locus.modes[name], default="")
    if len(locus.modes) > 1:
        found.append(f"{100.0 * locus.modes[mode]:.0f} % of it in mode {mode}")
    windows = [f"{a:.2f} to {b:.2f} s of {name}" for a, b, name in locus.windows[:MOST_WINDOWS]]
    if windows:
        found.append(f"most at {' and '.join(windows)}")
    return found


def _with(locus: Locus) -> list[str]:
    if not locus.along or abs(locus.along[0][1]) < LOOSE:
        return ["along with no single quantity"]
    name, correlation = locus.along[0]
    return [f"along with {name} (r = {correlation:.2f})"]
