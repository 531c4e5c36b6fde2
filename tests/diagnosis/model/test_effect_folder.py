"""Effects of a user's folder: twins are refused, and what no place takes is told."""

from __future__ import annotations

from pathlib import Path

import pytest

from diagnosis.model.effect_library import explain_unplaceable, load_effects
from language.overlays.expand_document import Project, expand_document, read_document
from language.text.diagnostic import SpecError

EFFECT = """language: 1
effect: {name}
about: friction of a form of its own
at: {{balance: {{of: rate{has}}}}}
parameters: {{T_o: {{value: 1, unit: $force, range: [0, 10], neutral: 0}}}}
terms: {{$x: {{own: {term}}}}}
"""


def write(folder: Path, name: str, term: str, has: str = "", file: str = "") -> None:
    text = EFFECT.format(name=name, term=term, has=has)
    (folder / f"{file or name}.yaml").write_text(text)


def told(folder: Path) -> list[str]:
    project = Project(Path())
    document = expand_document(read_document(project.path_of("blind_driveline")), project)
    return list(explain_unplaceable(load_effects(folder), document, project))


def test_an_effect_that_can_be_laid_is_not_told(tmp_path: Path) -> None:
    write(tmp_path, "rub", "-T_o * tanh($x / (1 rad/s))")
    assert told(tmp_path) == []


def test_a_mistake_of_dimension_is_told_with_its_place(tmp_path: Path) -> None:
    write(tmp_path, "rub", "-T_o * $x")
    (text,) = told(tmp_path)
    assert text.startswith("effect `rub` is not tried: at `w_em`: ")
    assert "rub.yaml:6:" in text and "joins" in text


def test_an_effect_that_fits_no_place_is_told(tmp_path: Path) -> None:
    write(tmp_path, "rub", "-T_o * $tyre / $tyre", ", has: [tyre]")
    assert told(tmp_path) == ["effect `rub` is not tried: it fits no place of `blind_driveline`"]


def test_two_effects_of_one_name_are_refused(tmp_path: Path) -> None:
    write(tmp_path, "rub", "-T_o * tanh($x / (1 rad/s))")
    write(tmp_path, "rub", "-T_o * tanh($x / (2 rad/s))", file="second")
    with pytest.raises(SpecError, match=r"second.yaml:2:9.*`rub` is defined twice"):
        load_effects(tmp_path)


def test_a_folder_without_an_effect_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="there is no effect in"):
        load_effects(tmp_path)
