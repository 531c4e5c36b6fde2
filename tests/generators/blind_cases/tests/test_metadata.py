"""What can be seen without reading the signals tells nothing about the effect."""

import itertools

import numpy as np

from tests.generators.blind_cases.case import Case
from tests.generators.blind_cases.case_specification import parse_order
from tests.generators.blind_cases.measurement import COLUMNS, ROW, csv_text
from tests.generators.blind_cases.recording import draw_seconds
from tests.generators.blind_cases.solver import Array

RECORDINGS = 13


def visible(case: Case) -> list[float]:
    """Rate, number, rows and bytes of all files: what a directory listing shows."""
    width = len(ROW % (0.0, 0.0, 0.0, 0.0, 0.0))
    rows = []
    for serial in range(RECORDINGS):
        rng = np.random.default_rng([case.seed, case.number, 4, serial, 0])
        rows.append(round(draw_seconds(rng) * case.rate))
    sizes = [len(COLUMNS) + 1 + width * count for count in rows]
    return [float(case.rate), float(case.number), *map(float, rows), *map(float, sizes)]


def nearest_is_right(features: Array, names: list[str]) -> int:
    """Leave-one-out nearest neighbour on standardised features: number of right names."""
    scaled = (features - features.mean(axis=0)) / features.std(axis=0)
    distance = ((scaled[:, None, :] - scaled[None, :, :]) ** 2).sum(axis=2)
    np.fill_diagonal(distance, np.inf)
    nearest = distance.argmin(axis=1)
    return sum(names[one] == names[other] for one, other in enumerate(nearest))


def test_the_listing_is_the_one_that_is_written() -> None:
    """The lengths used below are the recordings' own."""
    case = parse_order("all:1", 4, 1.0, None)[5]
    rows = [float(round(one.seconds * case.rate)) for one in case.recordings]
    assert visible(case)[2 : 2 + RECORDINGS] == rows


def test_nearest_neighbour_is_at_chance() -> None:
    """Not better than chance by four standard deviations, for 26 effects and for clean or not."""
    cases = parse_order("all:8,none:208", 4, 1.0, None)
    features = np.array([visible(case) for case in cases])
    names = ["+".join(case.effects) for case in cases]
    acting = [one for one, name in enumerate(names) if name]
    right = nearest_is_right(features[acting], [names[one] for one in acting])
    chance, count = 7.0 / 207.0, 208
    assert abs(right - chance * count) < 4.0 * np.sqrt(chance * (1 - chance) * count)
    right = nearest_is_right(features, [str(bool(name)) for name in names])
    assert abs(right - 208) < 4.0 * np.sqrt(0.25 * 416)


def test_the_order_of_names_is_at_chance() -> None:
    """A case's neighbour in the order of names has its effect as often as chance says."""
    names = ["+".join(case.effects) for case in parse_order("all:40", 6, 1.0, None)]
    same = sum(one == other for one, other in itertools.pairwise(names))
    expected = 39.0
    assert abs(same - expected) < 4.0 * np.sqrt(expected)


def test_numbers_have_one_width() -> None:
    """Whatever the values and signs, a row has the same length."""
    rows = np.array([[0.0, -119.75, 0.0, -88.1, 0.005], [9.4999, 249.75, 1503.0, 900.05, 99.99]])
    lines = csv_text(rows).splitlines()
    assert len(lines[1]) == len(lines[2])
    assert [float(word) for word in lines[2].split(",")] == [9.4999, 249.75, 1503.0, 900.05, 99.99]
