"""The order of cases: from words like `all:12,none:200` or `tyre_slip+brake_drag:2`."""

import numpy as np

from tests.generators.blind_cases.case import STRONGEST, WEAKEST, Case
from tests.generators.blind_cases.effect_catalogue import CATALOGUE, find_conflict

RATES_HZ = (100, 200, 500, 1000)


class OrderError(ValueError):
    """The order makes no sense; the message says why."""


def groups(words: str) -> list[tuple[tuple[str, ...], int]]:
    """Effects and number of cases of each group; `all` is a group for every effect."""
    found: list[tuple[tuple[str, ...], int]] = []
    for word in words.split(","):
        name, colon, digits = word.strip().partition(":")
        if not colon or not digits.isdecimal() or int(digits) < 1:
            raise OrderError(f"{word!r} is not of the form effect:number")
        count = int(digits)
        if name == "all":
            found += [((one,), count) for one in CATALOGUE]
            continue
        names = () if name == "none" else tuple(name.split("+"))
        reason = find_conflict(names)
        if reason:
            raise OrderError(f"{word!r}: {reason}")
        found.append((names, count))
    return found


def parse_order(words: str, seed: int, strength: float, rate: int | None) -> list[Case]:
    """The cases in an order by chance; within each group all rates as equal as can be."""
    if seed < 0:
        raise OrderError("the seed is negative")
    if strength != 0.0 and not WEAKEST <= strength <= STRONGEST:
        raise OrderError(f"the strength is neither 0 nor from {WEAKEST} to {STRONGEST}")
    if rate is not None and rate not in RATES_HZ:
        raise OrderError(f"the rate is none of {RATES_HZ}")
    wanted: list[tuple[tuple[str, ...], int]] = []
    for serial, (names, count) in enumerate(groups(words)):
        for index in range(count):
            wanted.append((names, rate or RATES_HZ[(serial + index) % len(RATES_HZ)]))
    if len(wanted) > 10_000:
        raise OrderError("more than 10000 cases")
    places = np.random.default_rng([seed, 0x0DE2]).permutation(len(wanted))
    return [
        Case(seed, number, wanted[place][0], strength, wanted[place][1])
        for number, place in enumerate(places)
    ]
