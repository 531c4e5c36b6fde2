"""The shipped studies: the nominal variant is the tip-out of the paper."""

from __future__ import annotations

from pathlib import Path

import pytest

from engine.batch.interpreted_batch import run_interpreted_batch
from language.overlays.expand_document import Project, read_document
from sweep.definition.study import Study, Target
from sweep.definition.study_reader import read_study
from sweep.design.variant import variants_of
from sweep.design.variant_values import variant_values_of
from sweep.execution.block_computation import compute_rows
from sweep.execution.prepare_study import prepare_study
from sweep.store.row import Block

ROOT = Path(__file__).parents[3]


def shipped(name: str) -> Study:
    project = Project(ROOT)
    return prepare_study(read_study(read_document(project.path_of(name)), project))


def test_the_nominal_variant_has_the_events_and_the_delay_of_table_1() -> None:
    (row,) = compute_rows(shipped("tip_out_stiffness_and_gap"), Block(7, 8), run_interpreted_batch)
    assert row.values == {"k_hs": 4800.0, "alpha": 0.0256}
    assert row.measures["t_loss"] == pytest.approx(0.5060139445701604, abs=1e-8)
    assert row.measures["losses"] == 5
    assert row.measures["late"] == pytest.approx(1.986e-3, abs=1e-5)
    assert row.measures["gaps.missed"] == row.measures["gaps.false_events"] == 0


def test_a_matched_variant_of_the_random_tip_outs_has_the_estimators_model() -> None:
    made = shipped("random_tip_outs")
    matched, wrong = (variant_values_of(made, variants_of(made, k, k + 1)[0]) for k in (0, 128))
    k_hs, m = Target("parameter", ("plant", "k_hs")), Target("parameter", ("plant", "m"))
    assert (matched.values[k_hs], matched.values[m]) == (4800.0, 1250.0)
    assert wrong.values[k_hs] == pytest.approx(4800.0 * (1.0 + wrong.variant.values["e_k"]))
    assert matched.variant.values["T_0"] == wrong.variant.values["T_0"]  # the same manoeuvre
    twist = matched.values[Target("initial", ("plant", "theta_d"))]
    pull = matched.values[Target("input", ("T_req", "start"))]
    assert twist == pytest.approx(0.0256 + 0.95 * pull * 8.1 / 4800.0)
    assert matched.seed == 0 and wrong.seed == 0


def test_periods_and_samples_follow_one_name() -> None:
    made = shipped("tip_out_at_random_phases")
    case = variant_values_of(made, variants_of(made, 150, 151)[0])
    found = {target.path: value for target, value in case.structural_values}
    assert found["est", "period"] == found["s_em", "period"] == found["s_w", "period"] == 1.0e-4
    assert 0.4785 < found["T_req", "times", "1"] < 0.4885
