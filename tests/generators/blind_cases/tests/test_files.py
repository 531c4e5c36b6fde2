"""The written files: same bytes, clean twins, lengths, labels and their seal."""

import hashlib
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.generators.blind_cases.__main__ import main
from tests.generators.blind_cases.label_digest import seal_digest
from tests.generators.blind_cases.manoeuvre import OTHERS, TRAINING
from tests.generators.blind_cases.measurement import COLUMNS

ORDER = "unknown_input+actuator_delay:1,sensor_delay:1"


def written(folder: Path, *words: str) -> tuple[dict[str, bytes], dict[str, Any]]:
    """Run the command line; the files by name and the labels."""
    out, labels = folder / "cases", folder / "secret" / "labels.json"
    given = ["--out", str(out), "--labels", str(labels), "--seed", "9", "--rate", "100"]
    assert main([*given, *words]) == 0
    files = {str(path.relative_to(out)): path.read_bytes() for path in sorted(out.rglob("*.csv"))}
    assert seal_digest(labels) == hashlib.sha256(labels.read_bytes()).hexdigest()
    return files, json.loads(labels.read_text())


@pytest.fixture(scope="module")
def truth(tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[str, bytes], dict[str, Any]]:
    """Two cases with effects."""
    return written(tmp_path_factory.mktemp("truth"), "--effects", ORDER)


@pytest.fixture(scope="module")
def twin(tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[str, bytes], dict[str, Any]]:
    """Their clean twins."""
    folder = tmp_path_factory.mktemp("twin")
    return written(folder, "--effects", ORDER, "--strength", "0")


def test_same_arguments_same_bytes(
    truth: tuple[dict[str, bytes], dict[str, Any]], tmp_path: Path
) -> None:
    """Two processes write what one writes."""
    assert written(tmp_path, "--effects", ORDER, "--jobs", "2") == truth


def test_strength_nought_is_none(
    twin: tuple[dict[str, bytes], dict[str, Any]], tmp_path: Path
) -> None:
    """The clean twin has the bytes of a case that never had an effect."""
    files, labels = twin
    fresh, clean = written(tmp_path, "--effects", "none:1")
    assert clean["cases"]["case_0000"] == labels["cases"]["case_0000"]
    assert all(files[path] == content for path, content in fresh.items())


def test_effects_leave_lengths_and_inputs_alone(
    truth: tuple[dict[str, bytes], dict[str, Any]], twin: tuple[dict[str, bytes], dict[str, Any]]
) -> None:
    """Same names, same sizes; time and inputs the same, outputs not."""
    assert list(truth[0]) == list(twin[0])
    for path, content in truth[0].items():
        assert len(content) == len(twin[0][path])
        one, other = (np.loadtxt(text.decode().splitlines(), delimiter=",", skiprows=1)
                      for text in (content, twin[0][path]))  # fmt: skip
        assert np.array_equal(one[:, :3], other[:, :3])
        assert not np.array_equal(one[:, 3:], other[:, 3:])


def test_columns_and_lengths(truth: tuple[dict[str, bytes], dict[str, Any]]) -> None:
    """Header, rate, number of recordings, seconds in all."""
    files, labels = truth
    for name, case in labels["cases"].items():
        seconds = {"train": 0.0, "held_out": 0.0}
        for part, kinds in case["manoeuvres"].items():
            for index, kind in enumerate(kinds):
                lines = files[f"{name}/{part}/rec_{index:02d}.csv"].decode().split("\n")
                assert lines[0] == COLUMNS
                assert lines[-1] == ""
                assert len(lines) - 2 == round(kind["seconds"] * case["rate_Hz"])
                assert float(lines[2].split(",")[0]) == pytest.approx(1.0 / case["rate_Hz"])
                assert 8.0 <= kind["seconds"] <= 9.5
                seconds[part] += kind["seconds"]
        assert seconds["train"] >= 50.0
        assert seconds["held_out"] >= 30.0


def test_labels(truth: tuple[dict[str, bytes], dict[str, Any]]) -> None:
    """Manoeuvres, windows, places, parameters and base are there."""
    cases = truth[1]["cases"].values()
    for case in cases:
        train = [one["kind"] for one in case["manoeuvres"]["train"]]
        held_out = [one["kind"] for one in case["manoeuvres"]["held_out"]]
        assert set(TRAINING) <= set(train)
        assert len(set(held_out)) == 4
        assert set(held_out) <= set(OTHERS) - set(train)
        assert case["base"]["R"] == 9.0
        assert 0.05 <= abs(case["base"]["k"] / 6000.0 - 1.0) <= 0.2
    found = {effect["id"]: effect for case in cases for effect in case["effects"]}
    assert set(found) == {"unknown_input", "actuator_delay", "sensor_delay"}
    windows = found["unknown_input"]["parameters"]["windows"]
    assert sum(len(one) > 0 for path, one in windows.items() if path.startswith("train")) >= 5
