"""Pictures: the figures of the paper, from the runs of `spec/paper`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.signal import ShortTimeFFT
from scipy.signal.windows import gaussian

import modewright as mw
from tests.validation.paper.frequency_divergence import fit_divergence
from tests.validation.paper.manoeuvre import RATES, STEP, cycles, run_scenario, signal

TRUTH, PAPER, OTHER = "#444a52", "#20639b", "#c0392b"
RPM = 30.0 / np.pi
MODES = (1, 0, -1)
Drawing = Callable[[], Figure]


def panels(rows: int, height: float = 1.7) -> tuple[Figure, list[Axes]]:
    """Return a figure with panels over one time."""
    figure = Figure(figsize=(8.0, 0.6 + height * rows), layout="constrained")
    axes = figure.subplots(rows, 1, sharex=True, squeeze=False)[:, 0]
    for each in axes:
        each.grid(alpha=0.25)
    axes[-1].set_xlabel("time after the step [s]")
    return figure, list(axes)


def traces(scenario: str, mode: str) -> Figure:
    """Motor torque, motor speed and wheel speed of the car and of the fitted model: Figs 3, 5."""
    car, fitted = run_scenario(scenario, "paper_car"), fit_divergence(scenario)
    t = car.times - STEP
    figure, (torque, motor, wheel) = panels(3)
    step = np.where(t < 0.0, *((30.0, -20.0) if mode == "tip-out" else (-20.0, 30.0)))
    torque.step(t, step, color=TRUTH, where="post")
    torque.set_ylabel("T_EM [N*m]")
    motor.plot(t, RPM * fitted.car, color=TRUTH, label="car (stands for the measurement)")
    motor.plot(t, RPM * fitted.model, color=OTHER, lw=1.0, ls="--", label="model, fitted to 0.35 s")
    motor.axvspan(0.0, 0.35, color=PAPER, alpha=0.08)
    motor.set_ylabel("w_EM [rpm]")
    motor.legend(loc="lower right" if mode == "tip-in" else "upper right", fontsize=8)
    wheel.plot(t, RPM * car.signals["car.w_w"], color=TRUTH)
    wheel.set_ylabel("w_w [rpm]")
    wheel.set_xlim(-0.1, 1.9)
    return figure


def spectrogram(scenario: str) -> Figure:
    """Shuffle of the motor speed over time and frequency, with each cycle's own: Fig. 4."""
    found = run_scenario(scenario)
    t, w = found.times, signal(found, "plant.w_d")
    rate = 1.0 / float(t[1] - t[0])
    kept = t >= STEP
    window = gaussian(int(0.5 * rate), std=0.09 * rate, sym=True)
    transform = ShortTimeFFT(window, hop=20, fs=rate, mfft=2**15)
    power = np.abs(transform.stft(w[kept]))
    times, frequencies = transform.t(int(kept.sum())), transform.f
    band = (frequencies > 2.0) & (frequencies < 12.0)
    figure = Figure(figsize=(8.0, 3.6), layout="constrained")
    axes = figure.add_subplot()
    inside = (times >= 0.0) & (times <= 1.9)
    level = 20.0 * np.log10(power[band][:, inside] + 1e-12)
    shown = axes.pcolormesh(
        times[inside], frequencies[band], level, cmap="Blues", vmin=level.max() - 40.0,
        shading="auto", rasterized=True,
    )  # fmt: skip
    ends, each = cycles(t, w, STEP)
    axes.plot(ends - STEP, each, "o-", color=OTHER, ms=4, lw=0.8, label="each cycle of the twist")
    axes.set_xlabel("time after the step [s]")
    axes.set_ylabel("frequency [Hz]")
    axes.legend(loc="upper right", fontsize=8)
    figure.colorbar(shown, label="twist's rate [dB of 1 rad/s]")
    return figure


def filter_states() -> Figure:
    """The states of the Kalman filter at 100 Hz beside what is measured: Fig. 8."""
    figure, axes = panels(3)
    for each, name, factor, unit in zip(
        axes, ("w_em", "w_w", "theta_d"), (RPM, RPM, 1e3), ("rpm", "rpm", "mrad"), strict=True
    ):
        _beside(each, name, factor, {"at_100Hz": "estimator, 100 Hz"})
        each.set_ylabel(f"{name} [{unit}]")
    axes[0].legend(loc="upper right", fontsize=8)
    axes[-1].set_xlim(-0.1, 1.4)
    return figure


