"""Draws: any sample without those before it, the same each time, from the named distribution."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats
from scipy.stats import qmc

from sweep.definition.study import Distribution
from sweep.design.random_draws import draw_values, quantile
from sweep.design.variant import variants_of
from tests.sweep.example_studies import make_study

SHARES = np.array([0.001, 0.25, 0.5, 0.75, 0.999])


@pytest.mark.parametrize("method", ["random", "latin_hypercube", "sobol"])
def test_a_block_has_the_samples_that_it_has_in_the_whole(method: str) -> None:
    made = make_study("grid", ("{random: 4, seed: 3}", f"{{{method}: 64, seed: 3}}"))
    whole = draw_values(made, range(64))
    assert draw_values(made, range(13, 29)) == whole[13:29]
    assert draw_values(made, [40, 3, 3, 63]) == [whole[40], whole[3], whole[3], whole[63]]
    assert len({tuple(sample.values()) for sample in whole}) == 64


def test_names_have_streams_of_their_own_and_seeds_make_others() -> None:
    first = draw_values(make_study(), [0, 1])
    other = draw_values(make_study("grid", ("seed: 3", "seed: 4")), [0, 1])
    fewer = draw_values(
        make_study(
            "grid",
            ("  inputs.push.steps.1: {normal: [0 m/s^2, 0.2 m/s^2], within: [-0.5, 0.5]}\n", ""),
        ),
        [0, 1],
    )
    assert first[0]["x_1"] != other[0]["x_1"]
    assert [sample["x_1"] for sample in fewer] == [sample["x_1"] for sample in first]


def test_sequences_are_those_of_scipy() -> None:
    made = make_study("grid", ("{random: 4, seed: 3}", "{sobol: 8, seed: 5}"))
    shares = qmc.Sobol(d=2, scramble=True, seed=5).random(8)[:, 0]
    found = [sample["x_1"] for sample in draw_values(made, range(8))]
    assert found == pytest.approx((0.5 + shares).tolist(), abs=1e-15)


@pytest.mark.parametrize(
    ("course", "truth"),
    [
        (Distribution("uniform", (2.0, 6.0)), stats.uniform(2.0, 4.0)),
        (Distribution("log_uniform", (0.1, 10.0)), stats.loguniform(0.1, 10.0)),
        (Distribution("normal", (1.0, 0.5)), stats.norm(1.0, 0.5)),
        (Distribution("lognormal", (3.0, 0.4)), stats.lognorm(0.4, scale=3.0)),
        (Distribution("normal", (1.0, 0.5), (0.8, 2.0)), stats.truncnorm(-0.4, 2.0, 1.0, 0.5)),
    ],
)
def test_quantiles_are_those_of_scipy(course: Distribution, truth: stats.rv_continuous) -> None:
    np.testing.assert_allclose(quantile(course, SHARES), truth.ppf(SHARES), rtol=1e-12)


def test_choices_come_by_their_weights() -> None:
    course = Distribution("choice", (1.0, 2.0, 3.0), weights=(1.0, 2.0, 1.0))
    assert quantile(course, np.array([0.0, 0.24, 0.26, 0.74, 0.76, 0.99])).tolist() == [
        1.0, 1.0, 2.0, 2.0, 3.0, 3.0,
    ]  # fmt: skip


def test_the_last_axis_runs_fastest_and_all_see_the_same_samples() -> None:
    made = make_study("grid", ("sampling:", "replicates: 2\nsampling:"))
    assert made.count == 5 * 3 * 4 * 2
    points = variants_of(made, 0, made.count)
    assert [p.number for p in points] == list(range(120))
    assert [(p.sample, p.replicate) for p in points[:3]] == [(0, 0), (0, 1), (1, 0)]
    assert [(p.values["w"], p.values["d"]) for p in points[0:24:8]] == [
        (1.0, 0.1), (1.0, 0.2), (1.0, 0.4),
    ]  # fmt: skip
    assert {p.values["x_1"] for p in points} == {p.values["x_1"] for p in points[:8]}
    assert variants_of(made, 55, 61) == points[55:61]
    assert [p.seed(0, 2) for p in points[:9]] == [0, 1, 2, 3, 4, 5, 6, 7, 0]


def test_one_at_a_time_leaves_all_others_alone() -> None:
    made = make_study("alone")
    assert [p.values for p in variants_of(made, 0, made.count)] == [
        {}, {"w": 1.0}, {"w": 3.0}, {"d": 0.05}, {"d": 0.3},
    ]  # fmt: skip
