"""Library: all effects by name, in the order in which they are applied to a case."""

from __future__ import annotations

from tests.generators.open_cases.actuator import ACTUATOR
from tests.generators.open_cases.effect import Effect
from tests.generators.open_cases.friction import FRICTION
from tests.generators.open_cases.sensor import SENSOR
from tests.generators.open_cases.shaft import SHAFT
from tests.generators.open_cases.vehicle import VEHICLE

LIBRARY: dict[str, Effect] = {
    effect.name: effect for effect in (*ACTUATOR, *FRICTION, *SHAFT, *VEHICLE, *SENSOR)
}
NONE = "none"
INDISTINCT = ("quadratic_drag",)
"""Not among `all`: to the recordings it is no more than another value of cd2."""
EXCLUSIVE = ({"added_inertia", "tyre_slip"},)
"""Each of these takes wheel and body apart in its own way."""


def parse_effects(entries: str, count: int) -> list[tuple[str, ...]]:
    """Read `a,b+c,all:3,none:30`: names of the effects of every case. Raises ValueError.

    An entry is an effect, two effects with a plus between, `all` (one case per effect) or `none`;
    a number after a colon is its count of cases, `count` where there is none.
    """
    cases: list[tuple[str, ...]] = []
    for entry in entries.split(","):
        names, colon, number = entry.strip().partition(":")
        if colon and not number.isdigit():
            raise ValueError(f"{entry!r}: the count after the colon is no number")
        kinds = (
            [(name,) for name in LIBRARY if name not in INDISTINCT]
            if names == "all"
            else [_names(names)]
        )
        cases += kinds * (int(number) if colon else count)
    return cases


def _names(entry: str) -> tuple[str, ...]:
    """Return the effects of one entry."""
    if entry == NONE:
        return ()
    names = entry.split("+")
    unknown = [name for name in names if name not in LIBRARY]
    if unknown or len(set(names)) < len(names):
        known = ", ".join(LIBRARY)
        raise ValueError(f"{entry!r} is no effect; known are none, all, {known}")
    if any(pair <= set(names) for pair in EXCLUSIVE):
        raise ValueError(f"{entry!r}: these two cannot act together")
    return tuple(names)
