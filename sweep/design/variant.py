"""Variant: compute the indices and the values of a variant from its number."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from sweep.definition.study import Axis, Study
from sweep.design.random_draws import draw_values

SEED_MODULUS = 2**31
"""Seeds of noise are smaller than this number."""


@dataclass(frozen=True)
class Variant:
    """One variant of a study: its indices and the values [SI] of the variables by name.

    With one-at-a-time sampling only the variable that changes has a value.
    """

    number: int
    system_variant: int
    scenario: int
    sample: int
    replicate: int
    values: dict[str, float]

    def seed(self, base: int, replicates: int, group_size: int = 1) -> int:
        """Return the seed of the noise; each sample and each replicate has its own.

        It is base + (sample // group_size) * replicates + replicate, modulo SEED_MODULUS. The
        `group_size` samples of a block or path share it, so that their differences are not due to
        noise (common random numbers; Law, Simulation Modeling and Analysis, 5th ed. 2015, section
        11.2).
        """
        return (base + self.sample // group_size * replicates + self.replicate) % SEED_MODULUS


def variants_of(study: Study, start: int, stop: int) -> list[Variant]:
    """Return the variants with numbers from `start` to `stop` (exclusive), in ascending order.

    The replicate changes fastest, then the sample, the grid (its last axis first), the scenario and
    the system variant. Hence all of these share the same samples.
    """
    samples = max(1, study.sampling.count)
    places = []
    for number in range(start, stop):
        rest, replicate = divmod(number, study.replicates)
        rest, sample = divmod(rest, samples)
        rest, grid = divmod(rest, study.grid_count)
        kind, scenario = divmod(rest, len(study.scenarios))
        places.append((number, kind, scenario, grid, sample, replicate))
    drawn = draw_values(study, [place[4] for place in places])
    return [
        Variant(number, kind, scenario, sample, replicate, {**_grid_values(study, grid), **values})
        for (number, kind, scenario, grid, sample, replicate), values in zip(
            places, drawn, strict=True
        )
    ]


def _grid_values(study: Study, place: int) -> dict[str, float]:
    """Return the values of the grid variables at a grid point; its last axis changes fastest."""
    axes = [
        (v.name, v.distribution.values)
        for v in study.grid_variables
        if isinstance(v.distribution, Axis)
    ]
    if study.sampling.one_at_a_time:
        return _one_at_a_time_values(axes, place)
    found = {}
    for name, values in reversed(axes):
        place, at = divmod(place, len(values))
        found[name] = values[at]
    return {name: found[name] for name, _ in axes}


def _one_at_a_time_values(
    axes: Sequence[tuple[str, tuple[float, ...]]], place: int
) -> dict[str, float]:
    """Return the value at a point of one-at-a-time sampling.

    Point 0 has no value; the following points have the values of the first axis, then of the next.
    """
    place -= 1
    for name, values in axes:
        if 0 <= place < len(values):
            return {name: values[place]}
        place -= len(values)
    return {}
