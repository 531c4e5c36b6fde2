"""Thresholds come from recordings that the model itself would have given."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

import diagnosis.selection.bootstrap as bootstrap
from diagnosis.criterion.threshold import (
    DEFAULT_THRESHOLD,
    Thresholds,
    format_thresholds,
    read_thresholds,
)
from diagnosis.data.sampled_recording import SampledRecording
from diagnosis.estimation.estimate import Estimate
from diagnosis.estimation.innovations import measured_noise_levels
from diagnosis.estimation.model_set import ModelSet, balance_disturbances
from diagnosis.estimation.noise_level import fit_with_noise
from diagnosis.model.placed_effect import (
    PlacedEffect,
    disturbance_effect,
    find_placements,
    shipped_effects,
)
from diagnosis.selection.bootstrap import (
    MAX_THRESHOLD,
    MIN_THRESHOLD,
    bootstrap_thresholds,
    cached_thresholds,
    exponential_tail_quantile,
    round_to_preferred,
    threshold_key,
    thresholds_of,
)
from diagnosis.selection.output_error import OUTPUT_ERROR_THRESHOLDS
from diagnosis.selection.replicate import simulate_replicate
from language.loading.load import automaton_of
from language.overlays.expand_document import expand_document
from modewright.api.diagnosis import diagnose
from tests.language.spec_builders import ROOT, SHIPPED, document

TEXT = """language: 1
automaton: wheel
parameters:
  J: {value: 2 kg*m^2, range: [1, 4]}
  b: {value: 0.4 N*m*s/rad, range: [0.1, 1]}
inputs: {T: {unit: N*m}}
states: {w: {unit: rad/s, initial: 1 rad/s, range: [-100, 100]}}
flow: {w: J * der(w) = T - b * w}
outputs: [w]
"""
PERIOD = Fraction(1, 50)
COUNT = 300
DRIFT = "drift_balance_w"


def recorded(seed: int) -> SampledRecording:
    """Return a recording that nothing is known of but that it moves, in quanta of 0.01 rad/s."""
    random = np.random.default_rng(seed)
    torque = np.repeat(random.normal(0.0, 8.0, 6), COUNT // 6)
    speed, speeds = 5.0, []
    for value in torque:
        speeds.append(speed)
        speed += float(PERIOD) * (value - 0.4 * speed) / 2.0
    measured = np.round((np.array(speeds) + random.normal(0.0, 0.03, COUNT)) / 0.01) * 0.01
    return SampledRecording(
        f"{seed}", PERIOD, Fraction(0), torque[:, np.newaxis], measured[:, np.newaxis]
    )


@pytest.fixture(scope="module")
def bench() -> ModelSet:
    made = expand_document(document(TEXT), SHIPPED)
    automaton = automaton_of(made, SHIPPED)
    effects = [e for e in shipped_effects() if e.name in ("coulomb_friction", "torque_offset")]
    series = (recorded(1), recorded(2))
    drifts = balance_disturbances(made, automaton)
    return ModelSet(made, SHIPPED, automaton, tuple(effects), series, ("w",), drifts)


@pytest.fixture(scope="module")
def base(bench: ModelSet) -> Estimate:
    noises = measured_noise_levels(bench.series, {DRIFT: 0.5})
    return fit_with_noise(bench.compile_candidate(()), bench.series, noises, {}, {DRIFT: 1.0})


@pytest.fixture
def kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A cache of thresholds of its own, for three replicates."""
    folder = tmp_path / "thresholds"
    folder.mkdir()
    monkeypatch.setattr(bootstrap, "cache_subfolder", lambda part: tmp_path / part)
    monkeypatch.setattr(bootstrap, "REPLICATES", 3)
    yield folder


def test_the_same_seed_gives_the_same_recordings(bench: ModelSet, base: Estimate) -> None:
    place = (base.candidate, base, bench.series)
    first, again, other = (
        simulate_replicate(*place, np.random.default_rng((5, number))) for number in (0, 0, 1)
    )
    assert first and again and other
    assert all(np.array_equal(a.measured, b.measured) for a, b in zip(first, again, strict=True))
    assert not np.array_equal(first[0].measured, other[0].measured)


