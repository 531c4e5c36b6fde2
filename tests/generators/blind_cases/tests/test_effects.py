"""Every effect shows at strength 1, fades with strength, and bears a name of the brief."""

import numpy as np
import pytest

from tests.generators.blind_cases.effect_catalogue import CATALOGUE, find_conflict
from tests.generators.blind_cases.effect_free_comparison import case_of, clean_recordings, contrast

SHOWING = 3.0
"""Standard deviations of noise."""

UNSCALED = ("sensor_scale",)
"""A constant re-scaling is this effect itself: it is judged without one."""

BEST_SEEN_IN = {
    "sweep": ("stiffness_hysteresis", "added_inertia"),
    "brake_stop": ("brake_drag",),
    "brake_pulses": ("brake_drag",),
    "launch": ("torque_ripple", "sensor_offset", "coulomb_friction"),
}


def serials(name: str) -> list[int]:
    """Training recordings, those first in which the effect should show best."""
    kinds = [recording.manoeuvre for recording in clean_recordings()]
    return sorted(range(len(kinds)), key=lambda one: name not in BEST_SEEN_IN.get(kinds[one], ()))


@pytest.mark.long
@pytest.mark.parametrize("name", CATALOGUE)
def test_shows_in_two_training_recordings(name: str) -> None:
    """At strength 1 by 3 standard deviations in at least two of them."""
    showing = 0
    for serial in serials(name):
        showing += contrast((name,), serial, 1.0, name not in UNSCALED) >= SHOWING
        if showing == 2:
            return
    pytest.fail(f"{name} shows in {showing} training recordings")


@pytest.mark.parametrize("name", CATALOGUE)
def test_fades_with_strength(name: str) -> None:
    """Where it shows, a twentieth of it moves much less."""
    scaled = name not in UNSCALED
    strong, serial = next(
        (value, serial)
        for serial in serials(name)
        if (value := contrast((name,), serial, 1.0, scaled)) >= SHOWING
    )
    assert contrast((name,), serial, 0.05, scaled) < 0.4 * strong


def test_strength_nought_is_clean() -> None:
    """No number is changed."""
    for name in CATALOGUE:
        assert case_of((name,), 0.0).physics == case_of(()).physics


def test_effects_change_nothing_else() -> None:
    """Base, instruments and manoeuvres are those of the clean twin."""
    clean, other = case_of(()), case_of(("tyre_slip", "brake_drag"))
    assert clean.base == other.base
    assert clean.instruments == other.instruments
    for one, two in zip(clean.recordings, other.recordings, strict=True):
        assert one.key == two.key
        assert one.windows == two.windows
        assert one.slope == two.slope
        assert np.array_equal(one.demand, two.demand)
        assert np.array_equal(one.road, two.road)


def test_a_pair_has_the_numbers_of_the_single_effects() -> None:
    """Another effect beside it does not change an effect's draw."""
    both = case_of(("tyre_slip", "brake_drag")).numbers
    assert both["tyre_slip"] == case_of(("tyre_slip",)).numbers["tyre_slip"]
    assert both["brake_drag"] == case_of(("brake_drag",)).numbers["brake_drag"]


def test_places_and_number() -> None:
    """All 26 effects, each at a place the tool knows."""
    places = {effect.place for effect in CATALOGUE.values()}
    assert len(CATALOGUE) == 26
    assert places == {
        "inputs.T_em", "flow.w_em", "flow.w_w", "elements.half_shaft", "elements.vehicle",
        "outputs.w_s",
    }  # fmt: skip


def test_conflicts_are_named() -> None:
    """Unknown names, doubles and two forms of the same part."""
    assert find_conflict(("tyre_slip", "brake_drag")) == ""
    assert "no effect" in find_conflict(("tyre_slop",))
    assert "twice" in find_conflict(("tyre_slip", "tyre_slip"))
    assert "group" in find_conflict(("added_inertia", "tyre_slip"))
