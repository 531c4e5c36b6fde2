"""The paper's claims hold, and those of the better observer, on a few manoeuvres."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

import modewright as mw
from tests.validation.evidence.evidence_store import ROOT
from tests.validation.paper.claims import quick_claims
from tests.validation.paper.paper_figures import FIGURES
from tests.validation.paper.report_page import FOLDER, PAGE, is_current

REMADE = "docs/paper belongs to other specs: make paper"


@pytest.mark.long
def test_what_the_paper_says_of_its_figures_holds() -> None:
    found = quick_claims()
    assert {claim.figure for claim in found} == {*FIGURES, "Table 1"} - {"fig_3", "fig_5"}
    assert [claim.figure for claim in found if not claim.holds] == []


def test_the_page_belongs_to_the_specs() -> None:
    """Models are fitted where the page is made: it says where a claim does not hold."""
    page = PAGE.read_text("utf-8")
    assert is_current(page), REMADE
    assert "this differs" not in page
    missing = [name for name in (*FIGURES, "pareto") if not (FOLDER / f"{name}.png").exists()]
    assert missing == []


@pytest.mark.parametrize(("method", "limit"), [("euler", "0.002942"), ("rk4", "0.00812")])
def test_the_model_does_not_run_at_10_ms(tmp_path: Path, method: str, limit: str) -> None:
    """Euler in contact: 2 zeta / w_n, near c/k; RK4 in the gap: 2.785 c/k, c/k = 2.917 ms."""
    spec = tmp_path / "spec"
    shutil.copytree(ROOT / "spec" / "ev_driveline", spec)
    (spec / "slow.yaml").write_text(
        "language: 1\nvariant: slow\nextends: estimator\nperiod: 10 ms\n"
        f"modes: {{gap: {{runs: {{method: {method}}}}}}}\n"
    )
    told = [problem for problem in mw.check("slow", root=tmp_path) if problem.kind == "stability"]
    assert told and limit in f"{told[0].label} {told[0].help}"


def test_the_brake_reaches_vehicle_and_estimator(tmp_path: Path) -> None:
    """A brake of 300 N*m, which the paper never uses: known to the filter, or it is misled."""
    told, slowed = with_brake(tmp_path / "told", "T_br")
    not_told, _ = with_brake(tmp_path / "not_told", "0 N*m")
    assert slowed < 0.0
    assert told < 2.0 < not_told


def with_brake(folder: Path, seen: str) -> tuple[float, float]:
    """Return how far the torque of the half-shafts is off [N*m], and der(w_w) [rad/s^2]."""
    spec = folder / "spec"
    shutil.copytree(ROOT / "spec" / "ev_driveline", spec)
    system = (spec / "system_ideal.yaml").read_text()
    system = system.replace("ev_driveline_ideal", "braked")
    system = system.replace("inputs:\n", "inputs:\n  T_br: {unit: N*m}\n", 1)
    system = system.replace("  plant.T_em", f"  plant.T_br: T_br\n  est.T_br: {seen}\n  plant.T_em")
    (spec / "braked.yaml").write_text(system)
    (spec / "brake.yaml").write_text(
        "language: 1\nscenario: brake\nof: braked\nhorizon: 1.5 s\n"
        "initial: {plant.w_w: 40 km/h / 0.29 m, plant.theta_d: 0.074 rad}\n"
        "inputs: {T_req: 30 N*m, T_br: {start: 0 N*m, steps: {0.5 s: 300 N*m}}}\n"
        "record: {every: 1 ms}\n"
    )
    run = mw.simulate("braked", "brake", root=folder)
    late = run.times > 0.6
    wrong = (run.signals["est.T_hs"] - run.signals["plant.T_hs"])[late]
    slope = np.polyfit(run.times[late], run.signals["plant.w_w"][late], 1)[0]
    return float(np.sqrt(np.mean(wrong**2))), float(slope)


@pytest.mark.long
def test_chatter_stops_and_a_start_on_the_coast_side_is_found(tmp_path: Path) -> None:
    spec = tmp_path / "spec"
    shutil.copytree(ROOT / "spec" / "ev_driveline", spec)
    (spec / "short.yaml").write_text("language: 1\nvariant: short\nextends: cruise\nhorizon: 6 s\n")
    cruise = mw.simulate("ev_driveline_cruise", "short", root=tmp_path)
    assert not [event for event in cruise.events_of("plant") if event.time > 0.0]
    losses = {
        name: sum(e.target == "gap" and e.time > 1.5 for e in cruise.events_of(name))
        for name in ("est", "hko")
    }
    assert losses["est"] > 20 and losses["hko"] == 0
    (spec / "coasts.yaml").write_text(
        "language: 1\nvariant: coasts\nextends: random_manoeuvre\nhorizon: 0.3 s\n"
        "initial: {plant.theta_b: -0.0256 rad, plant.theta_d: -0.059 rad}\n"
        "inputs: {T_req: {start: -20 N*m}}\n"
    )
    coasts = mw.simulate("ev_driveline_can", "coasts", root=tmp_path)
    assert coasts.signals["hko.mode"][0] == 1
    assert set(coasts.signals["hko.mode"][coasts.times > 0.1]) == {-1}
