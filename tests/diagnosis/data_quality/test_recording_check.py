"""Recording check: what is told of spoiled recordings, and that good ones are left in peace."""

from __future__ import annotations

import math

import numpy as np
import pytest

from diagnosis.data_quality.excitation import NEED_DESCRIPTIONS
from diagnosis.data_quality.finding import Finding, format_findings
from diagnosis.data_quality.model_agreement import OutputAgreement, compare_signals
from diagnosis.data_quality.output_comparison import OutputComparison
from diagnosis.data_quality.recording_check import check_recordings
from diagnosis.data_quality.unit_sign_clock_errors import agrees_with_other_outputs
from diagnosis.model.placed_effect import shipped_effects
from tests.diagnosis.recording_findings import check, finding_keys
from tests.diagnosis.small_driveline import (
    Spoil,
    Values,
    delay_channel,
    read_recording_map,
    recording_of,
    scale_channel,
    spoil_recording,
    tip_in,
    truncate_recording,
)

RPM = 30.0 / math.pi


def test_nothing_is_told_of_a_good_recording() -> None:
    found = check(spoil_recording())
    assert found.findings == ()
    assert found.is_usable


def test_the_facts_of_a_channel_are_those_it_was_made_with() -> None:
    torque, brake, motor, wheel = check(spoil_recording()).channels
    assert [round(c.rate, 6) for c in (torque, motor, wheel)] == [100.0, 100.0, 100.0]
    assert (torque.quantum, motor.quantum, wheel.quantum) == pytest.approx((0.25, 0.05, 0.01))
    noise = [math.hypot(sd, q / math.sqrt(12)) for sd, q in ((0.3, 0.25), (0.1, 0.05))]
    assert (torque.noise, motor.noise) == pytest.approx(noise, rel=0.15)
    assert (brake.noise, brake.low, brake.high) == (0.0, 0.0, 300.0)


@pytest.mark.parametrize(
    ("spoil", "expected"),
    [
        (scale_channel("motor", RPM), ("error", "unit", "motor")),
        (scale_channel("wheel", RPM), ("error", "unit", "wheel")),
        (scale_channel("torque", 1000.0), ("error", "unit", "torque")),
        (scale_channel("torque", -1.0), ("error", "sign", "torque")),
        (scale_channel("wheel", -1.0), ("error", "sign", "wheel")),
        (delay_channel("wheel", 0.2), ("error", "clock_offset", "wheel")),
        (delay_channel("torque", 0.2), ("error", "clock_offset", "torque")),
        (scale_channel("wheel", 0.0), ("error", "no_signal", "wheel")),
        (scale_channel("torque", 0.0), ("error", "no_signal", "torque")),
    ],
)
def test_a_spoiled_channel_is_named_and_nothing_else(
    spoil: Spoil, expected: tuple[str, str, str]
) -> None:
    found = check(spoil_recording(spoil))
    assert finding_keys(found) == {expected}
    assert not found.is_usable


def test_a_mistake_that_is_in_all_recordings_is_told_once() -> None:
    spoil = scale_channel("motor", RPM)
    found = check(spoil_recording(spoil, "a"), spoil_recording(spoil, "b"))
    (one,) = found.findings
    assert (one.recording, one.channel) == ("", "motor")
    assert one.text.endswith("times what the model gives: rpm taken for rad/s?")


def test_a_mistake_in_one_of_two_recordings_is_told_of_that_one() -> None:
    found = check(
        spoil_recording(scale_channel("wheel", -1.0), "bad"), spoil_recording(None, "good")
    )
    assert [(one.kind, one.recording) for one in found.findings] == [("sign", "bad")]


def test_parameters_that_are_a_fifth_off_and_a_small_delay_are_no_mistake_of_the_data() -> None:
    found = check(spoil_recording(delay_channel("wheel", 0.03)))
    assert found.is_usable and not found.findings


def both(factor: float) -> Spoil:
    def spoil(times: Values, values: dict[str, Values]) -> None:
        values["motor"], values["wheel"] = factor * values["motor"], factor * values["wheel"]

    return spoil


@pytest.mark.parametrize(
    ("spoil", "kind", "channel"),
    [
        (delay_channel("wheel", 0.2), "clock_offset", "wheel"),
        (delay_channel("motor", 0.2), "clock_offset", "motor"),
        (delay_channel("torque", 0.2), "clock_offset", "torque"),
        (scale_channel("motor", -1.0), "sign", "motor"),
        (scale_channel("torque", -1.0), "sign", "torque"),
        (both(RPM), "unit", "motor"),
        (scale_channel("torque", 0.0), "no_signal", "torque"),
        (scale_channel("motor", math.nan), "no_signal", "motor"),
    ],
)
@pytest.mark.parametrize("count", [1, 3])
def test_what_is_bad_is_told_of_one_recording_or_of_all(
    spoil: Spoil, kind: str, channel: str, count: int
) -> None:
    found = check(*[spoil_recording(spoil if k < count else None, f"run_{k}") for k in range(3)])
    errors = [one for one in found.findings if one.severity == "error"]
    assert {(one.kind, one.channel) for one in errors} == {(kind, channel)}
    where = {one.recording for one in errors}
    assert where == {"run_0"} if count == 1 else where in ({""}, {"run_0", "run_1", "run_2"})


def lost(times: Values, values: dict[str, Values]) -> None:
    gone = np.random.default_rng(2).random(len(times)) < 0.2
    for key in values:
        values[key][gone] = np.nan


