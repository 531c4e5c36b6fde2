"""Plan: which cases of a generator are diagnosed, and why.

The clean twin of a case has the same seed at strength 0: the same manoeuvres, base values, sensors
and noise, and nothing missing.
"""

from __future__ import annotations

import random
from collections.abc import Sequence
from dataclasses import dataclass

SEED = 20270111
"""Of all cases that are concealed; a study with another one is another study. Of 20261225 thirteen
were looked at, of 20261227 more than ninety, of 20261228, 20261230 and 20270101 to 20270105 all,
of 20261231 and 20270106 to 20270110 most, and the method was changed after that."""
PAIRS = 40
"""Cases with two effects, at places of their own."""


@dataclass(frozen=True)
class Plan:
    """Cases of one kind; `effects` is in the generator's words.

    `without_own` takes the true effect out of the library before a case is diagnosed.
    """

    name: str
    effects: str
    strength: float = 1.0
    without_own: bool = False

    @property
    def is_compared(self) -> bool:
        """Whether simpler methods are asked on the same cases: those that the page tells."""
        return self.name in ("full", "clean")


def plans(pairs: Sequence[tuple[str, str]], seed: int, share: float = 1.0) -> tuple[Plan, ...]:
    """Return the plans of a study; `pairs` are the effects that can be concealed together.

    `share` makes all of it smaller alike, for a look while a method is made.
    """

    def of(count: int) -> int:
        return max(1, round(count * share))

    drawn = sorted(random.Random(seed).sample(pairs, min(of(PAIRS), len(pairs))))
    return (
        Plan("full", f"all:{of(12)}"),
        Plan("clean", f"all:{of(8)}", strength=0.0),
        Plan("weak", f"all:{of(3)}", strength=0.3),
        Plan("pairs", ",".join("+".join(pair) + ":1" for pair in drawn)),
        Plan("removed", f"all:{of(2)}", without_own=True),
    )