def test_noise_quanta_and_gaps_are_those_of_the_recording(bench: ModelSet, base: Estimate) -> None:
    gappy = dataclasses.replace(bench.series[0], measured=bench.series[0].measured.copy())
    gappy.measured[7::50] = np.nan
    noises = dataclasses.replace(base.noise_levels, process={})
    calm = dataclasses.replace(base, noise_levels=noises)
    made = [
        simulate_replicate(base.candidate, calm, (gappy,), np.random.default_rng(k)) for k in (1, 2)
    ]
    first, second = (one[0].measured[:, 0] for one in made if one)
    known = np.isfinite(gappy.measured[:, 0])
    assert np.array_equal(np.isfinite(first), known)
    assert np.max(np.abs(first[known] / 0.01 - np.round(first[known] / 0.01))) < 1e-6
    difference = (first - second)[known]
    assert np.std(difference) == pytest.approx(2.0**0.5 * 0.03, rel=0.2)


def test_a_drift_is_a_slow_torque_of_its_size(bench: ModelSet, base: Estimate) -> None:
    """Between two runs of the same inputs: w' = (d1 - d2 - b w) / J, each d of 0.5 N*m."""
    quiet = dataclasses.replace(base.noise_levels, process={DRIFT: 0.5})
    model = dataclasses.replace(base, noise_levels=quiet)
    long = dataclasses.replace(
        bench.series[0], inputs=np.zeros((20000, 1)), measured=np.ones((20000, 1))
    )
    made = simulate_replicate(base.candidate, model, (long,), np.random.default_rng(3))
    assert made is not None
    values = base.values(0)
    rate, memory = values["b"] / values["J"], base.candidate.compiled.memories[0]
    spread = 0.5 / values["J"] * (1.0 / (rate * (rate + 1.0 / memory))) ** 0.5
    assert np.std(made[0].measured[2000:]) == pytest.approx(spread, rel=0.2)


def test_what_was_done_before_a_kill_is_not_done_again(
    bench: ModelSet, base: Estimate, kept: Path
) -> None:
    told: list[str] = []

    def ended(text: str) -> None:
        told.append(text)
        if text.startswith("bootstrap 2"):
            raise KeyboardInterrupt

    assert cached_thresholds(bench, bench.series) is None
    with pytest.raises(KeyboardInterrupt):
        bootstrap_thresholds(bench, base, {DRIFT: 1.0}, bench.series, ended)
    assert cached_thresholds(bench, bench.series) is None
    told.clear()
    found = bootstrap_thresholds(bench, base, {DRIFT: 1.0}, bench.series, told.append)
    assert [text.split(":")[0] for text in told] == ["bootstrap 3 of 3"]
    assert cached_thresholds(bench, bench.series) == found
    (file,) = kept.iterdir()
    in_parts = file.read_text()
    file.unlink()
    assert bootstrap_thresholds(bench, base, {DRIFT: 1.0}, bench.series) == found
    assert file.read_text() == in_parts
    stored = json.loads(in_parts)
    assert stored["format"] == "modewright-replicates/1" and len(stored["replicates"]) == 3
    file.write_text(json.dumps(stored["replicates"]))  # as it was written without a version
    assert cached_thresholds(bench, bench.series) == found


def test_cases_of_a_spec_rate_and_rounded_length_share_thresholds(bench: ModelSet) -> None:
    key = threshold_key(bench, bench.series)
    (one, two), text = bench.series, TEXT.replace("value: 2 kg", "value: 3 kg")
    shorter = dataclasses.replace(two, inputs=two.inputs[:-30], measured=two.measured[:-30])
    faster = [dataclasses.replace(s, period=Fraction(1, 100)) for s in (one, one, two, two)]
    other = dataclasses.replace(bench, document=expand_document(document(text), SHIPPED))
    fewer = dataclasses.replace(bench, effects=bench.effects[:1])
    assert threshold_key(bench, (shorter, one)) == key
    assert threshold_key(bench, (one,) * 6) != key
    assert threshold_key(bench, faster) != key
    assert threshold_key(other, bench.series) != key
    assert threshold_key(fewer, bench.series) != key


