"""The decision on a rotor stays if files, names, units or effects are written differently."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import pytest

from diagnosis.model.placed_effect import read_effects
from tests.diagnosis.rotor_project import SPEC, write_project
from tests.validation.properties.case_decision import decide_case
from tests.validation.properties.case_transformations import TRANSFORMATIONS
from tests.validation.properties.invariance import difference

BY_NAME = {one.name: one for one in TRANSFORMATIONS}


@pytest.fixture(scope="module")
def project(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The rotor, with a case folder whose spec has no range of a state."""
    folder = write_project(tmp_path_factory.mktemp("rotor") / "project")
    case = folder / "case"
    (case / "train").mkdir(parents=True)
    for k in range(2):
        shutil.copy(folder / f"run_{k}.csv", case / "train")
    text = SPEC.replace(", range: [-300, 300]", "").replace("recording_map: bench_columns\n", "")
    (case / "spec.yaml").write_text(text, "utf-8")
    shutil.copy(folder / "spec" / "bench_columns.yaml", case / "map.yaml")
    return folder


@pytest.fixture(scope="module")
def before(project: Path) -> dict[str, Any]:
    return decide_case(project / "case", effects=read_effects(project / "library"))


LONG = [pytest.param(name, marks=pytest.mark.long) for name in ("effects", "names", "scale_kg")]


@pytest.mark.parametrize("name", ["files", "prefixes", "scale_m", *LONG])
def test_a_rotor_that_is_written_differently_lacks_the_same(
    name: str, project: Path, before: dict[str, Any], tmp_path: Path
) -> None:
    transformation = BY_NAME[name]
    shutil.copytree(project / "case", tmp_path / "case")
    transformation.change(tmp_path / "case")
    effects = read_effects(project / "library")
    after = decide_case(tmp_path / "case", transformation.reverses_effects, effects)
    assert before["effects"][0]["name"] == "coulomb_friction"
    assert difference(before, after, transformation) == ""
    assert after["effects"][0]["gain"] == pytest.approx(before["effects"][0]["gain"], rel=1e-3)
