"""One case: what was asked for, what chance made of it, its files and its label."""

from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from tests.generators.blind_cases.effect import Numbers
from tests.generators.blind_cases.effect_catalogue import CATALOGUE, apply_effects, draw_numbers
from tests.generators.blind_cases.manoeuvre import OTHERS, TRAINING
from tests.generators.blind_cases.measurement import (
    Instruments,
    csv_text,
    draw_instruments,
    sample_rows,
)
from tests.generators.blind_cases.physical_parameters import Physics
from tests.generators.blind_cases.recording import Recording, draw_recording, simulate_motion
from tests.generators.blind_cases.true_parameters import Base, draw_base, values

HELD_OUT = 4
"""Recordings held out in each case."""
WEAKEST, STRONGEST = 0.05, 1.5
"""Strengths that an effect may have, apart from 0: the clean twin."""


@dataclass(frozen=True)
class Case:
    """What was asked for; the rest follows from seed and number, effects change no other draw."""

    seed: int
    number: int
    effects: tuple[str, ...]
    strength: float
    rate: int

    @property
    def name(self) -> str:
        """The folder's name."""
        return f"case_{self.number:04d}"

    def chance(self, matter: int) -> np.random.Generator:
        """A stream of chance of this case."""
        return np.random.default_rng([self.seed, self.number, matter])

    @cached_property
    def base(self) -> Base:
        """True values."""
        return draw_base(self.chance(0))

    @cached_property
    def instruments(self) -> Instruments:
        """Noise and quanta."""
        return draw_instruments(self.chance(1))

    @cached_property
    def numbers(self) -> dict[str, Numbers]:
        """The numbers of each effect; none at strength 0."""
        if self.strength == 0.0:
            return {}
        key = (self.seed, self.number, 2)
        return {name: draw_numbers(name, key, self.base, self.strength) for name in self.effects}

    @cached_property
    def physics(self) -> Physics:
        """The true driveline."""
        return apply_effects(self.base, list(self.numbers.values()))

    @cached_property
    def recordings(self) -> tuple[Recording, ...]:
        """Training recordings in an order by chance, then those held out."""
        rng = self.chance(3)
        others = [str(name) for name in rng.permutation(list(OTHERS))]
        train = [str(name) for name in rng.permutation([*TRAINING, others[0]])]
        plan = [("train", *one) for one in enumerate(train)]
        plan += [("held_out", *one) for one in enumerate(others[1 : 1 + HELD_OUT])]
        return tuple(
            draw_recording(part, index, kind, self.base, (self.seed, self.number, 4, serial))
            for serial, (part, index, kind) in enumerate(plan)
        )


def write_case(case: Case, folder: Path) -> dict[str, Any]:
    """Write the case's recordings below `folder`; return its label."""
    for recording in case.recordings:
        motion = simulate_motion(case.physics, recording)
        rows = sample_rows(case.instruments, recording, motion, case.rate)
        place = folder / case.name / recording.part
        place.mkdir(parents=True, exist_ok=True)
        path = place / f"rec_{recording.index:02d}.csv"
        path.write_bytes(csv_text(rows).encode("ascii"))
    return label(case)


def label(case: Case) -> dict[str, Any]:
    """All that the tool must not know."""
    instruments = case.instruments
    return {
        "effects": [
            {"id": name, "place": CATALOGUE[name].place, "parameters": parameters(case, name)}
            for name in case.numbers
        ],
        "strength": case.strength if case.effects else 0.0,
        "base": values(case.base),
        "rate_Hz": case.rate,
        "seed": case.seed,
        "number": case.number,
        "manoeuvres": manoeuvres(case),
        "noise_floor": {"w_em": instruments.w_em.sd, "w_w": instruments.w_w.sd},
    }


def parameters(case: Case, name: str) -> dict[str, Any]:
    """Numbers of the effect; for slopes, windows and heat those of each recording too."""
    found: dict[str, Any] = dict(case.numbers[name])
    for recording in case.recordings:
        place = f"{recording.part}/rec_{recording.index:02d}"
        if name == "unknown_input":
            windows = [asdict(window) for window in recording.windows]
            found.setdefault("windows", {})[place] = windows
        elif name == "road_grade":
            found.setdefault("slopes", {})[place] = asdict(recording.slope)
        elif name in ("torque_drift", "torque_derating"):
            found.setdefault("heat_start", {})[place] = recording.heat_start
    return found


def manoeuvres(case: Case) -> dict[str, list[dict[str, Any]]]:
    """Kind, length and first speed of each recording."""
    found: dict[str, list[dict[str, Any]]] = {"train": [], "held_out": []}
    for recording in case.recordings:
        found[recording.part].append(
            {
                "kind": recording.manoeuvre,
                "seconds": round(recording.seconds, 3),
                "w_w_first": recording.speed,
            }
        )
    return found
