"""Claims: what the paper says of its figures, beside what is measured here."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from tests.validation.paper.divergence import FITTED, Divergence, fit_divergence
from tests.validation.paper.manoeuvre import (
    STEP,
    cycles,
    landing_lead_time,
    run_scenario,
    signal,
    table_1,
)

PUBLISHED = {"100": 14.0, "1000": 2.0, "10000": 0.8}
"""Table 1 [ms], by rate [Hz]."""
PERIOD = 0.01
"""Of the samples at 100 Hz [s]."""
RPM = 30.0 / np.pi


@dataclass(frozen=True)
class Claim:
    """What the paper says of a figure, what is measured, and whether both agree."""

    figure: str
    says: str
    measured: str
    holds: bool
    because: str = ""


def claims() -> list[Claim]:
    """Return all claims in the order of the paper."""
    driven = (("fig_3", "car_tip_out"), ("fig_5", "car_tip_in"))
    fitted = [_divergence(figure, fit_divergence(scenario)) for figure, scenario in driven]
    return [*fitted, *quick_claims()]


def quick_claims() -> list[Claim]:
    """Return the claims for which no model is fitted."""
    return [*_shuffle(), *_slow_estimator(), *_fast_estimator(), *_three_rates(), _table()]


def _shuffle() -> Iterator[Claim]:
    tip_out, step = run_scenario("paper_tip_out"), run_scenario("paper_step")
    _, rising = cycles(tip_out.times, signal(tip_out, "plant.w_d"), STEP)
    _, steady = cycles(step.times, signal(step, "plant.w_d"), STEP)
    yield Claim(
        "fig_4a",
        "the frequency of the shuffle rises while gaps are crossed",
        f"{rising[0]:.2f} Hz in the first cycle, {rising[-1]:.2f} Hz in the last",
        bool(np.all(np.diff(rising[:4]) > 0.0) and rising[0] < 0.9 * rising[-1]),
    )
    yield Claim(
        "fig_4b",
        "in contact it is constant, and that of 4a comes to it",
        f"{steady.min():.2f} to {steady.max():.2f} Hz",
        bool(np.ptp(steady) < 0.01 and abs(rising[-1] - steady[-1]) < 0.01),
    )


def _divergence(figure: str, found: Divergence) -> Claim:
    early, middle, late = found.error[:3]
    car, model = found.frequencies
    values = f"k_hs {found.values['k_hs']:.0f} N*m/rad, c_hs {found.values['c_hs']:.1f} N*m*s/rad"
    return Claim(
        figure,
        "a model tuned right after the event follows it; about 1 s later the frequencies differ",
        f"off by {early:.1%} of the shuffle for {FITTED} s, by {middle:.0%} until 0.7 s and by "
        f"{late:.0%} until 1 s; from 0.7 s on the first four cycles of the twist have {car:.2f} Hz "
        f"in the car and {model:.2f} Hz in the model ({values})",
        early < 0.03 and late > 0.3,
        "The recordings of the paper are not published. The vehicle here is synthetic: a fifth of "
        "its stiffness is rubber that slides at 25 N*m. It reproduces the reported difference; it "
        "does not identify its cause in the vehicle of the paper.",
    )


def _off(instance: str, name: str, in_gaps: bool = False) -> float:
    """Return the root mean square of what an estimator misses of the plant's, from the step on."""
    found = run_scenario("paper_tip_out")
    wrong = signal(found, f"{instance}.{name}") - signal(found, f"plant.{name}")
    kept = found.times > STEP
    if in_gaps:
        kept &= found.signals["plant.mode"] == 0
    return float(np.sqrt(np.mean(wrong[kept] ** 2)))


def _torque_off(instance: str) -> float:
    """Return the same of the torque, as a part of its size."""
    found = run_scenario("paper_tip_out")
    size = np.sqrt(np.mean(found.signals["plant.T_hs"][found.times > STEP] ** 2))
    return _off(instance, "T_hs") / float(size)


def _torque_at_100_hz() -> tuple[float, float]:
    """Return what a torque that is held between samples misses, and what the estimator misses at
    samples after the last gap, both as a part of the torque's size.
    """
    found = run_scenario("paper_tip_out")
    true, own = signal(found, "plant.T_hs"), signal(found, "at_100Hz.T_hs")
    samples = np.isclose(found.times, np.round(found.times / PERIOD) * PERIOD, atol=1e-9)
    (places,) = np.nonzero(samples)
    held = true[places[np.searchsorted(places, np.arange(len(true)), side="right") - 1]]
    after = found.times > STEP
    size = np.sqrt(np.mean(true[after] ** 2))
    last = max(event.time for event in found.events_of("at_100Hz")) + PERIOD
    late = samples & (found.times > last)
    return (
        float(np.sqrt(np.mean((held - true)[after] ** 2)) / size),
        float(np.sqrt(np.mean((own - true)[late] ** 2)) / size),
    )