def test_lengths_are_rounded_by_their_ratio() -> None:
    assert [
        round_to_preferred(s) for s in (0.9, 13.0, 15.0, 31.0, 32.0, 54.0, 70.0, 72.0, 800.0)
    ] == [*(1.0, 10.0, 20.0, 20.0, 50.0, 50.0, 50.0, 100.0, 1000.0)]


def test_the_tail_of_an_exponential_distribution_is_found() -> None:
    """Its quantile is log(1 / (1 - level))."""
    values = -np.log(1.0 - (np.arange(400) + 0.5) / 400)
    assert exponential_tail_quantile(values.tolist(), 0.975) == pytest.approx(
        np.log(40.0), rel=0.03
    )
    lost = [*values.tolist()[:-1], 1e6]
    assert exponential_tail_quantile(lost, 0.975) == pytest.approx(np.log(40.0), rel=0.03)
    assert exponential_tail_quantile([0.0] * 30, 0.975) == 0.0


def test_what_gains_often_needs_more_and_nothing_needs_less_than_the_floor() -> None:
    replicates = [{"slow": 10.0 + 2.0 * k, "brisk": 1.0} for k in range(20)] + [{}] * 10
    found = thresholds_of(replicates)
    assert 48.0 < found.groups["slow"] < MAX_THRESHOLD
    assert found.groups["brisk"] == MIN_THRESHOLD
    assert found.default == MIN_THRESHOLD
    lost = [{"slow": 900.0}] * 10 + [{}] * 6
    assert thresholds_of(lost).groups["slow"] == MAX_THRESHOLD
    assert thresholds_of([{}] * 30) == Thresholds({}, MIN_THRESHOLD, found.origin, mode_factor=1.0)


def test_thresholds_are_those_of_an_effect_at_all_its_places(bench: ModelSet) -> None:
    friction, offset = bench.effects
    found = Thresholds({"coulomb_friction": 30.0}, 25.0)
    assert found.threshold_of(find_placements(bench.document, friction)[0]) == 30.0
    assert found.threshold_of(find_placements(bench.document, offset)[0]) == 25.0
    assert found.threshold_of(disturbance_effect("balance", "w")) == 25.0
    assert (found.text, found.largest, Thresholds().text) == ("25 to 30", 30.0, "75")


def test_an_effect_that_brings_modes_has_to_gain_twice_the_usual() -> None:
    gap = next(effect for effect in shipped_effects() if effect.name == "backlash")
    layer = PlacedEffect(gap, "half_shaft", "half_shaft")
    assert Thresholds().threshold_of(layer) == 2.0 * DEFAULT_THRESHOLD
    assert Thresholds({"backlash": 60.0}).threshold_of(layer) == 60.0
    assert OUTPUT_ERROR_THRESHOLDS.threshold_of(layer) == OUTPUT_ERROR_THRESHOLDS.default


def test_thresholds_are_read_as_they_were_written(tmp_path: Path) -> None:
    file = tmp_path / "thresholds.json"
    found = Thresholds({"backlash": 31.25}, 25.0, "by 30 replicates", mode_factor=1.0)
    file.write_text(format_thresholds(found))
    assert read_thresholds(file) == found


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("{", "cannot be read"),
        ("[]", "its format is not"),
        ('{"format": "modewright-thresholds/1", "usual": 0}', "above 0"),
        ('{"format": "modewright-thresholds/1", "effects": {"backlash": true}}', "above 0"),
        ('{"format": "modewright-thresholds/1", "effects": {"backlash": NaN}}', "above 0"),
        ('{"format": "modewright-thresholds/1", "effects": [1]}', "above 0"),
    ],
)
def test_other_files_are_refused(tmp_path: Path, text: str, told: str) -> None:
    file = tmp_path / "thresholds.json"
    file.write_text(text)
    with pytest.raises(ValueError, match=told):
        read_thresholds(file)


def test_a_word_for_thresholds_that_is_none_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="`bootstrp`: neither one of kept, bootstrap, usual nor"):
        diagnose("blind_driveline", [tmp_path / "a.csv"], root=ROOT, thresholds="bootstrp")
