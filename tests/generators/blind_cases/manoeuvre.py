"""Kinds of manoeuvres: each drives a trip to its end, sizes and times drawn anew."""

from collections.abc import Callable

import numpy as np

from tests.generators.blind_cases.driver_model import Trip

Rng = np.random.Generator
Drive = Callable[[Trip, Rng], None]


def sweep(trip: Trip, rng: Rng) -> None:
    """Sine sweep up to 12 to 15 Hz on a load in one direction."""
    trip.begin(rng.uniform(12.0, 28.0))
    lift = rng.uniform(45.0, 75.0)
    share = rng.uniform(0.45, 0.7)
    trip.sweep = (lift * share, rng.uniform(0.4, 0.8), rng.uniform(12.0, 15.0))
    while trip.left_s > 0.0:
        trip.go(0.05, trip.hold() + lift)


def launch(trip: Trip, rng: Rng) -> None:
    """Rolling back, drive through zero speed, back again, and so on."""
    trip.begin(-rng.uniform(2.5, 7.0))
    trip.go(rng.uniform(0.3, 0.7), rng.uniform(-14.0, -3.0))
    while trip.left_s > 0.0:
        top = rng.uniform(45.0, 150.0)
        trip.go(rng.uniform(0.15, 0.8), 0.0, top)
        trip.go(rng.uniform(0.8, 1.8), top)
        back = -rng.uniform(35.0, 90.0)
        goal = -rng.uniform(1.5, 5.0)
        while trip.left_s > 0.0 and trip.speed > goal:
            trip.go(0.05, back)


def steps(trip: Trip, rng: Rng, low: float, high: float) -> None:
    """Tip-in and tip-out in steps of several sizes about a speed between low and high."""
    about = rng.uniform(low, high)
    trip.begin(about)
    trip.go(rng.uniform(0.3, 0.7), trip.hold() + rng.uniform(10.0, 40.0))
    sizes = (12.0, 30.0, 60.0, 110.0)
    up = False
    while trip.left_s > 0.0:
        size = rng.choice(sizes) * rng.uniform(0.7, 1.3)
        if abs(trip.speed - about) > 4.0:
            up = trip.speed < about
        level = trip.hold() + (size if up else -0.8 * size)
        trip.go(rng.uniform(0.35, 1.0), level)
        up = not up


def steps_low(trip: Trip, rng: Rng) -> None:
    """Steps at low speed."""
    steps(trip, rng, 8.0, 20.0)


def steps_high(trip: Trip, rng: Rng) -> None:
    """Steps at high speed."""
    steps(trip, rng, 50.0, 75.0)


def drive_recuperate(trip: Trip, rng: Rng) -> None:
    """Strong drive and strong recuperation about the same speed."""
    about = rng.uniform(22.0, 55.0)
    trip.begin(about)
    trip.go(rng.uniform(0.4, 0.7), trip.hold() + 5.0)
    while trip.left_s > 0.0:
        trip.go(rng.uniform(0.9, 1.5), rng.uniform(70.0, 160.0))
        trip.go(rng.uniform(0.2, 0.5), trip.hold())
        back = -rng.uniform(50.0, 110.0)
        while trip.left_s > 0.0 and trip.speed > about:
            trip.go(0.05, back)
        trip.go(rng.uniform(0.2, 0.5), trip.hold())


def brake_stop(trip: Trip, rng: Rng) -> None:
    """Brake, drive on, brake to a stop, launch."""
    trip.begin(rng.uniform(28.0, 45.0))
    trip.go(rng.uniform(0.4, 0.8), trip.hold() + rng.uniform(0.0, 25.0))
    trip.go(rng.uniform(0.7, 1.1), -rng.uniform(5.0, 35.0), brake=rng.uniform(500.0, 1100.0))
    trip.go(rng.uniform(1.0, 1.6), rng.uniform(40.0, 110.0))
    strong = rng.uniform(900.0, 1500.0)
    while trip.left_s > 0.0 and trip.speed > 0.6:
        trip.go(0.05, -rng.uniform(0.0, 10.0), brake=strong)
    trip.go(rng.uniform(0.3, 0.6), 0.0, brake=0.6 * strong)
    top = rng.uniform(40.0, 120.0)
    trip.go(rng.uniform(0.2, 0.5), 0.0, top)
    while trip.left_s > 0.0:
        trip.go(rng.uniform(0.6, 1.2), top)
        trip.go(rng.uniform(0.3, 0.8), -rng.uniform(10.0, 50.0))


def brake_pulses(trip: Trip, rng: Rng) -> None:
    """Brake pulses of several sizes while rolling, light drive between."""
    about = rng.uniform(25.0, 60.0)
    trip.begin(about)
    trip.go(rng.uniform(0.4, 0.8), trip.hold() + rng.uniform(5.0, 30.0))
    while trip.left_s > 0.0:
        seconds = rng.uniform(0.4, 0.9)
        trip.go(seconds, -rng.uniform(0.0, 25.0), brake=rng.uniform(300.0, 900.0))
        trip.go(rng.uniform(0.3, 0.6), rng.uniform(-10.0, 10.0))
        lift = rng.uniform(35.0, 110.0)
        trip.go(rng.uniform(0.9, 1.6), trip.hold() + lift * (1.3 if trip.speed < about else 0.5))


