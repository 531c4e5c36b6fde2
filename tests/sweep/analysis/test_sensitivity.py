"""Indices of sensitivity against closed forms and SALib."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from SALib.analyze import morris as salib_morris, sobol as salib_sobol

from engine.results.array_types import Reals
from language.text.diagnostic import SpecError
from sweep.analysis.sensitivity import (
    Index,
    elementary_effects,
    morris_indices,
    sensitivity_of,
    sobol_indices,
)
from sweep.definition.study import MORRIS_LEVELS, Study
from sweep.design.random_draws import draw_values
from sweep.design.sensitivity_design import STRIDE, morris_points
from sweep.evaluation.exact_moments import scale_to_squarable
from sweep.execution.study_run import run_study
from sweep.store.store import read_store
from tests.sweep.example_studies import QUICK_EXECUTOR, ReversedExecutor, make_study, store_rows

A, B = 7.0, 0.1
DRAWN = "  x_1: {uniform: [0.5 m, 1.5 m]}"
RANDOM = "sampling: {random: 4, seed: 3}"


def designed(method: str) -> Study:
    return make_study("grid", (RANDOM, f"sampling: {{{method}, seed: 3}}"))


def ishigami(shares: Reals) -> Reals:
    """Ishigami and Homma 1990: x between -pi and pi (n, 3)."""
    x = -math.pi + 2.0 * math.pi * shares
    found = np.sin(x[:, 0]) + A * np.sin(x[:, 1]) ** 2 + B * x[:, 2] ** 4 * np.sin(x[:, 0])
    return np.asarray(found)


def blocks(count: int) -> Reals:
    from scipy.stats import qmc

    both = qmc.Sobol(6, seed=1).random(count)
    parts = [both[:, :3], both[:, 3:]]
    for k in range(3):
        mixed = both[:, :3].copy()
        mixed[:, k] = both[:, 3 + k]
        parts.append(mixed)
    return np.stack([ishigami(part) for part in parts], axis=1)


def test_indices_of_the_ishigami_function_are_those_of_its_closed_form() -> None:
    found = sobol_indices(blocks(1 << 13))
    eighth = B * math.pi**4
    variance = A**2 / 8 + eighth / 5 + eighth**2 / 18 + 0.5
    one, two = 0.5 * (1 + eighth / 5) ** 2, A**2 / 8
    both = eighth**2 * (1 / 18 - 1 / 50)
    assert found["first"] == pytest.approx([one / variance, two / variance, 0.0], abs=5e-3)
    total = [(one + both) / variance, two / variance, both / variance]
    assert found["total"] == pytest.approx(total, abs=5e-3)


def test_indices_are_those_of_salib() -> None:
    results = blocks(256)
    order = [0, 2, 3, 4, 1]  # SALib: A, A with a column of B ..., B
    problem = {"num_vars": 3, "names": ["a", "b", "c"], "bounds": [[0, 1]] * 3}
    theirs = salib_sobol.analyze(problem, results[:, order].reshape(-1), calc_second_order=False)
    ours = sobol_indices(results)
    assert ours["total"] == pytest.approx(theirs["ST"], rel=1e-9)
    assert ours["first"] == pytest.approx(theirs["S1"], abs=2e-2)  # they norm by A and B and mixed


def test_elementary_effects_are_those_of_salib() -> None:
    shares = morris_points(3, np.arange(4 * 40), 5)
    assert set(np.unique(shares)) == {0.125, 0.375, 0.625, 0.875}
    results = ishigami(shares)
    effects = elementary_effects(results.reshape(40, 4), shares.reshape(40, 4, 3))
    ours = morris_indices(effects)
    problem = {"num_vars": 3, "names": ["a", "b", "c"], "bounds": [[0, 1]] * 3}
    levels = (shares * MORRIS_LEVELS - 0.5) / (MORRIS_LEVELS - 1)
    theirs = salib_morris.analyze(problem, levels, results, num_levels=MORRIS_LEVELS)
    scale = (MORRIS_LEVELS / (2 * (MORRIS_LEVELS - 1))) / (STRIDE / MORRIS_LEVELS)
    for name in ("mu_star", "mu", "sigma"):
        assert ours[name] == pytest.approx(scale * np.asarray(theirs[name], float), rel=1e-9)


def test_a_point_of_a_design_follows_from_its_number_alone() -> None:
    for method, count in (("saltelli: 8", 8 * 4), ("morris: 6", 6 * 3)):
        made = designed(method)
        assert made.sampling.count == count
        whole = draw_values(made, range(count))
        alone = [draw_values(made, [k])[0] for k in range(count)]
        assert whole == alone


def test_indices_are_made_from_a_store_of_each_point_of_the_grid(tmp_path: Path) -> None:
    made = designed("saltelli: 4")
    run_study(made, tmp_path / "a", ReversedExecutor(), block_size=7)
    assert len(store_rows(read_store(tmp_path / "a"))) == made.count == 15 * 16
    found = sensitivity_of(read_store(tmp_path / "a"))
    assert (found.method, len(found.indices)) == ("saltelli", 15 * 2 * 6)
    some = [i for i in found.indices if i.measure == "final"]
    assert {i.name for i in some} == {"x_1", "inputs.push.steps.1"}
    assert all(i.used == i.count == 4 and set(i.group) == {"w", "d"} for i in some)
    assert found.csv().splitlines()[0].startswith("w,d,measure,unit,name,first,total,first_from,")
    assert len(found.csv().splitlines()) == 1 + len(found.indices)


def test_points_that_are_no_design_have_no_indices(tmp_path: Path) -> None:
    run_study(make_study(), tmp_path, QUICK_EXECUTOR)
    with pytest.raises(SpecError, match="no design of which indices are made"):
        sensitivity_of(read_store(tmp_path))


CHOSEN = ("x_1: {uniform: [0.5 m, 1.5 m]}", "x_1: {choice: [1 m, 20 m], weights: [1, 9]}")
IDLE = ("set: {x_0: x_1}", "set: {x_0: x_1 + 0 * idle}")
DRAWN_IDLE = ("  inputs.push", "  idle: {uniform: [0 m, 1 m]}\n  inputs.push")


def indices_of(folder: Path, design: str, *changes: tuple[str, str]) -> dict[str, Index]:
    """Return those of `final` at the first point of the grid, by name: half of a sum with noise."""
    made = make_study("grid", (RANDOM, f"sampling: {{{design}, seed: 3}}"), *changes)
    run_study(made, folder, QUICK_EXECUTOR)
    found = sensitivity_of(read_store(folder)).indices
    group = found[0].group
    return {i.name: i for i in found if i.group == group and i.measure == "final"}


def test_a_step_that_draws_the_same_value_again_has_no_effect(tmp_path: Path) -> None:
    """A choice of two, one of them in 9 of 10: no level draws the other, so nothing is known."""
    found = indices_of(tmp_path / "a", "morris: 20", CHOSEN)
    assert all(math.isnan(found["x_1"].values[k]) for k in ("mu_star", "mu", "sigma"))
    assert set(found["x_1"].intervals.values()) == {None}
    assert found["inputs.push.steps.1"].values["mu_star"] > 0.0
    even = (
        CHOSEN[0],
        CHOSEN[1].replace("[1, 9]", "[1, 3]"),
    )  # one level of four: half of all steps
    found = indices_of(tmp_path / "b", "morris: 20", even)
    shares = morris_points(2, np.arange(60), 3).reshape(20, 3, 2)
    changed = (shares[:, :, 0].min(axis=1) < 0.25).mean()
    assert 0.2 < changed < 0.8
    assert found["x_1"].values["mu_star"] == pytest.approx(changed * (19.0 / 2.0) / 0.5)
    assert found["x_1"].values["mu"] == pytest.approx(changed * (19.0 / 2.0) / 0.5)


@pytest.mark.parametrize("design", ["morris: 16", "saltelli: 16"])
def test_what_has_no_influence_is_not_blamed_for_noise(design: str, tmp_path: Path) -> None:
    """The runner adds a number that the seed makes to each result: all of a path have one."""
    found = indices_of(tmp_path, design, IDLE, DRAWN_IDLE)["idle"]
    assert set(found.values.values()) == {0.0}
    assert all(interval == (0.0, 0.0) for interval in found.intervals.values())
    rows = store_rows(read_store(tmp_path))
    each = 4 if "morris" in design else 5
    seeds = {(row["sample"] // each, row["seed"]) for row in rows}  # type: ignore[operator]
    assert len(seeds) == 16 == len({seed for _, seed in seeds})


def test_replicates_of_a_point_have_noise_of_their_own_and_all_of_them_count(
    tmp_path: Path,
) -> None:
    found = indices_of(tmp_path, "morris: 5", ("set:", "replicates: 3\nset:"))
    assert all(i.used == i.count == 5 for i in found.values())
    rows = store_rows(read_store(tmp_path))
    seeds = {(r["sample"] // 3, r["replicate"], r["seed"]) for r in rows}  # type: ignore[operator]
    assert len(seeds) == 15
    assert {seed for _, _, seed in seeds} == set(range(15))


def test_indices_of_the_largest_numbers_are_told(recwarn: pytest.WarningsRecorder) -> None:
    """Shares of a variance have no unit: those of a measure of 1e300 are those of one of 1."""
    results = np.random.default_rng(1).normal(size=(64, 4))
    plain, large = (
        sobol_indices(scale_to_squarable(results)[0]),
        sobol_indices(scale_to_squarable(1.0e300 * results)[0]),
    )
    for name in plain:
        np.testing.assert_allclose(large[name], plain[name], rtol=1e-12)
    assert not recwarn.list