def one_signal(
    name: str, factor: float, unit: str, shown: Mapping[str, str], until: float
) -> Figure:
    """One signal of the plant and of estimators: Figs 9."""
    figure, (axes,) = panels(1, 2.6)
    _beside(axes, name, factor, shown)
    axes.set_ylabel(f"{name} [{unit}]")
    axes.legend(loc="upper right", fontsize=8)
    axes.set_xlim(-0.1, until)
    return figure


def outputs(shown: Mapping[str, str], until: float) -> Figure:
    """theta_b, w_b, theta_d and T_hs of the plant and of estimators: Figs 11, 13."""
    figure, axes = panels(4, 1.4)
    for each, (name, factor, unit) in zip(
        axes,
        (("theta_b", 1e3, "mrad"), ("w_b", 1.0, "rad/s"), ("theta_d", 1e3, "mrad"),
         ("T_hs", 1.0, "N*m")),
        strict=True,
    ):  # fmt: skip
        _beside(each, name, factor, shown)
        each.set_ylabel(f"{name} [{unit}]")
    figure.legend(
        *axes[0].get_legend_handles_labels(), loc="outside upper right", fontsize=8, ncols=4
    )
    axes[-1].set_xlim(-0.05, until)
    return figure


def modes(shown: Mapping[str, str], until: float) -> Figure:
    """Position in the gap and modes of the plant and of estimators: Figs 10, 12, 14."""
    found = run_scenario("paper_tip_out")
    t = found.times - STEP
    figure, axes = panels(1 + len(shown), 1.2)
    axes[0].plot(t, 1e3 * found.signals["plant.theta_b"], color=TRUTH)
    axes[0].set_ylabel("theta_b [mrad]")
    for each, (instance, label) in zip(axes[1:], shown.items(), strict=True):
        each.step(t, found.signals["plant.mode"], color=TRUTH, where="post", label="plant")
        each.step(
            t, found.signals[f"{instance}.mode"], color=OTHER, where="post", lw=1.0, label=label
        )
        each.set_yticks(MODES, ["drive", "gap", "coast"])
        each.legend(loc="upper right", fontsize=8)
        for event in found.events_of(instance):
            if event.target == "gap" and event.time > STEP:
                each.axvline(event.time - STEP, color=OTHER, ls=":", lw=0.8)
    axes[-1].set_xlim(-0.02, until)
    return figure


def _beside(axes: Axes, name: str, factor: float, shown: Mapping[str, str]) -> None:
    found: mw.Trajectory = run_scenario("paper_tip_out")
    t = found.times - STEP
    plant = factor * signal(found, f"plant.{name}")
    axes.plot(t, plant, color=TRUTH, lw=1.0, ls=(0, (4, 2)), zorder=5, label="plant")
    for (instance, label), colour in zip(shown.items(), (OTHER, PAPER, "#2a9d5c"), strict=False):
        own = factor * signal(found, f"{instance}.{name}")
        axes.step(t, own, color=colour, lw=1.0, where="post", label=label)


LABELS = {name: f"estimator, {rate} Hz" for rate, name in RATES.items()}
FIGURES: dict[str, Drawing] = {
    "fig_3": lambda: traces("car_tip_out", "tip-out"),
    "fig_4a": lambda: spectrogram("paper_tip_out"),
    "fig_4b": lambda: spectrogram("paper_step"),
    "fig_5": lambda: traces("car_tip_in", "tip-in"),
    "fig_8": filter_states,
    "fig_9": lambda: one_signal("T_hs", 1.0, "N*m", {"at_100Hz": LABELS["at_100Hz"]}, 1.4),
    "fig_10": lambda: modes({"at_100Hz": LABELS["at_100Hz"]}, 0.3),
    "fig_11": lambda: outputs({"at_1kHz": LABELS["at_1kHz"]}, 0.7),
    "fig_12": lambda: modes({"at_1kHz": LABELS["at_1kHz"]}, 0.7),
    "fig_13": lambda: outputs(LABELS, 0.3),
    "fig_14": lambda: modes(LABELS, 0.3),
}


def draw(folder: Path) -> None:
    """Draw all figures into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, drawing in FIGURES.items():
        drawing().savefig(folder / f"{name}.png", dpi=110, metadata={"Software": None})