def power(trip: Trip, rng: Rng) -> None:
    """Full power, full recuperation, full power again."""
    trip.begin(rng.uniform(14.0, 30.0))
    trip.go(rng.uniform(0.3, 0.6), trip.hold() + rng.uniform(5.0, 20.0))
    while trip.left_s > 0.0:
        full = rng.uniform(205.0, 250.0)
        trip.go(rng.uniform(2.2, 3.4), full)
        trip.go(rng.uniform(1.5, 2.5), -rng.uniform(95.0, 120.0))


def ramps(trip: Trip, rng: Rng) -> None:
    """Torque ramps slow and fast, through zero torque."""
    about = rng.uniform(18.0, 55.0)
    trip.begin(about)
    torque = trip.hold()
    trip.go(0.4, torque)
    up = True
    while trip.left_s > 0.0:
        goal = rng.uniform(50.0, 150.0) if up else -rng.uniform(25.0, 90.0)
        rate = 10.0 ** rng.uniform(1.6, 2.9)
        trip.go(max(0.1, abs(goal - torque) / rate), torque, goal)
        trip.go(rng.uniform(0.1, 0.4), goal)
        torque = goal
        up = trip.speed < about if rng.random() < 0.5 else not up


def coast(trip: Trip, rng: Rng) -> None:
    """Coast-down with small tips of torque."""
    trip.begin(rng.uniform(30.0, 80.0))
    trip.go(rng.uniform(0.3, 0.8), trip.hold())
    while trip.left_s > 0.0:
        trip.go(rng.uniform(0.9, 2.2), 0.0)
        trip.go(rng.uniform(0.15, 0.5), rng.uniform(-30.0, 55.0))


def creep(trip: Trip, rng: Rng) -> None:
    """Slowly forth and back through zero speed."""
    trip.begin(rng.choice([-1.0, 1.0]) * rng.uniform(0.8, 3.0))
    trip.go(rng.uniform(0.2, 0.5), trip.hold())
    while trip.left_s > 0.0:
        forward = trip.speed < 0.0
        goal = rng.uniform(0.8, 3.5) * (1.0 if forward else -1.0)
        torque = rng.uniform(14.0, 38.0) * (1.0 if forward else -1.0)
        while trip.left_s > 0.0 and (trip.speed < goal) == forward:
            trip.go(0.05, torque)
        trip.go(rng.uniform(0.2, 0.7), 0.5 * trip.hold())


def tips(trip: Trip, rng: Rng) -> None:
    """A nervous pedal: tips of any size, steep or less steep."""
    about = rng.uniform(12.0, 60.0)
    trip.begin(about)
    torque = trip.hold()
    trip.go(0.3, torque)
    while trip.left_s > 0.0:
        up = rng.random() < (0.75 if trip.speed < about else 0.3)
        goal = trip.hold() + (rng.uniform(5.0, 150.0) if up else -rng.uniform(5.0, 110.0))
        trip.go(rng.uniform(0.02, 0.25), torque, goal)
        trip.go(rng.uniform(0.15, 0.9), goal)
        torque = goal


def town(trip: Trip, rng: Rng) -> None:
    """Drive, roll, recuperate and brake as in town traffic."""
    trip.begin(rng.uniform(15.0, 38.0))
    trip.go(0.4, trip.hold())
    while trip.left_s > 0.0:
        trip.go(rng.uniform(0.6, 1.4), rng.uniform(50.0, 130.0))
        trip.go(rng.uniform(0.2, 0.7), rng.uniform(-10.0, 15.0))
        if rng.random() < 0.6 and trip.speed > 12.0:
            trip.go(rng.uniform(0.4, 0.9), -rng.uniform(0.0, 40.0), brake=rng.uniform(250.0, 800.0))
        elif trip.speed > 12.0:
            trip.go(rng.uniform(0.5, 1.1), -rng.uniform(40.0, 100.0))


def noise(trip: Trip, rng: Rng) -> None:
    """Random torque of some Hz about the holding one."""
    about = rng.uniform(18.0, 55.0)
    trip.begin(about)
    trip.go(0.3, trip.hold())
    spread = rng.uniform(35.0, 75.0)
    while trip.left_s > 0.0:
        pull = 4.0 * (about - trip.speed)
        trip.go(rng.uniform(0.05, 0.22), trip.hold() + pull + spread * rng.standard_normal())


TRAINING: dict[str, Drive] = {
    "sweep": sweep,
    "launch": launch,
    "steps_low": steps_low,
    "steps_high": steps_high,
    "drive_recuperate": drive_recuperate,
    "brake_stop": brake_stop,
    "brake_pulses": brake_pulses,
    "power": power,
}
"""Recorded in every case's training set."""

OTHERS: dict[str, Drive] = {
    "ramps": ramps,
    "coast": coast,
    "creep": creep,
    "tips": tips,
    "town": town,
    "noise": noise,
}
"""One of these is the last training recording, four others are held out."""
