"""The generator's forms are not in the library, but where a physics has one form only.

Each effect of the generator is compared in numbers: the library's family of laws is fitted to
the generator's own law (its C, along a typical excitation) and must leave more than rounding.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from tests.generators.blind_cases.effect_catalogue import CATALOGUE
from tests.generators.blind_cases.effect_free_comparison import case_of
from tests.validation.functional_forms.form_comparison import COMPARISONS
from tests.validation.functional_forms.generator_forms import evaluate_path

LEAST = 0.002
"""Of an effect's departure from the clean law, left by the best fit of the library's family."""

ONE_FORM: Mapping[str, str] = {
    "torque_offset": "a constant on the torque: there is no other constant",
    "sensor_offset": "a constant on the reading: there is no other constant",
    "sensor_scale": "a factor on the reading: there is no other factor",
    "road_grade": "a weight on a slope is a load; that it changes on the way is no law of it",
    "unknown_input": "any course of a torque over time; the library has no course, it estimates",
}
"""Effects whose physics has one form, and why: for them nothing can be compared."""

NEIGHBOURS: Mapping[str, Mapping[str, float]] = {
    "actuator_delay": {"input_frame_s": 2e-4, "input_jitter_s": 0.0},
    "torque_rate_limit": {"rate_in_band": 1.0},
    "torque_ripple": {"ripple_scale": 0.0},
    "coulomb_friction": {"slip_angle": 1e-4},
    "stribeck_friction": {"bristle_stiffness": 1e5, "bristle_exponent": 2.0},
    "unequal_half_shafts": {"gap_shift": 0.0},
    "position_dependent_stiffness": {"joint_1": 1e-4, "joint_3": 5e-5},
    "mount_compliance": {"mount_k_2": 0.0},
    "added_inertia": {"tyre_k_2": 0.0},
    "tyre_slip": {
        "magic_D": 3e6, "magic_C": 1.0, "magic_B": 4e-3, "magic_E": 0.0, "creep_c": 0.0,
    },
    "sensor_eccentricity": {"eccentricity": 1e-4},
    "sensor_delay": {"sense_frame_s": 2e-4, "sense_jitter_s": 0.0},
}  # fmt: skip
"""Numbers that no draw gives, with which the generator's law is, or nearly is, the library's."""


@cache
def fitted(name: str, number: int) -> tuple[float, str]:
    """What the best fit leaves of the effect, and its numbers."""
    left, numbers = COMPARISONS[name](case_of((name,), 1.0, number).physics).fit()
    return left, str(numbers)


def test_an_effect_is_compared_or_has_one_form_only() -> None:
    assert set(ONE_FORM) == set(CATALOGUE) - set(COMPARISONS)
    assert set(COMPARISONS) <= set(CATALOGUE)
    assert all(ONE_FORM.values())


@pytest.mark.parametrize(
    ("name", "number"),
    [*((name, 3) for name in COMPARISONS), ("stiffness_nonlinear", 5)],
)
def test_the_library_does_not_have_the_form_of_the_generator(name: str, number: int) -> None:
    """Of cases 3 and 5: in the one the knee softens, in the other it hardens."""
    left, numbers = fitted(name, number)
    assert left >= LEAST, f"{name}: {left:.3%} of the effect is left at {numbers}"


@pytest.mark.parametrize("name", NEIGHBOURS)
def test_it_is_the_form_and_not_the_fit_that_leaves_something(name: str) -> None:
    """Where the generator's numbers make the library's form of it, the fit finds that."""
    left, _ = fitted(name, 3)
    physics = replace(case_of((name,), 1.0, 3).physics, **NEIGHBOURS[name])
    alike, _ = COMPARISONS[name](physics).fit()
    assert alike <= left / 5, f"{name}: {alike:.3%} is left of the library's own, {left:.3%} of it"


def test_a_constant_and_a_factor_are_the_same_in_both() -> None:
    """The known equalities of the list above, as far as they are laws."""
    u, w = np.linspace(-100, 200, 31), np.linspace(-5, 80, 31)
    torque = case_of(("torque_offset",), 1.0, 3).physics
    assert np.allclose(
        evaluate_path(torque, 0.001, {"demand": u})["motor"], u + torque.torque_offset
    )
    for name in ("sensor_offset", "sensor_scale"):
        p = case_of((name,), 1.0, 3).physics
        read = evaluate_path(p, 0.001, {"W_W": w})["encoder"]
        assert np.allclose(read, p.sense_scale * w + p.sense_offset)
