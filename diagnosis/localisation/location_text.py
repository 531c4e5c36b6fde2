"""Location text: where physics is missing, how much, when and with what, in one sentence."""

from __future__ import annotations

from collections.abc import Sequence

from diagnosis.estimation.model_set import ModelSet
from diagnosis.estimation.place_magnitude import disturbance_unit
from diagnosis.localisation.cause import balance_of
from diagnosis.localisation.location import Location

PLACE_PHRASES = {
    "flow": "in the balance of",
    "inputs": "at the input",
    "outputs": "in the signal",
    "elements": "in the element",
}
SCALE_PHRASES = {
    "flow": "of what accelerates it",
    "elements": "of what its spring transmits",
    "outputs": "of the signal's own spread",
}
NO_LOCATION = "nothing asks for a torque or force that the model lacks"
MAX_WINDOWS = 2
MIN_CORRELATION = 0.3
"""A smaller correlation is not reported."""


def format_location(locations: Sequence[Location], model_set: ModelSet) -> str:
    """Return size, main mode, windows and correlate of the first location, or `NO_LOCATION`."""
    best = locations[0] if locations else None
    if best is None or not (best.gain > 0.0 or best.is_accepted):
        return NO_LOCATION
    section, _, place = balance_of(model_set, best.section, best.place).partition(".")
    unit = disturbance_unit(model_set, section, place)
    size = f"{best.rms:.3g} {unit}".strip() + " rms"
    if best.fraction > 0.0:
        percent = 100.0 * best.fraction
        size += f" ({percent:.2g} %" if percent < 100.0 else f" ({percent:.0f} %"
        size += f" {SCALE_PHRASES[section]})"
    parts = [size]
    if len(best.modes) > 1:
        mode = max(best.modes, key=lambda name: best.modes[name])
        parts.append(f"{100.0 * best.modes[mode]:.0f} % of it in mode {mode}")
    windows = [f"{a:.2f} to {b:.2f} s of {name}" for a, b, name in best.windows[:MAX_WINDOWS]]
    if windows:
        parts.append(f"most at {' and '.join(windows)}")
    name, correlation = best.correlates[0] if best.correlates else ("", 0.0)
    is_known = abs(correlation) >= MIN_CORRELATION
    along = f"{name} (r = {correlation:.2f})" if is_known else "no single quantity"
    parts.append(f"along with {along}")
    return f"missing {PLACE_PHRASES[best.section]} {best.place}: {', '.join(parts)}"
