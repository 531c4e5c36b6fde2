"""Values of variants: which values of sensors and clocks are legal, and what a stage of 0 is."""

from __future__ import annotations

from pathlib import Path

import pytest

from engine.simulation.simulate import simulate
from language.loading.scenario_reader import read_scenario
from language.loading.system_reader import read_system
from language.overlays.expand_document import Project, read_document
from sweep.definition.study import Study
from sweep.definition.study_reader import read_study
from sweep.design.variant import variants_of
from sweep.design.variant_system import apply_to_system
from sweep.design.variant_values import VariantValues, variant_values_of
from tests.language.spec_builders import project_of

OVEN = """language: 1
automaton: oven
step: 5 ms
states: {x: {unit: m, initial: 1 m}}
flow: {x: der(x) = -x / 1 s}
modes: {only: {}}
outputs: [x]
"""
STAGES = {
    "filter.lag": "filter: {lag: 50 ms}",
    "delay": "delay: 20 ms",
    "noise.sd": "noise: {sd: 0.1 m}",
    "quantise": "quantise: 0.001 m",
    "sample": "sample: 10 ms",
}
RUN = "language: 1\nscenario: run\nof: rig\nhorizon: 0.3 s\nrecord: {every: 10 ms}\n"
STUDY = """language: 1
study: zero
of: rig
scenarios: [run]
vary: {STAGE: [VALUES]}
measures: {last: {final: s}}
"""


def system_text(*stages: str) -> str:
    sensor = ", ".join(("of: oven.x", *(STAGES[stage] for stage in stages)))
    return (
        "language: 1\nsystem: rig\ninstances: {oven: {of: oven}}\n"
        f"sensors: {{s: {{{sensor}}}}}\noutputs: {{seen: s}}\n"
    )


def study_of(folder: Path, name: str, values: str) -> tuple[Study, Project]:
    """Return the study that gives a stage or clock some values."""
    study = STUDY.replace("STAGE", name).replace("VALUES", values)
    project = project_of(folder, oven=OVEN, rig=system_text(*STAGES), run=RUN, zero=study)
    return read_study(read_document(project.path_of("zero")), project), project


def values_of(study: Study, count: int) -> list[VariantValues]:
    return [variant_values_of(study, variant) for variant in variants_of(study, 0, count)]


def sensor_values(project: Project, *structural: VariantValues) -> list[float]:
    """Return the signal of the sensor, with values of a variant applied to the system."""
    system = read_system(read_document(project.path_of("rig")), project)
    scenario = read_scenario(read_document(project.path_of("run")), project, system)
    for values in structural:
        system = apply_to_system(system, values.structural_values)
    return [float(value) for value in simulate(system, scenario).signals["s"]]


@pytest.mark.parametrize("stage", ["filter.lag", "delay", "noise.sd", "quantise"])
def test_a_stage_of_0_is_legal_and_absent(tmp_path: Path, stage: str) -> None:
    unit = "m" if stage in ("noise.sd", "quantise") else "s"
    study, project = study_of(tmp_path, f"s.{stage}", f"0 {unit}, 0.01 {unit}")
    absent, present = values_of(study, 2)
    assert (absent.refusal, present.refusal) == ("", "")
    found = sensor_values(project, absent)
    assert found != sensor_values(project, present)
    (tmp_path / "without").mkdir()
    others = [other for other in STAGES if other != stage]
    without = project_of(tmp_path / "without", oven=OVEN, rig=system_text(*others), run=RUN)
    assert found == sensor_values(without)


@pytest.mark.parametrize(
    ("name", "values", "refusals"),
    [
        ("s.delay", "-1 ms, 1 ms", ["`s.delay` = -0.001 is below zero", ""]),
        ("s.noise.sd", "-1 m, 0 m", ["`s.noise` = -1 is below zero", ""]),
        ("s.sample", "0 s, 1 ms", ["`s.period` = 0 is not above zero", ""]),
        ("oven.step", "0 s, 5 ms", ["`oven.step` = 0 is not above zero", ""]),
        ("oven.offset", "-1 ms, 0 s", ["`oven.offset` = -0.001 is below zero", ""]),
    ],
)
def test_negative_values_and_periods_of_0_are_refused(
    tmp_path: Path, name: str, values: str, refusals: list[str]
) -> None:
    study, _ = study_of(tmp_path, name, values)
    assert [each.refusal for each in values_of(study, 2)] == refusals