def held(times: Values, values: dict[str, Values]) -> None:
    gone = np.random.default_rng(2).random(len(times)) < 0.2
    for k in range(1, len(times)):
        for key in values if gone[k] else ():
            values[key][k] = values[key][k - 1]


def test_lost_samples_are_counted() -> None:
    found = check(spoil_recording(lost))
    assert all(c.dropped == pytest.approx(0.2, abs=0.03) for c in found.channels)
    assert ("error", "dropped", "motor") in finding_keys(found)


def test_samples_that_were_held_instead_of_lost_are_seen() -> None:
    found = check(spoil_recording(held))
    assert ("error", "repeated", "motor") in finding_keys(found)


def test_findings_of_one_kind_are_one_line() -> None:
    found = check(spoil_recording(lost, "a"), spoil_recording(lost, "b"))
    assert format_findings(found.findings) == [
        ("error", "`torque`, `brake`, `motor`, `wheel` (a, b): 20% of its samples are missing")
    ]
    (line,) = format_findings(check(spoil_recording(scale_channel("wheel", -1.0))).findings)
    assert line[1].startswith("`wheel` has the wrong sign") and line[1].endswith(" (tip_in)")


def test_a_long_gap_is_told_with_its_place() -> None:
    def gap(times: Values, values: dict[str, Values]) -> None:
        values["wheel"][(times > 3.0) & (times < 3.305)] = np.nan

    (one,) = [f for f in check(spoil_recording(gap)).findings if f.kind == "gap"]
    assert one.window == pytest.approx((3.0, 3.31))
    assert one.text == "has no value for 0.31 s"


def test_a_clipped_and_a_stuck_signal_are_seen() -> None:
    def limit(_: Values, values: dict[str, Values]) -> None:
        values["torque"] = np.minimum(values["torque"], 60.0)
        values["wheel"][300:360] = values["wheel"][300]

    found = finding_keys(check(spoil_recording(limit)))
    assert {("warning", "clipped", "torque"), ("warning", "stuck", "wheel")} <= found


def test_a_short_recording_and_a_still_one_tell_nothing_apart() -> None:
    assert ("error", "too_short", "") in finding_keys(
        check(truncate_recording(spoil_recording(), 0.5))
    )
    times, values = tip_in(constant=True)
    assert ("error", "no_excitation", "") in finding_keys(
        check(recording_of("still", times, values))
    )


def test_what_is_excited_says_which_effects_can_be_tested() -> None:
    def only_forward(times: Values, values: dict[str, Values]) -> None:
        values["motor"] += 200.0
        values["wheel"] += 200.0 / 9.0

    whole = {e.effect: e for e in check(spoil_recording()).excitation.effects}
    assert whole["coulomb_friction"].is_testable and whole["backlash"].is_testable
    forward = {e.effect: e for e in check(spoil_recording(only_forward)).excitation.effects}
    assert forward["backlash"].is_testable
    assert forward["coulomb_friction"].lacking == ("a speed that passes through zero",)
    assert forward["actuator_lag"].is_testable


def test_every_effect_that_is_shipped_says_what_it_needs() -> None:
    for effect in shipped_effects():
        assert effect.needs and set(effect.needs) <= set(NEED_DESCRIPTIONS), effect.name


@pytest.mark.parametrize(
    ("spoil", "expected"),
    [
        (None, set()),
        (delay_channel("wheel", 0.2), {("warning", "clock_offset", "wheel")}),
        (delay_channel("motor", 0.2), {("warning", "clock_offset", "motor")}),
        (scale_channel("wheel", -1.0), {("warning", "sign", "wheel")}),
        (delay_channel("torque", 0.2), set()),
    ],
)
def test_without_a_model_two_speeds_of_one_motion_tell_clocks_and_signs(
    spoil: Spoil | None, expected: set[tuple[str, str, str]]
) -> None:
    one, two = spoil_recording(spoil, "a"), spoil_recording(spoil, "b")
    assert finding_keys(check_recordings([one], read_recording_map())) == expected
    surer = {("error", kind, channel) for _, kind, channel in expected}
    assert finding_keys(check_recordings([one, two], read_recording_map())) == surer


def test_a_piece_of_any_length_is_compared() -> None:
    for count in range(200, 700):
        times: Values = np.asarray(np.arange(count) * 0.01, dtype=np.float64)
        speed: Values = np.sin(3.0 * times) + 0.01 * np.cumsum(np.sin(times))
        late = np.roll(speed, 30)
        found = compare_signals("short", "w", OutputComparison(times, late, speed))
        assert found is None or 0.2 < found.gain < 5.0


@pytest.mark.parametrize(
    ("level", "gain", "is_refuted"),
    [(1.05, 1.2, True), (0.11, 1.2, False), (1.05, 9.0, False)],
    ids=["as large as the other", "as far from it as a unit", "the other is odd too"],
)
def test_a_unit_is_not_blamed_where_outputs_go_together(
    level: float, gain: float, is_refuted: bool
) -> None:
    shaken = OutputAgreement("run", "wheel", 9.0, 0.0, 0.9, 0.9, level)
    other = OutputAgreement("run", "motor", gain, 0.0, 0.9, 0.9, 1.0)
    finding = Finding("unit", "run", "wheel", "rpm taken for rad/s?", "error")
    assert agrees_with_other_outputs(finding, [shaken, other]) is is_refuted
