"""What no effect explains becomes a formula of the language, at its place and with its units."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.equation.discovery import discover_equation
from diagnosis.equation.effect_text import build_formula
from diagnosis.equation.forward_regression import (
    RegressionProblem,
    TermColumns,
    build_problem,
    coefficients_of,
    rank_terms,
    select_terms,
)
from diagnosis.equation.regression_problem import regression_at
from diagnosis.equation.term_library import ORDERS, LibraryTerm, Signals, generate_terms
from diagnosis.estimation.model_set import ModelSet
from diagnosis.localisation.location import Location
from diagnosis.model.placed_effect import automaton_with_effects
from diagnosis.selection.comparison import compare_candidates
from tests.diagnosis.estimation.test_levenberg_marquardt import FRICTION, bench
from tests.diagnosis.localisation.test_ranking import fit_first_base, with_effect

__all__ = ["bench"]


def problem(noise: float) -> tuple[RegressionProblem, list[TermColumns]]:
    """Two recordings: parameters, a shared column 2, a sine with phases 1.0 and -0.5, chance."""
    rng = np.random.default_rng(5)
    time = np.arange(800) * 0.01
    moved = [rng.normal(size=(800, 2)) for _ in range(2)]
    shared = [rng.normal(size=800) for _ in range(2)]
    waves = [np.column_stack([x, np.sin(9 * time), np.cos(9 * time)]) for x in shared]
    known = [
        2.0 * x + 3.0 * np.sin(9 * time + phase) + noise * rng.normal(size=800) + m[:, 0]
        for x, m, phase in zip(shared, moved, (1.0, -0.5), strict=True)
    ]
    columns = [TermColumns("shared", (2,), False), TermColumns("sine", (3, 4), True)]
    return build_problem(known, moved, waves, 1.0), columns


def test_terms_come_one_after_the_other_with_their_coefficients() -> None:
    given, columns = problem(0.5)
    chosen = select_terms(given, columns, 2, 20.0)
    assert [one.name for _, one in chosen] == ["sine", "shared"]
    assert chosen[1][0] > 500.0
    sine, shared = coefficients_of(given, [one for _, one in chosen])
    assert shared[:, 0] == pytest.approx(2.0, abs=0.1)
    assert np.hypot(*sine.T) == pytest.approx(3.0, abs=0.1)
    assert np.arctan2(sine[:, 1], sine[:, 0]) == pytest.approx([1.0, -0.5], abs=0.05)


def test_what_is_all_chance_is_no_term() -> None:
    rng = np.random.default_rng(6)
    parts = [rng.normal(size=800) for _ in range(2)]
    waves = [rng.normal(size=(800, 20)) for _ in range(2)]
    given = build_problem(parts, [rng.normal(size=(800, 2)) for _ in range(2)], waves, 1.0)
    columns = [TermColumns(f"{k}", (2 + k,), False) for k in range(20)]
    assert select_terms(given, columns, 2, 5.0) == []


def signals(bench: ModelSet) -> Signals:
    rng = np.random.default_rng(1)
    names = ("w_em", "w_w", "T_em", "T_hs", "(theta_d - theta_b)")
    units = dict(zip(names, ("rad/s", "rad/s", "N*m", "N*m", "rad"), strict=True))
    values = {name: [rng.normal(size=50)] for name in names}
    return Signals(values, units, names[:2], names[2:4], names[4:], ("w_w",), 0.005)


@pytest.mark.parametrize(
    ("section", "place"), [("flow", "w_em"), ("elements", "half_shaft"), ("outputs", "w_s")]
)
def test_all_terms_together_are_a_sound_effect_with_units_of_their_own(
    bench: ModelSet, section: str, place: str
) -> None:
    known = signals(bench)
    if section == "outputs":
        known.values["w_s"] = known.values["w_w"]  # type: ignore[index]
        known.units["w_s"] = "rad/s"  # type: ignore[index]
    terms = [one for one in generate_terms(known, section, "w_s") if one.order in (0, ORDERS[2])]
    units = set()
    for some in (terms[k : k + 14] for k in range(0, len(terms), 14)):
        sizes = [np.ones((3, len(term.values))) for term in some]
        formula = build_formula(bench, section, place, some, sizes)
        made = automaton_with_effects(bench.document, bench.project, [formula.placed_effect])
        brought = [name for name in made.parameters if name.startswith("a_")]
        assert len(brought) == len(some)
        units |= {made.parameters[name].unit.text for name in brought}
    expected = {"flow": {"N*m", "1", "N*m*s"}, "elements": {"N*m", "1"}, "outputs": {"rad/s", "1"}}
    assert expected[section] <= units


def test_an_order_of_a_torque_is_written_with_a_phase_for_each_recording(bench: ModelSet) -> None:
    term = next(
        one
        for one in generate_terms(signals(bench), "elements")
        if one.name == "T_hs times order 3 of the angle of w_w"
    )
    assert isinstance(term, LibraryTerm)
    size = np.array([[0.2 * np.cos(p), 0.2 * np.sin(p)] for p in (0.4, -1.0)])
    formula = build_formula(bench, "elements", "half_shaft", [term], [size])
    assert "a_1 * base * sin((turns_1 - floor(turns_1)) * 1 rev)" in formula.text
    assert "ph_1: {value: 0 rad, range: [-3.2, 3.2], per: recording}" in formula.text
    assert formula.initial_values["a_1_half_shaft"] == pytest.approx(0.2)
    assert formula.phases["ph_1_half_shaft"] == pytest.approx((0.4, -1.0))


@pytest.mark.long
def test_a_friction_without_a_name_becomes_its_formula(
    bench: ModelSet, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("diagnosis.equation.discovery.MAX_FITS", 1)
    hidden = with_effect(bench, "coulomb_friction@w_em", FRICTION)
    base = fit_first_base(hidden)
    excess = regression_at(hidden, base, "flow", "w_em")
    assert rank_terms(excess.problem, excess.columns)[0][1].name == "the sign of w_em"
    compared = compare_candidates(hidden, base, ())
    locus = Location("flow", "w_em", 100.0, 2.0, free_model=base)
    found = discover_equation(hidden, compared, [locus], 45.0)
    assert found is not None
    amount, rest = found.text.split(" N*m * ")
    assert float(amount) == pytest.approx(-FRICTION["T_c_w_em"], rel=0.15)
    assert rest.startswith("tanh(w_em / (")
    assert found.gain > 100.0
    assert found.share > 0.9