def _wrong_modes(until: float = 0.3) -> float:
    """Return for which part of a time after the step [s] the slow estimator's mode is wrong."""
    found = run_scenario("paper_tip_out")
    kept = (found.times > STEP) & (found.times < STEP + until)
    wrong = found.signals["at_100Hz.mode"] != found.signals["plant.mode"]
    return float(np.mean(wrong[kept]))


def _slow_estimator() -> Iterator[Claim]:
    speeds = [RPM * _off("at_100Hz", name) for name in ("w_em", "w_w")]
    twist = 1e3 * _off("at_100Hz", "theta_d")
    yield Claim(
        "fig_8",
        "the measured speeds are well matched by the filter",
        f"off by {speeds[0]:.1f} and {speeds[1]:.2f} rpm (root mean squares from the step on, gaps "
        f"and the hold of 10 ms included). The twist is off by {twist:.0f} mrad: the scheme of "
        "Fig. 7 has none while it reports a gap, which the picture shows as 0",
        speeds[0] < 30.0 and speeds[1] < 1.0,
    )
    share, held, rest = _torque_off("at_100Hz"), *_torque_at_100_hz()
    yield Claim(
        "fig_9",
        "the torque matches its reference in general, in contact",
        f"off by {share:.0%} of its size; the true torque, held for the 10 ms between samples, "
        f"would be off by {held:.0%}. After the last gap it is off by {rest:.1%} at the samples: "
        "the rest is missed in the gaps",
        rest < 0.02,
    )
    left = landing_lead_time("at_100Hz")
    yield Claim(
        "fig_10",
        "at 10 ms the gap is reported about when the other side is hit",
        f"the first gap is reported {left:.1f} ms before the coast side is hit. In the 0.3 s after "
        f"the step the mode is another one than the plant's for {_wrong_modes():.0%} of the time",
        0.0 < left < 10.0,
    )


def _fast_estimator() -> Iterator[Claim]:
    share, place = _torque_off("at_1kHz"), 1e3 * _off("at_1kHz", "theta_b", in_gaps=True)
    yield Claim(
        "fig_11",
        "at 1 kHz estimates match the simulation",
        f"torque off by {share:.1%} of its size; while the plant is in a gap the position there is "
        f"off by {place:.2f} mrad of 51",
        share < 0.05 and place < 2.0,
    )
    found = run_scenario("paper_tip_out")
    seen, true = (len(found.events_of(name)) for name in ("at_1kHz", "plant"))
    yield Claim(
        "fig_12",
        "changes of mode are seen promptly",
        f"{seen} changes for {true} of the plant, the first {table_1()['1000']:.2f} ms late",
        seen == true,
    )


def _three_rates() -> Iterator[Claim]:
    errors = [_torque_off(name) for name in ("at_100Hz", "at_1kHz", "at_10kHz")]
    shown = ", ".join(f"{error:.1%}" for error in errors)
    yield Claim(
        "fig_13",
        "a delay is seen at 100 Hz; 1 kHz and 10 kHz are close to the reference",
        f"torque off by {shown} of its size",
        errors[0] > 5.0 * errors[1] and max(errors[1:]) < 0.05,
    )
    late = table_1()
    yield Claim(
        "fig_14",
        "modes at 100 Hz are considerably later",
        f"the first gap is reported {late['100']:.1f} ms, {late['1000']:.2f} ms and "
        f"{late['10000']:.2f} ms late",
        late["100"] > 5.0 * late["1000"],
    )


def _table() -> Claim:
    late = table_1()
    return Claim(
        "Table 1",
        "14, 2 and 0.8 ms at 0.1, 1 and 10 kHz",
        ", ".join(f"{value:.2f}" for value in late.values()) + " ms",
        all(abs(late[rate] - published) < 0.1 for rate, published in PUBLISHED.items()),
        "The paper states neither the length of the wait nor the instant of the torque step nor "
        "all parameters. They were chosen to give its three numbers: a wait of 0.7 ms, rounded up "
        "to whole samples, and a step 1.5 ms before a sample at 100 Hz. One set of values gives "
        "all three; the random manoeuvres below evaluate the scheme.",
    )
