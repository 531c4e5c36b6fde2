"""What the study stores of a decision, and the library of an isolated process."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest

from language.overlays.expand_document import Project
from tests.diagnosis.example_report import layers_of, make_dossier
from tests.validation.study.decision_record import record_decision
from tests.validation.study.isolated_process import _copy_library


def test_gains_shares_and_energy_are_stored() -> None:
    project = Project(Path())
    report = make_dossier(project, layers_of(project, ["coulomb_friction@w_em"]))
    assert report.diagnosis
    models = cast(Any, SimpleNamespace(automaton=report.automaton))
    found = record_decision(replace(report.diagnosis, model_set=models))
    name = {"id": "coulomb_friction", "place": "flow.w_em"}
    numbers = {"gain": 90.0, "share": 0.9, "parameters": 2}
    assert found["candidates"] == [{**name, **numbers}]
    assert found["accepted"] == [name]
    assert (found["energy"], found["channels"], found["sampled_energy"]) == (1.0, 1, 200.0)


def test_effects_are_removed_from_a_copy_of_the_library(tmp_path: Path) -> None:
    folder = _copy_library(tmp_path / "effects", ("second_gap", "added_inertia", "compliance"))
    names = {path.stem for path in folder.glob("*.yaml")}
    assert "tyre_slip" in names
    assert not {"second_gap", "backlash", "compliance"} & names
    with pytest.raises(FileNotFoundError):
        _copy_library(tmp_path / "others", ("no_effect",))
