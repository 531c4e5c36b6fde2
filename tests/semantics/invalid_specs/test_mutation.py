"""Whatever is typed, what comes is problems with places: a check never ends in a defect."""

from __future__ import annotations

import random
from pathlib import Path

import pytest

from modewright.api.spec_check import check_spec, check_without_proofs
from tests.semantics.invalid_specs.cases import ROOT, cases
from tests.semantics.invalid_specs.mutation import spoil_spec

SMALL = 2500
"""Most characters of a spec that is spoilt, so that many are."""
RUNS = 40
SPECS = ROOT / "spec"
UNKNOWN_UNIT = """language: 1
automaton: observing
period: 1 ms
numbers: float64
parameters: {q: {value: 1 m^2/s}, r: {value: 1 m^2}}
inputs: {y_m: {unit: m}}
states: {x: {unit: metre, initial: y_m}}
initial: observe
modes:
  observe:
    observer:
      kalman: {states: [x]}
      A: {}
      measures: {y_m: x}
      process_noise: {x: q}
      measurement_noise: {y_m: r}
outputs: [x]
"""
NO_QUANTITY = """language: 1
study: masses
of: ev_driveline_ideal
scenarios: [tip_out]
vary: {more: {uniform: [in(x), 80 kg]}}
set: {plant.m: 1200 kg + more}
sampling: {sobol: 8, seed: 1}
measures: {loss: {time: plant.no_contact}}
"""


@pytest.mark.parametrize(("text", "kinds"), [(UNKNOWN_UNIT, {"unit"}), (NO_QUANTITY, {"number"})])
def test_what_is_unknown_is_told_once(text: str, kinds: set[str]) -> None:
    name = text.split(":")[2].split()[0]
    path = (ROOT / "spec" / f"{name}.yaml").resolve()
    found = check_spec(str(path), ROOT, {path: text}).problems
    assert {problem.kind for problem in found if problem.severity == "error"} == kinds


def small() -> list[Path]:
    """Return specs of all kinds that are not long."""
    found = [*sorted(SPECS.rglob("*.yaml")), *(case.repaired for case in cases())]
    return [path for path in found if path.suffix == ".yaml" and path.stat().st_size < SMALL]


@pytest.mark.parametrize("seed", range(4))
def test_a_spoilt_spec_is_refused_with_problems(seed: int) -> None:
    chance, paths = random.Random(seed), small()
    for _ in range(RUNS):
        path = chance.choice(paths)
        text = spoil_spec(path.read_text("utf-8"), chance)
        try:
            found = check_without_proofs(str(path), ROOT, {path.resolve(): text}).problems
        except Exception as defect:
            pytest.fail(f"{path.relative_to(ROOT)}: {defect!r}\n{text}")
        assert all(problem.span.source.name for problem in found)
