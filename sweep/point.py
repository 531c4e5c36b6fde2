"""Point: which variant a number means - a pure function of the study and the number."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from sweep.draw import drawn_values
from sweep.study import Axis, Study

LARGEST_SEED = 2**31


@dataclass(frozen=True)
class Point:
    """One variant: places in the lists of the study, and the values [SI] of what varies.

    What is left alone (`sampling: one_at_a_time`) has no value.
    """

    number: int
    kind: int
    scenario: int
    sample: int
    replicate: int
    values: dict[str, float]

    def seed(self, base: int, replicates: int, each: int = 1) -> int:
        """Return the seed of the noise: each sample and each replicate has noise of its own.

        `each` samples of one block or path share it: their differences are not those of noise
        (common random numbers; Law, Simulation Modeling and Analysis, 5th ed. 2015, section 11.2).
        """
        return (base + self.sample // each * replicates + self.replicate) % LARGEST_SEED


def points_of(study: Study, start: int, stop: int) -> list[Point]:
    """Return the variants from `start` to before `stop`.

    The replicate runs fastest, then the sample, the grid (its last axis first), the scenario and
    the variant: so all of these see the same samples.
    """
    samples = max(1, study.sampling.count)
    places = []
    for number in range(start, stop):
        rest, replicate = divmod(number, study.replicates)
        rest, sample = divmod(rest, samples)
        rest, grid = divmod(rest, study.grid_count)
        kind, scenario = divmod(rest, len(study.scenarios))
        places.append((number, kind, scenario, grid, sample, replicate))
    drawn = drawn_values(study, [place[4] for place in places])
    return [
        Point(number, kind, scenario, sample, replicate, {**_on_grid(study, grid), **values})
        for (number, kind, scenario, grid, sample, replicate), values in zip(
            places, drawn, strict=True
        )
    ]


def _on_grid(study: Study, place: int) -> dict[str, float]:
    axes = [(v.name, v.course.values) for v in study.axes if isinstance(v.course, Axis)]
    if study.sampling.one_at_a_time:
        return _alone(axes, place)
    found = {}
    for name, values in reversed(axes):
        place, at = divmod(place, len(values))
        found[name] = values[at]
    return {name: found[name] for name, _ in axes}


def _alone(axes: Sequence[tuple[str, tuple[float, ...]]], place: int) -> dict[str, float]:
    """The first point has all left alone; then each value of each axis."""
    place -= 1
    for name, values in axes:
        if 0 <= place < len(values):
            return {name: values[place]}
        place -= len(values)
    return {}
